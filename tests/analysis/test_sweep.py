"""Sweeps and linear analyses over speed against the analyses they are made of, and against fe_shaft and the plant."""

import numpy as np
import pytest

import rotorsim as rs
from fe_shaft.response import run_unbalance_response
from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.whirl_onset import stability_limit
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.effects.rotor.unbalance import RotorUnbalance
from rotorsim.plant.linearise import region_up_to

pytestmark = pytest.mark.numerical
RPM = np.pi / 30


@pytest.fixture(scope="module")
def plant(rig):
    return rig()


@pytest.fixture(scope="module")
def swept(plant):
    over = {"bearings.1.clearance": "24 um, 26 um", "pressure": "0.05 MPa, 0.5 MPa"}
    return rs.analysis.sweep(plant, over, ("lift_off", "onset", "flow", "damping", "load"))


def test_a_cell_is_what_the_machine_of_that_cell_gives(plant, swept):
    own = rs.Plant(plant.machine.replace("bearings.1.clearance", "26 um"))
    here = swept.data.isel(bearings_1_clearance=1, pressure=1)
    assert float(here["flow"]) == pytest.approx(own.equilibrium(0.0, 0.5e6).mass_flow.sum(), rel=1e-12)
    region = region_up_to(own.assembly.mesh.reduced.frequencies, highest_speed(own))
    s = np.linalg.eigvals(own.linearise(0.0, 0.5e6).A)
    s = s[region.holds(s)]
    assert float(here["damping"]) == pytest.approx(np.min(-s.real / np.abs(s)), rel=1e-6)
    assert float(here["onset"]) == pytest.approx(
        float(rs.analysis.whirl_onset(own, [0.5e6])["onset_speed"][0]), rel=2e-5
    )
    assert float(swept.data["lift_off"][1]) == rs.analysis.lift_off(own, [0.0])[0]


def test_a_quantity_has_those_axes_alone_that_change_it(swept):
    assert swept.data["lift_off"].dims == ("bearings_1_clearance",)
    assert swept.data["onset"].dims == ("bearings_1_clearance", "pressure")


def test_where_the_film_does_not_carry_a_cell_is_empty_and_its_reason_is_counted(swept):
    assert np.isnan(swept.data["flow"].values[:, 0]).all() and np.isfinite(swept.data["flow"].values[:, 1]).all()
    assert swept.reasons["flow"] == {"the film does not carry the rotor": 2}
    assert swept.complete and swept.best["flow"]["at"] == {"bearings.1.clearance": "24 um", "pressure": "0.5 MPa"}


def test_the_load_capacity_is_the_weight_that_brings_the_journal_to_half_of_its_clearance(plant):
    load = rs.analysis.load_capacity(plant, 0.0, 0.5e6)
    gravity = plant.machine.effects["gravity"][0].acceleration
    heavier = plant.machine.with_({"effects.gravity.0.acceleration": load / plant.machine.mass})
    assert load / plant.machine.mass > gravity
    assert rs.Plant(heavier).equilibrium(0.0, 0.5e6).eccentricity_ratio == pytest.approx(0.5, rel=1e-3)


def test_the_stability_limit_is_the_onset_of_the_scan(plant):
    assert stability_limit(plant, 0.5e6, 40e3 * RPM)[0] == pytest.approx(
        float(rs.analysis.whirl_onset(plant, [0.5e6])["onset_speed"][0]), rel=2e-5
    )


def test_percent_is_of_the_machines_own_value_and_a_star_stands_for_every_entry(plant):
    own = plant.machine.film.clearance
    found = rs.analysis.sweep(plant, ["bearings.*.clearance=-10%:+10%:3"], "flow")
    axis = found.data["bearings_*_clearance"]
    assert axis.values * 1e-6 == pytest.approx([0.9 * own, own, 1.1 * own])


