"""Signatures of the effects on the shaft, one switched on at a time on a plain rotor."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import rotorsim as rs
from rotorsim.base.errors import MachineFileError
from rotorsim.effects.rotor.asymmetric_shaft import AsymmetricShaft
from rotorsim.effects.rotor.ball_bearing import ball_bearing
from rotorsim.effects.rotor.crack import Crack
from rotorsim.effects.rotor.labyrinth_seal import LabyrinthSeal
from rotorsim.effects.rotor.rub import rub

SAMPLE = 2e-4
HZ = 2 * np.pi
G = 9.81
DAMPED = {"shaft.damping_ratio": 0.05}
"""Transients are over in half a second."""
WEIGHTLESS = {"effects.gravity.acceleration": "0 m/s^2"}


@pytest.fixture
def rotor(neutral):
    """Return the builder of the plain rotor with every effect in it, the weight switched off."""
    return lambda values=None, **more: neutral(DAMPED | WEIGHTLESS | dict(values or {}), name="plain_rotor", **more)


def orders(plant, held, hertz, highest=4, settle=1.0):
    """Complex amplitudes (orders 0 to highest, x and y) of the disc at a speed with whole turns in 5000 samples."""
    run = plant.start(hertz * HZ)
    run.advance(held(round(settle / SAMPLE), hertz * HZ, 0.0))
    table = run.advance(held(5000, hertz * HZ, 0.0))
    turn = np.exp(-1j * np.arange(highest + 1) * table[:, 4, None])
    return 2 * (turn.T @ table[:, :2]) / len(table)


def transfer(plant, hertz, omega, rows):
    """Disc motion (2, 2) for harmonic forces at `omega` [rad/s] through modal rows (2, n), the shaft turning."""
    linear = plant.linearise(hertz * HZ)
    n = rows.shape[1]
    E = np.vstack([np.zeros((n, 2)), rows.T])
    return linear.C @ np.linalg.solve(1j * omega * np.eye(2 * n) - linear.A, E)


def compliance(plant):
    """Static deflection of the disc per newton on it."""
    mesh = plant.assembly.mesh
    return transfer(plant, 0.0, 0.0, mesh.shape(mesh.probe))[0, 0].real


def test_unbalances_in_two_planes_add_up_to_the_linear_answer_of_both(rotor, held):
    """25 g mm at the disc and 40 g mm at a quarter span at 25 Hz; within 1e-3, the error of a .2 ms step is 3e-4."""
    planes = {"0.me": "25 g*mm", "1.me": "40 g*mm", "1.phase": "110 deg"}
    plant = rotor({f"effects.unbalance.{key}": value for key, value in planes.items()})
    mesh, force = plant.assembly.mesh, (25 * HZ) ** 2 * np.array([1, -1j])
    first = transfer(plant, 25, 25 * HZ, mesh.shape(0.3)) @ (25e-6 * force)
    second = transfer(plant, 25, 25 * HZ, mesh.shape(0.15)) @ (40e-6 * np.exp(1j * np.radians(110)) * force)
    found = orders(plant, held, 25)
    assert found[1] == pytest.approx(first + second, abs=1e-3 * np.abs(first + second).max())
    assert np.abs(found[[0, 2, 3, 4]]).max() < 1e-4 * np.abs(found[1]).min()


def test_far_below_the_critical_speed_the_shaft_turns_in_its_bow(rotor, held):
    """Amplitude a / (1 - (Omega/omega)^2) of a bowed Jeffcott rotor (Nicholas, Gunter & Allaire 1976), any bearings.

    The bow is zero at the bearings, so their compliance drops out; .3 % is left to damping and the higher modes.
    """
    plant = rotor({"effects.shaft_bow.bow": "20 um", "effects.shaft_bow.phase": "40 deg"})
    wn = plant.linearise().wn[0] / HZ
    for hertz in (2, 5, 10):
        found = orders(plant, held, hertz)[1]
        expected = 20e-6 * np.exp(1j * np.radians(40)) / (1 - (hertz / wn) ** 2)
        assert np.abs(found) == pytest.approx(abs(expected), rel=3e-3)
        assert np.angle(found[0] / expected) == pytest.approx(0, abs=0.04)  # 2 zeta r
        assert found[1] == pytest.approx(-1j * found[0], rel=1e-2)


@pytest.mark.parametrize("ellipticity", [1.0, 0.0, -1.0])
def test_a_misaligned_coupling_shakes_at_two_and_three_times_the_speed(rotor, held, ellipticity):
    """4 N and 2.5 N at the left end, at 10 Hz; 1 turns forward, 0 stays horizontal, -1 turns backward."""
    values = {"force_2x": "4 N", "force_3x": "2.5 N", "phase_3x": "50 deg", "ellipticity": ellipticity}
    plant = rotor({f"effects.coupling.{key}": value for key, value in values.items()})
    found = orders(plant, held, 10)
    shape = plant.assembly.mesh.shape(0.0)
    for order, force in ((2, 4.0), (3, 2.5 * np.exp(1j * np.radians(50)))):
        answer = transfer(plant, 10, order * 10 * HZ, shape) @ (force * np.array([1, -1j * ellipticity]))
        assert found[order] == pytest.approx(answer, abs=2e-3 * np.abs(answer).max())
    assert np.abs(found[[0, 1, 4]]).max() < 1e-3 * np.abs(found[3]).max()


def test_a_crack_makes_harmonics_of_the_static_sag(rotor, held):
    """Delta k s {1/4, 3/8, 1/4, 1/8} along the weight, {0, 1/8, 1/4, 1/8} across, by Fourier from (1 + cos) cos^2 / 2.

    A loss of a thousandth of the stiffness leaves the sag what it is: 1 % for what vibration adds to the harmonics.
    """
    sound = rotor({"effects.gravity.acceleration": "9.81 m/s^2"})
    sag, loss = -sound.equilibrium().disc[1], 1e-3 / compliance(sound)
    values = {"loss": f"{loss} N/m", "phase": "25 deg"}
    plant = sound
    for key, value in values.items():
        plant = type(plant)(plant.machine.replace(f"effects.crack.{key}", value))
    found = orders(plant, held, 10)
    shape, at = plant.assembly.mesh.shape(0.3), np.radians(25 + 90)
    for order, along, across in ((1, 3 / 8, 1 / 8), (2, 1 / 4, 1 / 4), (3, 1 / 8, 1 / 8)):
        force = loss * sag * np.exp(1j * order * at) * np.array([-1j * across, -along])
        answer = transfer(plant, 10, order * 10 * HZ, shape) @ force
        assert found[order] == pytest.approx(answer, abs=0.01 * np.abs(answer).max())
    steady = 0.5 * found[0, 1].real - sound.equilibrium().disc[1]
    assert steady == pytest.approx(-loss * sag / 4 * compliance(sound), rel=0.01)


def test_a_crack_shakes_most_at_twice_the_speed_at_half_the_critical_one(rotor, held):
    """2X of the cracked shaft over 15, 22 and 29 Hz, the first critical speed at 44 Hz: a resonance of 1 / (2 zeta)."""
    values = {"effects.gravity.acceleration": "9.81 m/s^2", "effects.crack.loss": "1 kN/m"}
    plant = rotor(values)
    below, at, above = (np.abs(orders(plant, held, hertz)[2]).max() for hertz in (15, 22, 29))
    assert at > 4 * below and at > 4 * above


@pytest.mark.parametrize("turn", [1, -1])
def test_a_rub_brakes_the_shaft_by_its_friction(neutral, held, turn):
    """J d(Omega)/dt = -mu N R with the drive off, N = k (e - gap) of a stator that presses the shaft by 1 mm.

    Against the same rotor without friction; N moves by what the friction bends the shaft. One sample late: 0.5 %.
    """
    press = {"stiffness": "100 kN/m", "offset_x": "-1 mm", "gap": "0 mm", "radius": "11.8 mm", "damping": "0 s/m"}
    rows, speeds = held(500, turn * 300.0, 0.0), []
    rows[:, 0] = np.nan
    for friction in (0.0, 0.2):
        values = {f"effects.rub.{key}": value for key, value in (press | {"friction": friction}).items()}
        plant = neutral(WEIGHTLESS | values, name="plain_rotor")
        table = plant.start(turn * 300.0).advance(rows)
        speeds.append(table[-1, 5])
    normal = 1e5 * np.hypot(table[:, 0] + 1e-3, table[:, 1]).mean()
    time = (len(rows) - 1) * plant.assembly.sampling_time
    expected = -turn * 0.2 * normal * 0.0118 * time / plant.assembly.P.inertia
    assert abs(expected) > 0.5
    assert speeds[1] - speeds[0] == pytest.approx(expected, rel=0.01)


def growth(plant, held, speed, seconds=8.0):
    """Rate [1/s] at which forward whirl after a hit grows, over the last `seconds`."""
    half = round(0.5 * seconds / SAMPLE)
    rows = held(4 * half, speed, 0.0)
    rows[:5, 4] = 100.0
    whirl = plant.start(speed).advance(rows)[:, :2] @ np.array([1, 1j])
    forward = [
        np.abs(np.fft.fft(w * np.hanning(half))[: half // 2]).max() for w in (whirl[2 * half :][:half], whirl[-half:])
    ]
    return np.log(forward[1] / forward[0]) / (half * SAMPLE)


def test_internal_damping_drives_forward_whirl_above_its_threshold(neutral, held):
    """Omega = omega (1 + c_e / c_i) for isotropic supports (Genta 2005, chapter 3): 2 % by eigenvalues, sign in time.

    c_e is what damps the rotor without the effect, c_i = beta times the shaft's share of the modal stiffness.
    """
    beta, quiet = 1e-5, neutral(WEIGHTLESS, name="plain_rotor")
    mesh, linear = quiet.assembly.mesh, quiet.linearise()
    omega, zeta = linear.wn[0], linear.zeta[0]
    mode = int(np.abs(mesh.shape(0.3)[0]).argmax())
    supports = sum(1e7 * mesh.shape(z)[0, mode] ** 2 for z in (0.0, 0.6))
    threshold = omega * (1 + 2 * zeta * omega / (beta * (omega**2 - supports)))
    plant = neutral(WEIGHTLESS | {"effects.internal_damping.time": "10 us"}, name="plain_rotor")
    for factor in (0.98, 1.02):
        model = plant.linearise(factor * threshold)
        forward = [z for z, w in zip(model.zeta, model.whirl, strict=True) if w == "forward"]
        assert (forward[0] < 0) == (factor > 1)
        assert min(z for z, w in zip(model.zeta, model.whirl, strict=True) if w == "backward") > 0
    assert growth(plant, held, 0.95 * threshold) < 0 < growth(plant, held, 1.05 * threshold)


def test_an_asymmetric_shaft_turns_its_sag_at_twice_the_speed(rotor, held):
    """z_2 = -(Delta k / 2) conj(s) exp(2 i psi) h(2 Omega), the sag s at rest; 1 % for what z_2 adds to the sag.

    Delta k is a thousandth of the stiffness; neither 1X nor 3X comes of it. It resonates at half the critical speed.
    """
    weight = {"effects.gravity.acceleration": "9.81 m/s^2"}
    sound = rotor(weight)
    sag, difference = -1j * -sound.equilibrium().disc[1], 1e-3 / compliance(sound)
    values = {"difference": f"{difference} N/m", "phase": "25 deg"}
    plant = rotor(weight | {f"effects.asymmetric_shaft.{key}": value for key, value in values.items()})
    found = orders(plant, held, 10)
    force = -0.5 * difference * np.conj(sag) * np.exp(2j * np.radians(25))
    answer = transfer(plant, 10, 20 * HZ, plant.assembly.mesh.shape(0.3)) @ (force * np.array([1, -1j]))
    assert found[2] == pytest.approx(answer, abs=0.01 * np.abs(answer).max())
    assert np.abs(found[[1, 3, 4]]).max() < 1e-3 * np.abs(found[2]).min()
    below, at, above = (np.abs(orders(plant, held, hertz)[2]).max() for hertz in (15, 22, 29))
    assert at > 4 * below and at > 4 * above


def test_an_asymmetric_shaft_is_unstable_between_its_two_critical_speeds(neutral, held):
    """k +- Delta k / 2 with 20 % of difference: 2 zeta is far less, so it grows within and decays 15 % outside."""
    quiet = neutral(WEIGHTLESS, name="plain_rotor")
    omega = quiet.linearise().wn[0]
    values = {"effects.asymmetric_shaft.difference": f"{0.2 / compliance(quiet)} N/m"}
    plant = neutral(WEIGHTLESS | values, name="plain_rotor")
    rates = [growth(plant, held, factor * omega, seconds=2.0) for factor in (0.85, 1.0, 1.15)]
    assert rates[1] > 0 > max(rates[0], rates[2])


def test_a_labyrinth_seal_drives_forward_whirl_above_its_threshold(neutral, held):
    """Omega = (omega / lambda)(1 + c_e / C), c_e what damps without the seal: 1 % by eigenvalues, sign in time."""
    quiet = neutral(WEIGHTLESS, name="plain_rotor")
    mesh, linear = quiet.assembly.mesh, quiet.linearise()
    omega, zeta = linear.wn[0], linear.zeta[0]
    shape = np.abs(mesh.shape(0.3)[0]).max()
    outside = 2 * zeta * omega / shape**2
    values = {"damping": f"{2 * outside} N*s/m", "swirl": 0.6}
    threshold = omega / 0.6 * 1.5
    plant = neutral(WEIGHTLESS | {f"effects.labyrinth_seal.{k}": v for k, v in values.items()}, name="plain_rotor")
    for factor in (0.99, 1.01):
        model = plant.linearise(factor * threshold)
        forward = [z for z, w in zip(model.zeta, model.whirl, strict=True) if w == "forward"]
        assert (forward[0] < 0) == (factor > 1)
        assert min(z for z, w in zip(model.zeta, model.whirl, strict=True) if w == "backward") > 0
    assert growth(plant, held, 0.95 * threshold) < 0 < growth(plant, held, 1.05 * threshold)


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_cross_coupled_stiffness_beyond_omega_c_is_unstable_at_any_speed(neutral, factor):
    """k_0 = omega c_e of the mode, at 5 Hz; a direct stiffness of the plane adds to that of the rotor."""
    quiet = neutral(WEIGHTLESS, name="plain_rotor")
    linear = quiet.linearise(5 * HZ)
    shape = np.abs(quiet.assembly.mesh.shape(0.3)[0]).max()
    limit = 2 * linear.zeta[0] * linear.wn[0] ** 2 / shape**2
    values = WEIGHTLESS | {"effects.labyrinth_seal.cross_stiffness": f"{factor * limit} N/m"}
    model = neutral(values, name="plain_rotor").linearise(5 * HZ)
    assert (min(model.zeta) < 0) == (factor > 1)
    stiffer = neutral(WEIGHTLESS | {"effects.labyrinth_seal.stiffness": "100 kN/m"}, name="plain_rotor")
    assert 1 / compliance(stiffer) - 1 / compliance(quiet) == pytest.approx(1e5, rel=0.01)


def test_a_slowly_shaken_foundation_deflects_the_rotor_as_its_weight_does(rotor, held):
    """Quasi-static: sag under g times a/g times 1 / (1 - (f/f_1)^2); .5 % for the higher modes."""
    sag = -rotor({"effects.gravity.acceleration": "9.81 m/s^2"}).equilibrium().disc[1]
    values = {"y": "2 m/s^2", "frequency": "5 Hz", "phase": "30 deg"}
    plant = rotor({f"effects.base_vibration.{key}": value for key, value in values.items()})
    table = plant.start().advance(held(10000, 0.0, 0.0))[5000:]
    wave = np.exp(-1j * 5 * HZ * SAMPLE * np.arange(5000, 10000))
    found = 2 * (wave @ table[:, 1]) / 5000
    expected = sag * 2 / G / (1 - (5 * HZ / plant.linearise().wn[0]) ** 2)
    assert abs(found) == pytest.approx(expected, rel=5e-3)
    # -a sin(2 pi f t + 30 deg) has the phase 30 + 90 deg; damping takes 2 zeta f / f_1
    assert np.angle(found) == pytest.approx(np.radians(120), abs=0.02)
    assert np.abs(table[:, 0]).max() < 1e-12


def test_a_stator_carries_what_the_shaft_does_not_and_drags_it_backward(rotor, held):
    """300 N to the right: (x - 0)/c + k (x - g) = F and friction mu N downwards for a shaft turning from x to y.

    The slide is 7 m/s over a slip speed of 1 mm/s, so tanh is 1; 1e-5 is left of the transient.
    """
    values = {"stiffness": "2 MN/m", "gap": "100 um", "friction": 0.2, "radius": "20 mm"}
    plant = rotor({f"effects.rub.{key}": value for key, value in values.items()})
    rows = held(10000, 50 * HZ, 0.0)
    rows[:, 4] = 300.0
    x, y = plant.start(50 * HZ).advance(rows)[-1, :2]
    c = compliance(plant)
    # e = (x, y): normal and friction along and across it
    e = math.hypot(x, y)
    normal = 2e6 * (e - 1e-4)
    n, t = np.array([x, y]) / e, np.array([-y, x]) / e
    assert np.array([x, y]) / c == pytest.approx([300, 0] - normal * n - 0.2 * normal * t, abs=1e-3)
    assert normal > 100 and y < 0


def test_a_rub_never_pulls_and_never_feeds_a_shaft_at_rest():
    """Work of the stator on a shaft that does not turn is negative but for what its spring stores."""
    p = SimpleNamespace(
        stiffness=1e6, gap=5e-5, offset_x=1e-5, offset_y=0.0, friction=0.2, damping=1.0, radius=0.0, slip_speed=1e-3
    )  # fmt: skip
    rng = np.random.default_rng(2)
    for x, y, vx, vy in rng.uniform(-1, 1, (500, 4)) * [2e-4, 2e-4, 3.0, 3.0]:
        force = np.array(rub.py_func(0.0, 0.0, 0.0, x, y, vx, vy, p))
        away = np.array([x - 1e-5, y])
        e = math.hypot(*away)
        assert force @ away <= 1e-18
        spring = -p.stiffness * max(e - p.gap, 0.0) * away / e
        assert (force - spring) @ [vx, vy] <= 1e-12


@pytest.mark.parametrize("order", [1, 3])
def test_a_rippling_torque_swings_the_speed_by_m_over_j_n_omega(rotor, held, order):
    """.2 N m at n times 25 Hz; sampling at 5 kHz makes it (n Omega T/2) / sin larger, 1.5e-3 at n = 3, drive's 1e-5."""
    plant = rotor({"effects.torque_ripple.amplitude": "0.2 N*m", "effects.torque_ripple.order": order})
    speed, inertia = 25 * HZ, plant.assembly.mesh.polar_inertia
    run = plant.start(speed)
    run.advance(held(25000, speed, 0.0))
    table = run.advance(held(5000, speed, 0.0))
    line = 2 * np.mean(table[:, 5] * np.exp(-1j * order * speed * SAMPLE * np.arange(5000)))
    assert abs(line) == pytest.approx(0.2 / (inertia * order * speed), rel=3e-3)
    assert table[:, 5].mean() == pytest.approx(speed, rel=1e-4)


