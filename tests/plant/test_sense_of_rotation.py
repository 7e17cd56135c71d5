"""A shaft that turns from y to x: the mirror image of the machine gives the mirror image of every answer."""

import numpy as np
import pytest

import fe_shaft
import rotorsim as rs
from mirror import mirrored
from rotorsim.plant import Plant
from rotorsim.signals.spectra import largest_sub_synchronous, waterfall

RPM = np.pi / 30
AXES = np.array([-1.0, 1.0])
CROSS = np.array([[1.0, -1.0], [-1.0, 1.0]])
ON_SHAFT = {
    "asymmetric_shaft": {"difference": "20 kN/m", "phase": "20 deg"},
    "base_vibration": {"x": "0.3 m/s^2", "y": "0.2 m/s^2", "phase": "40 deg"},
    "coupling": {"force_2x": "2 N", "force_3x": "1 N", "phase_2x": "30 deg", "phase_3x": "70 deg", "ellipticity": 0.5},
    "crack": {"loss": "100 kN/m", "phase": "50 deg"},
    "internal_damping": {"time": "0.1 ms"},
    "labyrinth_seal": {"damping": "50 N*s/m", "cross_stiffness": "20 kN/m", "stiffness": "10 kN/m"},
    "rub": {"stiffness": "1 MN/m", "gap": "1 um", "offset_x": "3 um", "offset_y": "1 um"},
    "shaft_bow": {"bow": "3 um", "phase": "25 deg"},
    "torque_ripple": {"amplitude": "0.01 N*m", "order": 2, "phase": "15 deg"},
    "unbalance": {"0.me": "30 g*mm", "1.me": "10 g*mm", "1.phase": "110 deg"},
}
"""Values at which effects on a plain rotor act."""
ON_FILM = {
    "clearance_growth": {"growth": "2 um"},
    "contact": {"stiffness": "50 MN/m", "friction": 0.2, "asperity": "18 um", "damping": "1 s/m"},
    "gas_heating": {"heating": "20 K"},
    "heat_balance": {"friction_share": 1},
    "journal_tilt": {"x": "0.1 mrad", "y": "0.05 mrad"},
    "out_of_round": {"sleeve": "2 um", "sleeve_phase": "20 deg", "journal": "1 um", "journal_phase": "35 deg"},
    "pedestal": {"mass_ratio": 0.5},
    "slip": {"mean_free_path": "0.5 um"},
}
"""Values at which effects on a gas film act."""


def settings(effect, values):
    return {f"effects.{effect}.{name}": value for name, value in values.items()}


def disc(machine, speed, pressure, numerics, samples=150, inputs=None):
    """Disc (samples, 2) [m], angle and speed after a start at rest at `speed`."""
    rows = np.zeros((samples, 6))
    rows[:, 0], rows[:, 1] = speed, pressure
    rows[3:8, 4:] = np.array([40.0, 25.0]) if inputs is None else inputs
    run = Plant(machine, **numerics).start(speed, pressure)
    table = run.advance(rows)
    return table[:, :2], table[:, 4], table[:, 5]


def mirror_distance(machine, speed, pressure, numerics):
    """Distance of the mirrored run from the mirror of the run, over the motion."""
    one, angle, turning = disc(machine, speed, pressure, numerics)
    other, back, turned = disc(mirrored(machine), -speed, pressure, numerics, inputs=AXES * (40.0, 25.0))
    assert np.exp(-1j * back) == pytest.approx(np.exp(1j * angle), abs=1e-9) and turned == pytest.approx(-turning)
    return np.abs(other - one * AXES).max() / np.ptp(one, axis=0).max()


@pytest.mark.parametrize("effect", ON_SHAFT)
def test_effects_on_the_shaft_turn_with_the_sense_of_rotation(neutral, effect):
    machine = neutral(settings(effect, ON_SHAFT[effect]), name="plain_rotor").machine
    assert mirror_distance(machine, 400.0, 0.0, {"dt": 2e-4}) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("effect", ON_FILM)
def test_effects_on_the_film_turn_with_the_sense_of_rotation(neutral, effect):
    machine = neutral(settings(effect, ON_FILM[effect])).machine
    assert mirror_distance(machine, 600.0, 0.4e6, {"n_theta": 32, "n_z": 8, "dt": 2e-4}) < 1e-7


TABLES = """
name = "on tables"
[shaft]
start = "0 mm"
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "600 mm"
outer_diameter = "20 mm"
[[discs]]
position = "200 mm"
mass = "4 kg"
polar_inertia = "0.0126 kg*m^2"
diametral_inertia = "0.0065 kg*m^2"
[[bearings]]
kind = "table"
position = "0 mm"
points = [
    {speed = "0 rad/s", kxx = "1 MN/m", kxy = "0.1 MN/m", kyx = "-0.2 MN/m", cxx = "900 N*s/m", cxy = "50 N*s/m"},
    {speed = "600 rad/s", kxx = "2 MN/m", kyy = "3 MN/m", kxy = "0.4 MN/m", kyx = "-0.1 MN/m", cxx = "400 N*s/m"},
]
[[bearings]]
kind = "linear"
position = "600 mm"
kxx = "2 MN/m"
kxy = "0.3 MN/m"
kyx = "-0.1 MN/m"
cxx = "300 N*s/m"
"""