@pytest.mark.parametrize(
    ("over", "what", "sentence"),
    [
        ((), "flow", "no axis is given"),
        (["bearings.1.clearance=20 um:30 um:0"], "flow", "is not FROM:TO:COUNT"),
        (["bearings.1.clearance=20 um:30 um:10000000"], "flow", "is not FROM:TO:COUNT"),
        (["bearings.1.clearance=20 um:30 um:1000", "speed=0 rpm:9 rpm:1000"], "flow", "above the limit of 100000"),
        (["bearings.1.clearence=20 um:30 um:3"], "flow", "did you mean 'clearance'"),
        (["pressur=0.3 MPa:0.5 MPa:3"], "flow", "did you mean 'pressure'"),
        (["bearings.1.clearance=20:30:3"], "flow", "bearings.1.clearance"),
        (["bearings.1.clearance=30 um:20 um:3"], "flow", "is not above the one before it"),
        (["bearings.1.clearance=-5 um:20 um:3"], "flow", "must be above 0"),
        (["speed=-10%:10%:3"], "flow", "is no value of the machine"),
        (["pressure=0.3 MPa, 0.5 MPa"], "lift_off", "does not change lift_off"),
        (["pressure=0.3 MPa, 0.5 MPa"], "onst", "did you mean 'onset'"),
        (["pressure=0.3 MPa, 0.5 MPa"], "", "no quantity is named"),
        (["pressure=0.3 MPa, 0.5 MPa", "pressure=0.6 MPa"], "flow", "is given twice"),
    ],
)
def test_bad_axes_and_quantities_are_one_sentence(plant, over, what, sentence):
    with pytest.raises((DataError, MachineFileError)) as caught:
        rs.analysis.sweep(plant, over, what)
    assert sentence in str(caught.value) and len(str(caught.value).splitlines()) == 1


def test_a_sweep_in_a_folder_is_the_one_in_memory(plant, swept, tmp_path):
    over = {"bearings.1.clearance": "24 um, 26 um", "pressure": "0.05 MPa, 0.5 MPa"}
    settings = rs.campaign.Settings(workers=1)
    found = rs.campaign.sweep_in_folder(plant, over, tmp_path / "s", ("lift_off", "flow"), settings=settings)
    for name in ("lift_off", "flow"):
        np.testing.assert_array_equal(found.data[name].values, swept.data[name].values)
        assert found.reasons.get(name) == swept.reasons.get(name)


def test_the_response_of_a_rotor_without_films_is_that_of_fe_shaft():
    """The machine's modes against all of them, without the modes' own damping: 4e-6 of the peak is left out."""
    plant = rs.Plant(rs.load_machine("plain_rotor").replace("shaft.damping_ratio", 0.0))
    mesh, speeds = plant.assembly.mesh, np.linspace(50.0, 900.0, 30)
    disc = plant.machine.discs[0].position
    found = rs.analysis.unbalance_response(plant, speeds, 0.0, [RotorUnbalance(me=1e-5)])
    node = mesh.node(disc)
    whole = run_unbalance_response(mesh.rotor, node, 1e-5, 0.0, speeds).response[4 * node]
    x = found["response_re"].sel(place="disc 0", axis="x") + 1j * found["response_im"].sel(place="disc 0", axis="x")
    assert np.abs(x.values - whole).max() < 1e-5 * np.abs(whole).max()


def test_the_response_on_a_film_is_the_steady_whirl_of_the_simulation(plant):
    """A small unbalance at constant speed: amplitude at 1X after the start has decayed, to 1 %."""
    me, speed = 1e-7, 300.0
    changes = {
        "effects": {k: v for k, v in plant.machine.effects.items() if k == "gravity"}
        | {"unbalance": (RotorUnbalance(me=me),)}
    }
    own = rs.Plant(plant.machine.with_(changes))
    found = rs.analysis.unbalance_response(own, [speed], 0.5e6)
    turns = round(8 * 2 * np.pi / speed / 2e-4) * 2e-4
    record = own.simulate(0.6 + turns, speed, 0.5e6)
    t, x = record["time"].values, record["disc"].sel(axis="x").values
    late = t >= t[-1] - turns
    size = abs(2 * np.mean((x[late] - x[late].mean()) * np.exp(-1j * speed * t[late])))
    here = found.sel(place="measuring plane", axis="x").isel(speed=0)
    assert size == pytest.approx(float(np.hypot(here["response_re"], here["response_im"])), rel=0.01)


def test_a_campbell_diagram_from_0_hz_follows_the_modes_of_the_linear_model():
    plant = rs.Plant("plain_rotor")
    speeds = np.linspace(0.0, 900.0, 7)
    found = rs.analysis.campbell(plant, speeds, modes=6)
    for k, speed in enumerate(speeds):
        model = plant.linearise(float(speed), 0.0)
        lowest = np.sort(model.wn[model.zeta < 0.5])[:6]
        assert np.sort(found["wn"].values[:, k])[: len(lowest)] == pytest.approx(lowest, rel=1e-9)
    assert set(found["critical_order"].values) == {1, 2, 3} and (found["missing"] == 0).all()


def test_the_critical_speeds_of_a_stiffer_bearing_are_not_lower():
    found = rs.analysis.critical_speed_map(rs.Plant("plain_rotor"), points=8)
    assert (np.diff(found["wn"].values[:2], axis=1) > 0).all()