def test_the_weight_sags_the_shaft_as_beam_theory_states(rotor):
    """Disc at mid-span and uniform shaft on springs, with shear (Roark, table 8.1); 1e-3 for six modes a plane."""
    plant = rotor({"effects.gravity.acceleration": "9.81 m/s^2"})
    L, d, E, nu, k = 0.6, 0.02, 210e9, 0.3, 1e7
    inertia, A = np.pi * d**4 / 64, np.pi * d**2 / 4
    shear = 6 * (1 + nu) / (7 + 6 * nu) * E / (2 * (1 + nu)) * A
    W, w = 3.946 * G, 7850 * A * G
    sag = W * L**3 / (48 * E * inertia) + 5 * w * L**4 / (384 * E * inertia)
    sag += W * L / (4 * shear) + w * L**2 / (8 * shear) + (W + w * L) / (2 * k)
    assert plant.equilibrium().disc == pytest.approx([0, -sag], abs=1e-3 * sag)


def test_clearance_of_one_bearing_lets_the_disc_at_mid_span_sink_by_half_of_it(rotor):
    """The shaft tilts about the other bearing; the modes of the tight rotor give the tilt back to 1 %."""
    weight = {"effects.gravity.acceleration": "9.81 m/s^2"}
    tight = rotor(weight).equilibrium().disc
    loose = rotor(weight | {"effects.ball_bearing.clearance": "4 um"}).equilibrium().disc
    assert loose - tight == pytest.approx([0, -2e-6], abs=2e-8)