@pytest.fixture(scope="module")
def on_tables():
    return rs.machine.Machine.from_text(TABLES)


def modes(machine, speed, pressure=0.0):
    model = Plant(machine).linearise(speed, pressure)
    return model.eigenvalues, np.array(model.whirl), model.whirl_ratio


@pytest.mark.parametrize("speed", [50.0, 300.0, 500.0, 900.0])
def test_tables_over_the_speed_hold_for_either_sense(on_tables, speed):
    """The eigenvalues of the mirrored rotor are the same, and its whirl turns, as before, with the shaft or against."""
    values, whirl, ratio = modes(on_tables, speed)
    back, turned, turned_ratio = modes(mirrored(on_tables), -speed)
    assert back == pytest.approx(values, rel=1e-9)
    assert (turned == whirl).all() and turned_ratio == pytest.approx(ratio, abs=1e-7)
    assert (values.imag > 0).all() and {"forward", "backward"} <= set(whirl)


def test_a_run_on_tables_is_mirrored(on_tables):
    """Through the same lookup at every stage of a step, also while the speed changes its sign."""
    assert mirror_distance(on_tables, 450.0, 0.0, {"dt": 2e-4}) < 1e-9


@pytest.mark.parametrize("speed", [60.0, 450.0])
def test_a_table_of_a_machine_and_of_the_shaft_alone_agree_at_either_sense(on_tables, speed):
    K, C = on_tables.bearings[0].at(speed)
    back, damping = on_tables.bearings[0].at(-speed)
    assert (back == K * CROSS).all() and (damping == C * CROSS).all()
    element = next(b for b in Plant(on_tables).assembly.mesh.rotor.bearing_elements if b.frequency is not None)
    for one in (speed, -speed):
        assert element.stiffness_at(one) == pytest.approx(on_tables.bearings[0].at(one)[0], rel=1e-12)
        assert element.damping_at(one) == pytest.approx(on_tables.bearings[0].at(one)[1], rel=1e-12)


def test_modes_and_response_of_the_shaft_alone_are_mirrored():
    """A circulatory table drives forward whirl whichever way the shaft turns; the orbit of an unbalance is mirrored."""
    table = {"frequency": [0.0, 500.0], "kxy": [1e5, 4e5], "kyx": [-1e5, -4e5], "kyy": [1.2e6, 2.2e6]}
    bearings = [fe_shaft.BearingElement(n, [1e6, 2e6], 50.0 * np.ones(2), cyy=80.0, **table) for n in (0, 6)]
    steel = fe_shaft.Material("steel", 7810, 211e9, Poisson=0.3)
    shaft = [fe_shaft.ShaftElement(0.1, 0, 0.03, material=steel) for _ in range(6)]
    rotor = fe_shaft.Rotor(shaft, [fe_shaft.DiskElement(2, 5.0, 0.02, 0.04)], bearings)
    one, other = rotor.run_modal(350.0), rotor.run_modal(-350.0)
    assert other.eigenvalues == pytest.approx(one.eigenvalues, rel=1e-9)
    assert (other.whirl == one.whirl).all()
    assert set(one.whirl[one.damping_ratio < 0]) == {"forward"}
    assert other.dataset()["minor"].values == pytest.approx(one.dataset()["minor"].values, abs=1e-6)
    forced = [rotor.run_unbalance_response(2, 1e-4, phase, [s]) for s, phase in ((350.0, 0.3), (-350.0, np.pi - 0.3))]
    (x, y), (back_x, back_y) = (f.response[8:10, 0] for f in forced)
    assert abs(back_x + np.conj(x)) < 1e-9 * abs(x) and abs(back_y - np.conj(y)) < 1e-9 * abs(y)


def test_a_table_that_begins_below_rest_is_refused():
    with pytest.raises(fe_shaft.ShaftError, match="mirror image"):
        fe_shaft.BearingElement(0, kxx=[1e6, 2e6], cxx=[10.0, 10.0], frequency=[-100.0, 100.0])


@pytest.mark.parametrize("name", ["bently_rk4", "plain_rotor", "pump_on_tables", "dtu_gas_bearing"])
def test_modes_of_shipped_machines_are_mirrored(name):
    check_shipped(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["aerostatic_spindle", "foil_turbo_rotor", "grooved_turbo_rotor", "rigid_rotor_self_acting"]
)
def test_modes_of_shipped_machines_with_other_sleeves_are_mirrored(name):
    check_shipped(name)


def check_shipped(name):
    machine = rs.load_machine(name)
    pressure, speed = 0.5e6 * machine.fed, min(2500.0, machine.drive.highest_speed or 600.0)
    values, whirl, ratio = modes(machine, speed, pressure)
    back, turned, turned_ratio = modes(mirrored(machine), -speed, pressure)
    assert back == pytest.approx(values, rel=1e-5)
    model = Plant(machine).linearise(speed, pressure)
    # an orbit at a node of the mode is rounding
    m = len(model.shapes)
    moves = np.abs(model.H[:, -2 * m : -m] @ model.shapes).max(axis=0) > 1e-9 * np.abs(model.shapes).max(axis=0)
    assert moves.sum() >= 6
    assert (turned == whirl)[moves].all() and turned_ratio[moves] == pytest.approx(ratio[moves], abs=1e-3)


