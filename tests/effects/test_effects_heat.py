"""Temperatures of a film: Petroff's power in, conduction and flow out, clearance and viscosity with them."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from reynolds import kernels
from rotorsim.base.errors import MachineFileError, NoLiftOffError
from rotorsim.effects.film.heat_balance import heat_balance
from rotorsim.experiments import Runup
from rotorsim.experiments.running import record as record_run
from rotorsim.machine import load_machine
from rotorsim.machine.gas_film import GASES
from rotorsim.plant import Plant

GRID = {"grid.n_theta": 16, "grid.n_z": 8}
SPEED, BELOW_WHIRL = 3000.0, 900.0
GENTLE = {"friction_share": 1.0, "journal_conductance": 0.5, "sleeve_conductance": 2.0}


def two_films(values=()):
    """The rigid rotor on two self-acting films without weight, with heat in both; gap and gas are at neutral values."""
    machine = load_machine("rigid_rotor_self_acting").with_(GRID | {"effects.gravity.acceleration": 0.0})
    heat = {f"effects.heat_balance.{key}": value for key, value in (GENTLE | dict(values)).items()}
    for name in ("heat_balance", "clearance_growth", "gas_heating"):
        machine = machine.replace(f"effects.{name}", {})
    return machine.with_(heat)


def rest(heat, p):
    """Rises of gas, journal and sleeve from the three balances as a linear system."""
    wall, flow = p.wall, p.flow * p.gas_capacity
    a = [
        [2 * wall + flow, -wall, -wall],
        [-wall, wall + p.journal_conductance, 0],
        [-wall, 0, wall + p.sleeve_conductance],
    ]
    return np.linalg.solve(a, [heat, 0, 0])


NUMBERS = SimpleNamespace(
    wall=4.0, gas_capacity=1000.0, flow=2e-4, friction_share=1.0, journal_conductance=0.5, sleeve_conductance=2.0,
    journal_capacity=90.0, sleeve_capacity=90.0,
)  # fmt: skip


def moved(p, rate, power, flow, steps=1):
    """Rises from cold after some samples."""
    w = np.zeros(3)
    for _ in range(steps):
        getattr(heat_balance, "py_func", heat_balance)(w, 0, rate, power, flow, p)
    return w


def test_temperatures_rest_where_the_three_balances_are_even():
    found = moved(NUMBERS, 0.0, 12.0, NUMBERS.flow)
    assert found == pytest.approx(rest(12.0, NUMBERS), rel=1e-12)
    lost = found[0] * NUMBERS.flow * 1000 + 0.5 * found[1] + 2.0 * found[2]
    assert lost == pytest.approx(12.0, rel=1e-12)


def test_walls_alike_warm_up_along_the_exponential_with_an_error_of_first_order():
    p = SimpleNamespace(**vars(NUMBERS) | {"sleeve_conductance": 0.5})
    seconds, goal = 100.0, 12.0 / (2 * 0.5)
    exact = goal * (1 - np.exp(-seconds * 0.5 / 90.0))
    errors = [abs(moved(p, n / seconds, 12.0, 0.0, n)[1] - exact) for n in (200, 400)]
    assert errors[1] < 1e-3 * exact
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.01)


def test_a_journal_in_the_middle_of_its_sleeve_is_heated_by_petroffs_power():
    machine = two_films({"journal_expansion": 0.0, "sleeve_expansion": 0.0})
    film, gas = machine.films[0], machine.gas
    petroff = 2 * np.pi * gas.mu * SPEED**2 * (film.diameter / 2) ** 3 * film.length / film.clearance
    p = SimpleNamespace(
        **vars(machine.effects["heat_balance"][0]), **machine.effects["heat_balance"][0].derived(machine)
    )
    p.flow = 0.0
    rises = np.zeros(3)
    for _ in range(50):
        tau, s = 1 + rises[0] / gas.temperature, GASES["air"].sutherland / gas.temperature
        rises = rest(petroff * tau**1.5 * (1 + s) / (tau + s), p)
    found = Plant(machine).equilibrium(SPEED, 0.0).temperature_rises
    assert rises[0] > 1.0
    assert found == pytest.approx(np.array([rises, rises]), rel=1e-6)


def test_gap_and_viscosity_are_those_of_warm_walls_and_warm_gas():
    load = {"effects.gravity.acceleration": 9.81}
    hot = Plant(two_films({"journal_conductance": 0.05, "journal_expansion": 1.5e-5}).with_(load)).equilibrium(
        SPEED, 0.0
    )
    gas, journal, sleeve = hot.temperature_rises[0]
    assert journal > sleeve + 0.3
    machine = two_films({"friction_share": 0.0}).with_(load)
    grown = (1.15e-5 * sleeve - 1.5e-5 * journal) / 1.15e-5
    warm = {"effects.clearance_growth.temperature": float(grown), "effects.gas_heating.rise": float(gas)}
    cold = Plant(machine.with_(warm)).equilibrium(SPEED, 0.0)
    assert hot.h_min == pytest.approx(cold.h_min, rel=1e-6)
    assert hot.journals == pytest.approx(cold.journals, rel=1e-5)
    without = Plant(two_films({"friction_share": 0.0}).with_(load)).equilibrium(SPEED, 0.0)
    assert abs(hot.h_min / without.h_min - 1) > 1e-3


def test_a_run_from_cold_ends_at_the_equilibriums_temperatures_which_its_record_names():
    weight = {"effects.gravity.acceleration": 9.81}
    plant = Plant(two_films({"journal_capacity": 0.02, "sleeve_capacity": 0.05}).with_(weight))
    simulation = plant.start(BELOW_WHIRL, 0.0)
    rises = plant.equilibrium(BELOW_WHIRL, 0.0).temperature_rises
    heat = slice(plant.assembly.rig.heat, plant.assembly.rig.heat + 6)
    assert simulation.w[heat] == pytest.approx(rises.ravel())
    simulation.w[heat] = 0.0
    inputs = np.zeros((round(0.4 / plant.machine.sampling_time), 6))
    inputs[:, 0] = BELOW_WHIRL
    table = simulation.advance(inputs)
    assert table[1, -5] < 0.1 * rises[0, 1]
    assert table[-1, -6:] == pytest.approx(rises.ravel(), rel=1e-3)
    record = plant.simulate(0.004, speed=BELOW_WHIRL, pressure=0.0)
    assert record["temperature_rise"].sel(body="left journal").values == pytest.approx(rises[0, 1], rel=1e-3)


LOBES = {"count": 3, "preload": 0.4, "offset": 0.7, "first_angle": "20 deg"}
FORMS = {
    "plain": {},
    "lobes": {"lobes": LOBES | {"offset": 0.5}},
    "pockets": {"steps": [{"count": 3, "depth": "8 um", "arc": "40 deg", "length": "30 mm"}]},
    "axial grooves": {"steps": [{"count": 4, "depth": "8 um", "arc": "20 deg"}]},
    "recesses": {"steps": [{"count": 4, "depth": "8 um", "arc": "45 deg", "length": "20 mm"}]},
    "foil": {"foil": {"stiffness": "20 GN/m^3", "loss_factor": 0.2}},
    "foil with lobes that jump": {"lobes": LOBES, "foil": {"stiffness": "20 GN/m^3", "loss_factor": 0.2}},
    "herringbone": {"grooves": {"on": "sleeve", "depth": "10 um", "share": 0.5, "angle": "28 deg", "land": "9 mm"}},
    "grooved journal": {"grooves": {"on": "journal", "depth": "10 um", "share": 0.5, "angle": "28 deg"}},
    "spiral": {"grooves": {"on": "sleeve", "pattern": "spiral", "depth": "10 um", "share": 0.5, "angle": "28 deg"}},
}
PAIRS = [
    ("plain", "lobes"), ("pockets", "foil with lobes that jump"), ("herringbone", "grooved journal"),
    ("spiral", "recesses"), ("axial grooves", "foil"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("path", ["0 um", "0.068 um"], ids=["no slip", "slip"])
@pytest.mark.parametrize("pair", PAIRS, ids=" and ".join)
def test_the_heat_of_a_film_of_any_form_is_its_friction_power(pair, path):
    """Films without a feed lose through their walls what torque times speed puts in; with the torque of `reynolds`.

    A free path of 0 is no slip to the last bit, in the same kernels.
    """
    machine = two_films().replace("effects.slip", {"mean_free_path": path})
    for k, name in enumerate(pair):
        for key, value in FORMS[name].items():
            machine = machine.replace(f"bearings.{k}.{key}", value)
    plant = Plant(machine)
    simulation, a = plant.start(SPEED, 0.0), plant.assembly
    rises = plant.equilibrium(SPEED, 0.0).temperature_rises
    lost = GENTLE["journal_conductance"] * rises[:, 1] + GENTLE["sleeve_conductance"] * rises[:, 2]
    torques = [
        kernels.friction_torque(a.film_part(simulation.w, k), a.film_constants(k), a.film, SPEED) for k in range(2)
    ]
    assert lost == pytest.approx(np.array(torques) * SPEED, rel=1e-6)
    assert min(torques) > 0


def test_a_journal_that_loses_no_heat_closes_its_gap_which_is_said():
    machine = two_films({"journal_conductance": 1e-3, "sleeve_expansion": 0.0, "journal_expansion": 1e-4})
    with pytest.raises(NoLiftOffError, match="does not carry"):
        Plant(machine).equilibrium(4 * SPEED, 0.0)


@pytest.mark.parametrize(("tables", "sentence"), [
    ([{"friction_share": 1.0}, {"friction_share": 0.5}], "there are 2 of them"),
    ([{"bearing": 0}, {"bearing": 0}], "there are 2 of them"),
    ([{"friction_share": 1.5}], "friction_share"),
    ([{"journal_conductance": 0.0}], "journal_conductance"),
])  # fmt: skip
def test_balances_that_make_no_sense_are_refused(tables, sentence):
    with pytest.raises(MachineFileError, match=sentence):
        load_machine("rigid_rotor_self_acting").replace("effects.heat_balance", tables)


def test_films_of_different_sizes_have_a_balance_each():
    machine = load_machine("rigid_rotor_self_acting").replace("bearings.1.clearance", "15 um")
    with pytest.raises(MachineFileError, match=r"heat_balance\.bearing: is missing, and the films differ"):
        machine.replace("effects.heat_balance", {"friction_share": 1.0})
    each = machine.replace("effects.heat_balance", [{"friction_share": 1.0, "bearing": k} for k in (0, 1)])
    assert len(each.effects["heat_balance"]) == 2


def test_a_run_up_s_file_keeps_the_temperatures_by_name(tmp_path):
    machine = two_films({"journal_capacity": 0.02, "sleeve_capacity": 0.05})
    weight = {"effects.gravity.acceleration": 9.81}
    path = tmp_path / "r.nc"
    record_run(machine.with_(weight), Runup(start=400.0, stop=600.0, rate=4000.0), path)
    record = xr.open_dataset(path, engine="h5netcdf")
    names = [f"{bearing} {body}" for bearing in ("left", "right") for body in ("gas", "journal", "sleeve")]
    assert record["body"].values.tolist() == names
    rise = record["temperature_rise"].sel(body="left gas")
    assert rise[-1] > 0 and record["temperature_rise"].attrs["units"] == "K"