@pytest.mark.parametrize("gap", [0.3e-6, 20e-6, 100e-6])
def test_a_loose_ball_bearing_lets_the_rigs_overhung_disc_sink_about_the_film(neutral, gap):
    """The free end rises by the gap, the disc sinks by the levers' ratio .142/.237 of it: to 1 %, as above."""

    def rest(clearance):
        return neutral({"effects.ball_bearing.clearance": f"{clearance} m"}).equilibrium(100 * np.pi, 0.5e6)

    tight, loose = rest(0.0), rest(gap)
    lever = (0.3787 - 0.2366875) / 0.2366875
    journal = loose.journal - tight.journal
    assert loose.disc - tight.disc == pytest.approx((1 + lever) * journal - [0, lever * gap], abs=0.01 * lever * gap)


def test_a_soft_ball_bearing_is_the_spring_that_is_left_behind_its_clearance():
    """Next to the linear bearing's -k x it adds nothing within the clearance, (1 - sigma) k (e - g) beyond it."""
    k, p = 5e7, SimpleNamespace(softening=0.6, stiffening=1.0, clearance=2e-6, stiffness=5e7, residual=0.0)
    for x, y in ((1e-6, 1e-6), (3e-6, -4e-6), (-1e-5, 0.0)):
        e = math.hypot(x, y)
        total = np.array(ball_bearing.py_func(0.0, 0.0, 0.0, x, y, 0.0, 0.0, p)) - k * np.array([x, y])
        assert total == pytest.approx(-0.4 * k * max(e - 2e-6, 0.0) / e * np.array([x, y]), abs=1e-9)


