"""Signatures of the effects on film, injectors and supply, one switched on at a time on the rig."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from reynolds import GasBearing, Injector
from rotorsim.base.errors import NoLiftOffError
from rotorsim.machine.gas_film import GASES
from rotorsim.plant.simulation import coupled_effects

SAMPLE = 2e-4
HZ = 2 * np.pi
SPEED, PRESSURE = 100 * np.pi, 0.5e6
PEDESTAL = 100 * HZ
"""The pedestal's own frequency [rad/s]: while it is rigid it is a mode of the model that nothing moves."""


def modes(model):
    """Eigenvalues of the two critical speeds: the lowest but a rigid pedestal's, x before y."""
    return np.array([s for s in model.eigenvalues if abs(abs(s) - PEDESTAL) > 1e-6][:2])


def same(one, other, speed=SPEED, pressure=PRESSURE):
    """Both machines rest alike and have the same modes, to what Newton's method and the eigenvalue solver leave."""
    a, b = one.equilibrium(speed, pressure), other.equilibrium(speed, pressure)
    assert a.journal == pytest.approx(b.journal, abs=1e-12)
    assert a.mass_flow == pytest.approx(b.mass_flow, rel=1e-7)
    assert modes(one.linearise(speed, pressure)) == pytest.approx(modes(other.linearise(speed, pressure)), rel=1e-6)


def test_the_film_does_not_care_which_way_the_sleeve_is_tilted_but_that_it_is(neutral):
    """z -> -z turns one tilt into the other; the change is even, hence quadratic: 3 % from the fourth power at .2 mrad.

    Without tilt the whole film gives what the half gives.
    """

    def rest(tilt):
        values = {"grid.symmetry": "none", "effects.journal_tilt.y": f"{tilt} mrad"}
        return neutral(values).equilibrium(SPEED, PRESSURE).journal

    half = neutral().equilibrium(SPEED, PRESSURE).journal
    assert rest(0.0) == pytest.approx(half, abs=1e-12)
    assert rest(0.2) == pytest.approx(rest(-0.2), abs=1e-12)
    small, large = rest(0.1) - half, rest(0.2) - half
    assert np.abs(large).max() > 1e-8
    assert large == pytest.approx(4 * small, abs=0.03 * np.abs(large).max())


def test_a_journal_of_one_lobe_is_an_eccentric_journal(neutral):
    """h = c - (X + a e) n: the journal rests a against the lobe's direction, and a sleeve's lobe is a displaced sleeve.

    The rotor hangs on a ball bearing, so its load is the same; 3 nm are left to the shaft's inclination.
    """
    plain = neutral().equilibrium(SPEED, PRESSURE).journal
    at = np.radians(30)
    for part, sign in (("journal", -1), ("sleeve", 1)):
        values = {part: "1 um", f"{part}_lobes": 1, f"{part}_phase": "30 deg"}
        plant = neutral({f"effects.out_of_round.{key}": value for key, value in values.items()})
        shift = plant.equilibrium(SPEED, PRESSURE).journal - plain
        assert shift == pytest.approx(sign * 1e-6 * np.array([np.cos(at), np.sin(at)]), abs=3e-9)


def test_an_oval_sleeve_splits_the_critical_speeds_and_the_split_turns_with_it(neutral):
    """Wider along x: softer in x, stiffer in y, and the other way round along y; to first order the opposite change."""

    def split(phase, height="0.5 um"):
        values = {"sleeve": height, "sleeve_phase": phase}
        plant = neutral({f"effects.out_of_round.{key}": value for key, value in values.items()})
        x, y = np.abs(modes(plant.linearise(0.0, PRESSURE))) / HZ
        return y - x

    round_, wide_x, wide_y = split("0 deg", "0 um"), split("0 deg"), split("90 deg")
    assert wide_x > round_ + 0.5 and wide_y < round_ - 0.5
    assert wide_x + wide_y == pytest.approx(2 * round_, abs=0.1 * (wide_x - wide_y))