def test_a_shaft_coasts_to_rest_from_either_sense():
    """Dry drag M stops the plain rotor of inertia J from Omega in J Omega / M, and does not turn it round."""
    machine = rs.load_machine("plain_rotor").replace("drive.dry_drag", "5 mN*m")
    plant = Plant(machine)
    time = plant.assembly.P.inertia * 20.0 / 5e-3
    rows = np.zeros((round(1.5 * time / machine.sampling_time), 6))
    rows[:, 0] = np.nan
    down = plant.start(20.0).advance(rows)[:, 5]
    up = plant.start(-20.0).advance(rows)[:, 5]
    stopped = np.flatnonzero(np.abs(down) < 1e-9)[0] * machine.sampling_time
    assert up == pytest.approx(-down, abs=1e-12)
    assert stopped == pytest.approx(time, rel=1e-2) and np.abs(down[-1]) < 1e-9


def _coasting(torque, speed, dry=5e-3, viscous=0.0, samples=2500):
    """Speeds [rad/s] of the plain rotor under a constant torque [N m], its moment of inertia and time per sample."""
    machine = rs.load_machine("plain_rotor").replace("drive.dry_drag", f"{dry} N*m")
    plant = Plant(machine.replace("drive.viscous_drag", f"{viscous} N*m*s"))
    plant.assembly.P.drive_torque = torque
    rows = np.zeros((samples, 6))
    rows[:, 0] = np.nan
    return plant.start(speed).advance(rows)[:, 5], float(plant.assembly.P.inertia), machine.sampling_time


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_dry_drag_holds_a_shaft_at_rest_up_to_its_own_size(sense):
    held, J, Ts = _coasting(sense * 4.9e-3, 0.0)
    moved, _, _ = _coasting(sense * 6e-3, 0.0)
    assert (held == 0.0).all()
    assert moved == pytest.approx(sense * 1e-3 / J * Ts * np.arange(2500), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_torque_stops_a_shaft_and_turns_it_round(sense):
    """Omega = Omega_0 - (T + M) t / J until it is 0, and -(T - M) t / J from there."""
    speeds, J, Ts = _coasting(-sense * 8e-3, sense * 0.1, samples=4000)
    time = Ts * np.arange(4000)
    stop = 0.1 * J / 13e-3
    expected = np.where(time < stop, 0.1 - 13e-3 / J * time, -3e-3 / J * (time - stop))
    assert 4 * stop < time[-1]
    assert sense * speeds == pytest.approx(expected, abs=10e-3 / J * Ts)


def test_a_shaft_coasts_down_under_dry_and_viscous_drag():
    """Omega = (Omega_0 + M / c) exp(-c t / J) - M / c to rest, where it stays; Friswell et al. (2010), section 2.3."""
    c, M = 2e-2, 0.2
    J = _coasting(0.0, 0.0, samples=1)[1]
    stop = J / c * np.log(1 + c * 20.0 / M)
    speeds, _, Ts = _coasting(0.0, 20.0, M, c, samples=round(1.2 * stop / rs.load_machine("plain_rotor").sampling_time))
    time = Ts * np.arange(speeds.size)
    expected = np.maximum((20.0 + M / c) * np.exp(-c * time / J) - M / c, 0.0)
    assert speeds == pytest.approx(expected, abs=20.0 * c / J * Ts + 1e-9)
    assert np.abs(speeds[time > stop + Ts]).max() < 1e-9


def test_a_full_spectrum_calls_whirl_forward_that_turns_with_the_shaft():
    """The run that turns from y to x has the mirrored motion and the same spectrum."""
    t = np.arange(20_000) * 2e-4
    forward = np.exp(2j * np.pi * 30 * t) + 0.3 * np.exp(-2j * np.pi * 12 * t)
    records = []
    for sense in (1, -1):
        values = np.column_stack((sense * forward.real, forward.imag))
        records.append(rs.signals.prepared(_record(t, values, sense * 2 * np.pi * 30)))
    one, other = (waterfall(record, lines=4) for record in records)
    assert other["full"].values == pytest.approx(one["full"].values, abs=1e-12)
    found = [largest_sub_synchronous(w) for w in (one, other)]
    assert found[0]["frequency_hz"] == pytest.approx(-12, abs=0.5) == found[1]["frequency_hz"]
    one, other = (rs.signals.spectrum_of(record, "disc", 100.0) for record in records)
    assert other.full == pytest.approx(one.full, abs=1e-12)


def _record(t, values, speed):
    import xarray as xr

    return xr.Dataset(
        {"disc": (("time", "axis"), values * 1e-6), "speed": ("time", np.full(len(t), speed)),
         "angle": ("time", speed * t)}, {"time": t, "axis": ["x", "y"]}
    )  # fmt: skip