def test_a_softer_ball_bearing_lowers_the_rigs_frequency_as_a_softer_one_in_the_file_does(neutral):
    """50 -> 10 MN/m: 1.8 Hz, -> 2 MN/m: 11 Hz at .5 MPa, 3 krpm, and within .05 Hz of a file with that stiffness.

    Without the residual compliance the six modes of the stiff bearing give 1.2 and 3.2 Hz.
    """

    def first(values=None):
        model = neutral(values).linearise(100 * np.pi, 0.5e6)
        return min(abs(s) for s in model.eigenvalues if -s.real / abs(s) > 0.021) / HZ

    for softening, written, known in ((0.8, "10 MN/m", -1.8), (0.96, "2 MN/m", -11)):
        soft = first({"effects.ball_bearing.softening": softening})
        assert soft == pytest.approx(first({"bearings.0.kxx": written}), abs=0.05)
        assert soft - first() == pytest.approx(known, abs=0.25)


def lost_blade(rotor, held, dt):
    """Disc of a run in which 40 g mm appear at 25 Hz after 50 ms, and the exact one, both from the equilibrium."""
    values = {"me": "40 g*mm", "phase": "70 deg", "time": "50 ms", "position": "150 mm"}
    plant = rotor({f"effects.sudden_unbalance.{key}": value for key, value in values.items()}, dt=dt)
    omega, after = 25 * HZ, SAMPLE * np.arange(250)
    disc = plant.start(omega).advance(held(500, omega, 0.0))[:, :2]
    linear, shape = plant.linearise(omega), plant.assembly.mesh.shape(0.15)
    n = shape.shape[1]
    force = 40e-6 * omega**2 * np.exp(1j * (np.radians(70) + 50e-3 * omega)) * np.array([1, -1j])
    there = np.linalg.solve(1j * omega * np.eye(2 * n) - linear.A, np.concatenate([np.zeros(n), force @ shape]))
    free = np.array([expm(linear.A * t) @ there.real for t in after])
    exact = (np.exp(1j * omega * after)[:, None] * there).real - free
    return disc - disc[0], np.concatenate([np.zeros((250, 2)), exact @ linear.C.T])