def disc_orders(plant, held, hertz, highest=5):
    """Amplitudes of the disc at multiples of a speed with whole turns in 5000 samples."""
    run = plant.start(hertz * HZ, PRESSURE)
    run.advance(held(2500, hertz * HZ, PRESSURE))
    table = run.advance(held(5000, hertz * HZ, PRESSURE))
    turn = np.exp(-1j * np.arange(highest + 1) * table[:, 4, None])
    return 2 * np.abs(turn.T @ table[:, :2]) / len(table)


@pytest.mark.parametrize("lobes", [2, 3])
def test_lobes_on_the_journal_pump_at_their_number_times_the_speed(neutral, held, lobes):
    """Lobes of .2 um at 25 Hz: the line of their order stands 20 times above the others, and doubles with the lobes."""
    found = []
    for height in ("0.1 um", "0.2 um"):
        values = {"journal": height, "journal_lobes": lobes}
        plant = neutral({f"effects.out_of_round.{key}": value for key, value in values.items()})
        found.append(disc_orders(plant, held, 25)[1:].max(axis=1))
    others = np.delete(found[1], lobes - 1)
    assert found[1][lobes - 1] > 20 * others.max()
    assert found[1][lobes - 1] == pytest.approx(2 * found[0][lobes - 1], rel=0.02)


def test_a_clearance_that_shrinks_is_the_smaller_clearance(neutral):
    """10 K colder housing: 11.5e-6 x 20 mm x 10 K = 2.3 um; 1.2 um of growth at 100 Hz is .3 um at 50 Hz.

    The rig's sensitivity to 2.3 um is known: 7 Hz.
    """
    cold = neutral({"effects.clearance_growth.temperature": "-10 K"})
    same(cold, neutral({"bearings.1.clearance": "22.7 um"}))
    same(neutral({"effects.clearance_growth.growth": "1.2 um"}), neutral({"bearings.1.clearance": "24.7 um"}))
    rise = np.abs(modes(cold.linearise(SPEED, PRESSURE))) - np.abs(modes(neutral().linearise(SPEED, PRESSURE)))
    assert rise[0] / HZ == pytest.approx(7, abs=0.7)


def film_alone(plant, path):
    """The rig's bearing without the rotor, at a mean free path."""
    machine = plant.machine
    film, injection, gas = machine.film, machine.injection, machine.gas
    names = (
        "seat_gap", "minimum_gap", "pin_diameter", "pin_discharge", "orifice_diameter", "curtain_discharge",
        "plenum_volume", "polytropic_exponent",
    )  # fmt: skip
    common = {name: getattr(injection, name) for name in names} | {"law": "orifice", "pin": injection.pin_bias}
    return GasBearing(
        radius=film.diameter / 2, length=film.length, clearance=film.clearance, viscosity=gas.mu,
        ambient_pressure=gas.ambient_pressure, temperature=gas.temperature, gas_constant=gas.R,
        heat_capacity_ratio=gas.kappa, n_theta=32, n_z=8, mean_free_path=path,
        injectors=tuple(Injector(angle=i.angle, **common) for i in machine.injectors),
    )  # fmt: skip


def test_slip_lets_the_gas_escape_and_the_journal_sink(neutral):
    """The film of `reynolds` with the same mean free path carries the same load where the rig rests; air's 68 nm.

    Flow through a gap rises by 1 + 6 Kn pa/p (Burgdorfer 1959), so a smaller gap carries the weight.
    """
    plain, plant = neutral(), neutral({"effects.slip.mean_free_path": "0.068 um"})
    rest = plant.equilibrium(SPEED, PRESSURE)
    film = film_alone(plant, 0.068e-6).steady(rest.journal, SPEED, PRESSURE)
    assert film.force == pytest.approx(rest.force, rel=1e-6)
    assert rest.eccentricity_ratio > plain.equilibrium(SPEED, PRESSURE).eccentricity_ratio + 1e-4


