"""Coupled plant against its linear model, symmetries and mass balance."""

import numpy as np
import pytest

from reynolds.grid import cells
from reynolds.transient import MID, STAGE

RPM = np.pi / 30
SAMPLE = 2e-4


def test_small_unbalance_answers_as_the_frequency_response_predicts(rig):
    """.1 g mm at 2 krpm, 5 nm of orbit, the last ten turns of 150 samples: 1.2e-5 is the error of a .2 ms step."""
    speed, pressure, me = 2000 * RPM, 0.5e6, 1e-7
    plant = rig({"effects.unbalance.me": "0.1 g*mm"}, n_z=16)
    record = plant.simulate(1.2, speed, pressure).isel(time=slice(-1500, None))
    away = record["disc"].values - plant.equilibrium(speed, pressure).disc
    measured = 2 * np.mean(away * np.exp(-1j * record["angle"].values[:, None]), axis=0)
    force = me * speed**2 * np.array([1, -1j])  # turns from x to y
    expected = plant.linearise(speed, pressure).transfer(1j * speed)[:, 2:4] @ force
    assert np.abs(measured - expected) == pytest.approx(0, abs=1e-4 * np.abs(expected).min())


def test_the_shaft_angle_is_the_integral_of_the_speed_however_it_varies(rig, held):
    """Between samples the speed is linear, so the trapezoidal rule is exact; the angle never jumps."""
    t = SAMPLE * np.arange(2501)
    speeds = 300 + 200 * np.sin(9 * t) + 100 * (t > 0.2)
    inputs = held(2500, 0.0, 0.5e6)
    inputs[:, 0] = speeds[1:]
    table = rig({"effects.unbalance.me": "2 g*mm"}).start(speeds[0], 0.5e6).advance(inputs)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE * (speeds[1:] + speeds[:-1]))])[:-1]
    assert table[:, 4] == pytest.approx(angle, abs=1e-9)
    # the orbit turns with the angle: no step of the displacement is larger than speed times orbit
    steps = np.hypot(*np.diff(table[:, :2], axis=0).T)
    assert steps.max() < 1.2 * SAMPLE * 600 * np.ptp(table[:, 0])


@pytest.mark.parametrize(("harmonic", "force"), [(2, "force_2x"), (3, "force_3x")])
def test_coupling_forces_resonate_at_a_fraction_of_the_critical_speeds(rig, harmonic, force):
    """Run-up at .3 MPa through f/2 (3.4-3.6 krpm) and f/3 (2.3-2.4): the harmonic peaks there, in x at f1, in y at f2.

    Within 4 %: damping ratios of .06-.09 shift a peak of displacement by 1 %, the ramp of 10 Hz/s by 1-2 %.
    """
    pressure, plant = 0.3e6, rig({f"effects.coupling.{force}": "4 N"})
    centre = 115.0 / harmonic
    start, stop = 2 * np.pi * np.array([0.7, 1.35]) * centre
    duration = round(0.65 * centre / 10, 3)
    record = plant.simulate(duration, lambda t: start + (stop - start) * t / duration, pressure)
    turns = record["angle"].values / (2 * np.pi)
    wave = np.exp(-1j * harmonic * record["angle"].values)[:, None] * record["disc"].values
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(wave, axis=0)])
    first = np.arange(0, int(turns[-1]) - 5)
    ends = np.searchsorted(turns, [first, first + 5])
    amplitude = np.abs((total[ends[1]] - total[ends[0]]) / (ends[1] - ends[0])[:, None])
    speed = record["speed"].values[ends.mean(axis=0).astype(int)]
    peaks = speed[amplitude.argmax(axis=0)]
    wn = plant.linearise(float(peaks.mean()), pressure).wn[:2]
    assert harmonic * peaks == pytest.approx(wn, rel=0.04)


def test_turning_the_other_way_round_mirrors_the_motion(rig, held):
    """The rig is symmetric about its vertical plane: x -> -x with the speed reversed; round-off of motions of 25 um."""
    inputs = held(400, 600.0, 0.3e6)
    inputs[5:20, 4:] = 3.0, 2.0
    inputs[100:, 2], inputs[200:, 3] = 1.0, 0.5
    mirrored = inputs * np.array([-1, 1, -1, 1, -1, 1])
    unbalance = {"effects.unbalance.me": "6.7 g*mm"}
    one = rig(unbalance).start(600.0, 0.3e6).advance(inputs)
    other = rig(unbalance | {"effects.unbalance.phase": "180 deg"}).start(-600.0, 0.3e6).advance(mirrored)
    assert np.ptp(one[:, 0]) > 1e-5
    assert other[:, :4] == pytest.approx(one[:, :4] * np.array([-1, 1, -1, 1]), abs=1e-15)


def test_the_film_loses_no_mass_over_half_a_second_at_the_default_tolerance(rig, held):
    """Gas held = gas at the start + injected - escaped, within 1e-9 of what was injected; round-off leaves 1e-13.

    A step ends at m = m_n + b (m_mid - m_n) + a dt (injected - escaped), with the flows read from the film itself; that
    the first stage keeps its mass likewise is the film's own test.
    """
    plant = rig({"effects.unbalance.me": "6.7 g*mm"})
    run = plant.start(628.0, 0.3e6)
    L, w, P = plant.assembly.film, run.w, plant.assembly.P
    inside = cells(L)
    edge = inside[:, -1]

    def held_in(array):
        return float(np.sum(w[L.weight + inside] * w[array + inside])) * (1 + L.half)

    def flows():
        injected = P.film_0.source * w[L.film_flow : L.film_flow + L.n_inj].sum()
        return injected, (1 + L.half) * w[L.flow_z + edge].sum()

    adt = STAGE * P.dt
    row = held(1, 628.0, 0.3e6)
    begin, gained, fed = held_in(L.m_old), 0.0, 0.0
    for _ in range(2500):
        before = held_in(L.m_old)
        run.advance(row)
        injected, escaped = flows()
        gained += MID * (held_in(L.m_mid) - before) + adt * (injected - escaped)
        fed += P.dt * injected
    assert abs(held_in(L.m_old) - begin - gained) < 1e-9 * fed


def test_pressing_down_raises_the_pressure_below_and_the_film_is_symmetric(rig):
    """Standing still the film is even in x; injection raises it above ambient everywhere, most under the journal."""
    run = rig(n_z=16).start(0.0, 0.5e6)
    p = run.film_pressure()
    centre = 0.5 * (p[:, 7] + p[:, 8])
    assert p == pytest.approx(p[:, ::-1], rel=1e-14)
    mirror = (16 - np.arange(32)) % 32  # theta -> pi - theta
    assert p == pytest.approx(p[mirror], rel=1e-9)
    assert p.min() > 101325 and centre[24] > centre[8]


def test_a_step_of_the_reference_moves_the_disc_by_the_static_gain(rig, held):
    """.1 V moves the disc by .3 um; the gain's own curvature over that is .1 %."""
    plant, speed, pressure = rig(n_z=16), 300.0, 0.5e6
    inputs = held(3000, speed, pressure)
    inputs[:, 2] = 0.1
    moved = plant.start(speed, pressure).advance(inputs)[-1, :2] - plant.equilibrium(speed, pressure).disc
    assert moved == pytest.approx(0.1 * plant.linearise(speed, pressure).static_gain[:, 0], rel=5e-3)