def test_a_lost_blade_shakes_a_rotor_as_the_matrix_exponential_says(rotor, held):
    """Step of the unbalance: of second order, and nothing before the instant; an instant half a step off is 1e-2."""
    errors = []
    for dt in (2e-4, 1e-4, 5e-5):
        disc, exact = lost_blade(rotor, held, dt)
        assert not disc[:251].any() and disc[251].any()
        errors.append(np.abs(disc - exact).max() / np.abs(exact).max())
    assert errors[-1] < 1e-3
    assert np.log2(np.divide(errors[:-1], errors[1:])).min() > 1.8


def test_the_instant_of_a_loss_is_a_sample():
    machine = rs.load_machine("plain_rotor")
    with pytest.raises(MachineFileError, match=r"^effects\.sudden_unbalance\.time: '50 us'"):
        machine.with_({"effects.sudden_unbalance": {"me": "40 g*mm", "time": "0.05 ms"}})


SIGNATURES = {
    "sudden_unbalance": test_a_lost_blade_shakes_a_rotor_as_the_matrix_exponential_says,
    "unbalance": test_unbalances_in_two_planes_add_up_to_the_linear_answer_of_both,
    "shaft_bow": test_far_below_the_critical_speed_the_shaft_turns_in_its_bow,
    "coupling": test_a_misaligned_coupling_shakes_at_two_and_three_times_the_speed,
    "crack": test_a_crack_makes_harmonics_of_the_static_sag,
    "asymmetric_shaft": test_an_asymmetric_shaft_turns_its_sag_at_twice_the_speed,
    "labyrinth_seal": test_a_labyrinth_seal_drives_forward_whirl_above_its_threshold,
    "internal_damping": test_internal_damping_drives_forward_whirl_above_its_threshold,
    "base_vibration": test_a_slowly_shaken_foundation_deflects_the_rotor_as_its_weight_does,
    "rub": test_a_stator_carries_what_the_shaft_does_not_and_drags_it_backward,
    "torque_ripple": test_a_rippling_torque_swings_the_speed_by_m_over_j_n_omega,
    "gravity": test_the_weight_sags_the_shaft_as_beam_theory_states,
    "ball_bearing": test_clearance_of_one_bearing_lets_the_disc_at_mid_span_sink_by_half_of_it,
}