def test_warmer_gas_is_the_more_viscous_gas_of_sutherlands_law(neutral):
    """Air at 350 K against 300 K: 208.2 / 184.6 uPa s (Incropera & DeWitt, Table A.4), met within 1 %."""

    def factor(T, T0=293.15):
        return (T / T0) ** 1.5 * (T0 + GASES["air"].sutherland) / (T + GASES["air"].sutherland)

    assert factor(350) / factor(300) == pytest.approx(208.2 / 184.6, rel=0.01)
    viscous = neutral({"gas.viscosity": f"{18.5 * factor(350)} uPa*s"})
    same(neutral({"effects.gas_heating.rise": f"{350 - 293.15} K"}), viscous)
    same(neutral({"effects.gas_heating.heating": "20 K"}), neutral({"gas.viscosity": f"{18.5 * factor(298.15)} uPa*s"}))


def test_discharge_drift_is_another_discharge_coefficient(neutral):
    same(neutral({"effects.discharge_drift.drift": 0.1}), neutral({"injection.pin_discharge": 0.1244 * 1.1}))


def test_an_exponent_throttles_a_half_open_seat_and_not_an_open_one(neutral):
    """Choked flow goes with the opening to the power 1 + n: by .44^.5 less at mid travel, all pins being choked."""
    for bias, opening in (("22.5 um", 17.7 / 40.2), ("0 um", 1.0)):
        flows = [
            neutral({"injection.pin_bias": bias, "effects.discharge_drift.exponent": n}).equilibrium(0.0, PRESSURE)
            for n in (0.0, 0.5)
        ]
        ratio = flows[1].mass_flow / flows[0].mass_flow
        assert ratio == pytest.approx(opening**0.5, rel=1e-9 if opening == 1.0 else 1e-6)


def test_a_partly_blocked_injector_starves_and_the_journal_moves_towards_it(neutral):
    """Choked pins: its flow falls by the blocked share, the others hold to the last digits; it is at the top."""
    plain = neutral().equilibrium(0.0, PRESSURE)
    blocked = neutral({"effects.weak_injector.blocked": 0.2}).equilibrium(0.0, PRESSURE)
    assert blocked.mass_flow / plain.mass_flow == pytest.approx([0.8, 1, 1, 1], abs=1e-6)
    assert blocked.journal[1] - plain.journal[1] > 1e-7
    assert blocked.journal[0] == pytest.approx(plain.journal[0], abs=1e-9)


def test_a_stuck_pin_no_longer_answers_the_reference(neutral, held):
    """Injector 1 of the pair 1 and 3 sticks at mid travel: its flow stays, the disc moves by what injector 3 does.

    The linear model knows how far that is; .2 V of it are straight within 2 %.
    """
    gains = []
    for stuck in (0.0, 1.0):
        values = {"stuck": stuck, "stuck_opening": 17.7 / 40.2}
        plant = neutral({f"effects.weak_injector.{key}": value for key, value in values.items()})
        rows, L = held(2500, SPEED, PRESSURE), plant.assembly.film
        run = plant.start(SPEED, PRESSURE)
        before = run.w[L.pin_flow : L.pin_flow + 4].copy()
        rows[:, 3] = 0.2
        table = run.advance(rows)
        change = run.w[L.pin_flow : L.pin_flow + 4] / before - 1
        gains.append((table[-1, 1] - table[0, 1]) / 0.2)
        assert gains[-1] == pytest.approx(plant.linearise(SPEED, PRESSURE).static_gain[1, 1], rel=0.02)
    # pin 1 goes into its seat by .84 of 17.7 um, pin 3 out of it
    assert change == pytest.approx([0, 0, 0.2 * 4.194 / 17.7, 0], abs=1e-6)
    assert 0.4 * gains[0] < gains[1] < 0.8 * gains[0]


def test_a_line_of_other_pressure_feeds_its_injector_in_proportion(neutral):
    """Choked flow goes with the absolute supply pressure; the others hold."""
    values = {"effects.unequal_pressure.injector": 3, "effects.unequal_pressure.deviation": -0.1}
    flows = [neutral(v).equilibrium(0.0, PRESSURE).mass_flow for v in ({}, values)]
    assert flows[1] / flows[0] == pytest.approx([1, 1, 0.9, 1], abs=1e-6)


def test_the_supply_droops_by_its_resistance_times_the_flow(neutral, held):
    """5e8 Pa s/kg of about 1e-4 kg/s, at rest in the equilibrium and a second later."""
    plant = neutral({"effects.supply_droop.droop": "5e8 Pa*s/kg"})
    table = plant.start(SPEED, PRESSURE).advance(held(5000, SPEED, PRESSURE))
    lost = PRESSURE - table[[0, -1], 6]
    assert lost == pytest.approx(5e8 * table[[0, -1], 10], rel=1e-6)
    assert lost[0] > 2e4


def test_a_supply_that_droops_too_much_does_not_lift_the_rotor_and_one_that_droops_less_does(neutral):
    """5e9 Pa s/kg leave .21 of .4 MPa, which is above lift-off, though the flow at .4 MPa would leave nothing."""
    plant = neutral({"effects.supply_droop.droop": "5e9 Pa*s/kg"})
    flow = plant.equilibrium(0.0, 0.4e6).mass_flow.sum()
    at_injectors = 0.4e6 - 5e9 * flow
    assert flow == pytest.approx(neutral().equilibrium(0.0, at_injectors).mass_flow.sum(), rel=1e-6)
    with pytest.raises(NoLiftOffError, match=r"does not carry the 35\.9 N on it; raise the injection pressure"):
        plant.equilibrium(0.0, 0.3e6)
    with pytest.raises(NoLiftOffError, match=r"35\.9 N"):
        neutral({"effects.supply_droop.droop": "3e9 Pa*s/kg"}).equilibrium(0.0, 0.25e6)


def test_a_line_at_ambient_pressure_rests_whichever_way_its_gas_flows(neutral):
    """At 8000 rpm and no supply the film carries; its line is where its little flow, of either sign, droops to."""
    plant = neutral({"effects.supply_droop.droop": "1e9 Pa*s/kg"})
    speed = 8000 * HZ / 60
    fed = plant.equilibrium(speed, 0.0)
    flow = fed.mass_flow.sum()
    assert 0 < abs(flow) < 1e-6
    assert fed.journal == pytest.approx(neutral().equilibrium(speed, -1e9 * flow).journal, abs=1e-11)
    with pytest.raises(NoLiftOffError):
        plant.equilibrium(0.0, 0.0)


def test_an_equilibrium_that_does_not_converge_names_effects_that_the_machine_has(neutral):
    """The error names those of supply, heat and motion that the machine has and that do something."""
    assert coupled_effects(neutral().assembly) == ()
    droop, rub = {"effects.supply_droop.droop": "1e9 Pa*s/kg"}, {"effects.rub.stiffness": "1 MN/m"}
    assert coupled_effects(neutral(droop).assembly) == ("supply_droop",)
    assert set(coupled_effects(neutral(droop | rub).assembly)) == {"supply_droop", "rub"}


def test_a_line_fills_with_its_time_constant(neutral, held):
    """A step from .5 to .6 MPa: P = P_1 + (P_0 - P_1) exp(-t/T) at every sample, to round-off."""
    plant = neutral({"effects.supply_droop.filling_time": "50 ms"})
    table = plant.start(SPEED, PRESSURE).advance(held(1000, SPEED, 0.6e6))
    expected = 0.6e6 - 0.1e6 * np.exp(-SAMPLE * np.arange(1000) / 0.05)
    assert table[:, 6] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(("volume", "zeta"), [(1, 0.0366), (5, 0.0046), (10, -0.029), (20, -0.074)])