@pytest.mark.parametrize("effect", [AsymmetricShaft, Crack])
def test_a_stiffness_that_turns_brakes_the_shaft_by_the_slope_of_its_energy(effect):
    """Torque -dV/d phi of V = -F(x, phi) x / 2, whose slopes after x and y are the force."""
    numbers = {"difference": 3e5, "loss": 3e5, "phase": 0.7, "weight_direction": -1.2}
    p = np.array([tuple(numbers.values())], [(name, "f8") for name in numbers]).view(np.recarray)[0]
    kernel, braking = (getattr(f, "py_func", f) for f in (effect.kernel, effect.braking))
    step = 1e-4
    for angle, x, y in ((0.3, 4e-5, -2e-5), (2.9, -1e-5, 5e-5), (5.1, 3e-5, 3e-5)):
        work = [0.5 * np.dot(kernel(0.0, at, 100.0, x, y, 0.0, 0.0, p), (x, y)) for at in (angle - step, angle + step)]
        torque = braking(0.0, angle, 100.0, x, y, 0.0, 0.0, p)
        assert torque == pytest.approx((work[1] - work[0]) / (2 * step), rel=1e-6)


def test_what_a_seal_feeds_into_the_whirl_comes_from_the_spin():
    """Power into the whirl and into the spin: together the loss of the damper against the turning gas, k_0 apart."""
    C, swirl = 40.0, 0.6
    numbers = {"damping": C, "swirl": swirl, "cross_stiffness": 0.0, "stiffness": 3e4}
    p = np.array([tuple(numbers.values())], [(name, "f8") for name in numbers]).view(np.recarray)[0]
    kernel, braking = (getattr(f, "py_func", f) for f in (LabyrinthSeal.kernel, LabyrinthSeal.braking))
    rng = np.random.default_rng(0)
    for speed in (300.0, -500.0, 0.0):
        (x, y), (vx, vy) = rng.normal(size=2) * 1e-5, rng.normal(size=2) * 1e-2
        force = np.array(kernel(0.0, 0.0, speed, x, y, vx, vy, p)) + 3e4 * np.array([x, y])
        power = force @ (vx, vy) + braking(0.0, 0.0, speed, x, y, vx, vy, p) * speed
        slip = np.array([vx + swirl * speed * y, vy - swirl * speed * x])
        assert power == pytest.approx(-C * slip @ slip, rel=1e-12)
    whirl = 2e-5  # a circle at the speed of the gas takes nothing from it
    assert braking(0.0, 0.0, 300.0, whirl, 0.0, 0.0, swirl * 300.0 * whirl, p) == pytest.approx(0.0, abs=1e-18)