def test_large_plena_hammer(neutral, volume, zeta):
    """Damping of the vertical mode at .5 MPa, 3 krpm against a prototype of its own, within the .004 of the grids."""
    plant = neutral({"effects.plenum_volume.change": volume - 1.0})
    model = plant.linearise(SPEED, PRESSURE)
    s = modes(model)[1]
    assert -s.real / abs(s) == pytest.approx(zeta, abs=4e-3)
    assert modes(neutral({"injection.plenum_volume": f"{volume} mm^3"}).linearise(SPEED, PRESSURE))[1] == pytest.approx(
        s
    )


def test_one_large_plenum_leaves_the_others(neutral):
    plant = neutral({"effects.plenum_volume.change": 1.0, "effects.plenum_volume.injector": 2})
    run = plant.start(0.0, PRESSURE)
    L, capacity = plant.assembly.film, plant.assembly.P.capacity
    assert run.w[L.capacity : L.capacity + 4] / capacity == pytest.approx([1, 2, 1, 1], rel=1e-15)


STIFF = 100.0


def pedestal(neutral, ratio, hertz=STIFF):
    values = {"mass_ratio": ratio, "frequency": f"{hertz} Hz"}
    return neutral({f"effects.pedestal.{key}": value for key, value in values.items()})


def test_the_pedestal_sinks_under_the_load_of_the_film(neutral):
    """The pedestal moves by F / (m_p omega^2), m_p = m/r, the disc by 1/.625 of it; the journal keeps its place."""
    rigid, soft = neutral().equilibrium(SPEED, PRESSURE), pedestal(neutral, 0.05).equilibrium(SPEED, PRESSURE)
    stiffness = neutral().machine.mass / 0.05 * (STIFF * HZ) ** 2
    assert soft.journal == pytest.approx(rigid.journal, abs=1e-9)
    sunk = -rigid.force / stiffness / 0.625
    assert soft.disc - rigid.disc == pytest.approx(sunk, abs=5e-3 * np.abs(sunk).max())


def test_a_light_pedestal_absorbs_at_its_own_frequency_and_splits_the_rotors_mode(neutral):
    """Tuned to f_1 = 118.4 Hz it makes two modes of one: omega^2 apart by g k_f (r/m)^(1/2), here some 10 Hz.

    Fixed at the rotor's antiresonance: with damping zeta_p the disc's answer there falls below half of the rigid one's.
    """
    tuned = 118.4
    rigid = neutral().linearise(SPEED, PRESSURE)
    plant = pedestal(neutral, 0.02, tuned).linearise(SPEED, PRESSURE)
    rigid_answer, answer = (abs(m.transfer(1j * tuned * HZ)[0, 2]) for m in (rigid, plant))
    assert answer < 0.5 * rigid_answer
    below = [abs(s) / HZ for s in plant.eigenvalues if abs(s) < tuned * HZ]
    assert below and min(below) < tuned - 3


def neighbour(name):
    """Another file of these tests."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SIGNATURES = {
    "journal_tilt": test_the_film_does_not_care_which_way_the_sleeve_is_tilted_but_that_it_is,
    "out_of_round": test_a_journal_of_one_lobe_is_an_eccentric_journal,
    "clearance_growth": test_a_clearance_that_shrinks_is_the_smaller_clearance,
    "slip": test_slip_lets_the_gas_escape_and_the_journal_sink,
    "gas_heating": test_warmer_gas_is_the_more_viscous_gas_of_sutherlands_law,
    "heat_balance": neighbour("test_effects_heat").test_gap_and_viscosity_are_those_of_warm_walls_and_warm_gas,
    "discharge_drift": test_discharge_drift_is_another_discharge_coefficient,
    "weak_injector": test_a_partly_blocked_injector_starves_and_the_journal_moves_towards_it,
    "unequal_pressure": test_a_line_of_other_pressure_feeds_its_injector_in_proportion,
    "supply_droop": test_the_supply_droops_by_its_resistance_times_the_flow,
    "plenum_volume": test_large_plena_hammer,
    "pedestal": test_the_pedestal_sinks_under_the_load_of_the_film,
    "contact": neighbour("test_effects_contact").test_the_sleeve_pushes_back_and_friction_drives_the_journal_backward,
}
