"""Plausibility limits of a law: jumps, range, frozen and reversed sensors, lost points; on the nonlinear plant too."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rotorsim.control import LawError, Plausibility, guard, lpv, lqr, plausibility_of
from rotorsim.control.guard import PAUSE
from rotorsim.control.law import load_law
from rotorsim.plant import Plant

QUIET, POINT = 3e-7, (300.0, 0.5e6)


@pytest.fixture(scope="module")
def plant():
    """Virtual rig of the thesis."""
    return Plant("dtu_gas_bearing")


@pytest.fixture(scope="module")
def law(model):
    """LQR with plausibility limits of the model it was designed on."""
    return lqr.design(model)


@pytest.fixture(scope="module")
def scheduled(small):
    """Law over speed and pressure, with limits but without predictors."""
    law = lpv.design(small(), lpv.Spec(grid=(3, 3), validation=(3, 3), table=(2, 2), delay=0.0))
    return law.with_(plausibility=replace(law.plausibility, predictors=None))


def noisy(n=6000, seed=0):
    """Displacement (n, 2) [m] of a rotor that swings a little about (1, -20) um."""
    rng, t = np.random.default_rng(seed), 2e-4 * np.arange(n)
    swing = np.column_stack([2e-6 * np.sin(800 * t), 2e-6 * np.cos(800 * t)])
    return np.array([1e-6, -2e-5]) + swing + QUIET * rng.normal(size=(n, 2))


def run(law, measured, speed=POINT[0], pressure=POINT[1]):
    """Outputs (n, 2) and alarm codes (n,) of a law for measured (n, 2)."""
    law = law.with_()
    speeds, pressures = np.broadcast_to(speed, len(measured)), np.broadcast_to(pressure, len(measured))
    found = [(law.step(y, s, p), law.alarm_code) for y, s, p in zip(measured, speeds, pressures, strict=True)]
    return np.array([u for u, _ in found]), np.array([code for _, code in found])


def begin(codes):
    """(sample, code) of each change of the alarm."""
    return [(int(k), int(codes[k])) for k in np.flatnonzero(np.diff(codes, prepend=0))]


def test_plausible_samples_give_the_bits_of_a_law_without_limits(law):
    u, codes = run(law, noisy())
    without, _ = run(law.with_(plausibility=None), noisy())
    np.testing.assert_array_equal(u, without)
    assert not codes.any() and np.ptp(u[2000:]) > 0.1


def test_a_spike_is_held_through_and_the_law_acts_at_once_after_it(law):
    measured = noisy()
    measured[3000:3002, 0] += 5e-5
    u, codes = run(law, measured)
    assert begin(codes) == [(3000, guard.JUMP), (3004, 0)]
    np.testing.assert_array_equal(u[3000:3002], [u[2999]] * 2)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_frozen_sensor_is_found_after_a_hundred_samples_and_the_law_comes_back_with_it(law, axis):
    measured = noisy()
    measured[3000:3400, axis] = measured[3000, axis]
    u, codes = run(law, measured)
    assert begin(codes)[0] == (3100, guard.STUCK) and codes[-1] == 0
    assert not u[3210:3400].any() and np.abs(u[3600:]).max() > 0.1


def test_a_record_without_noise_may_be_constant(law):
    _, codes = run(law, np.broadcast_to([1e-6, -2e-5], (4000, 2)))
    assert not codes.any()


def test_a_displacement_out_of_range_fades_out_at_once_and_quickly(law):
    measured = noisy()
    measured[3000:3300, 0] += 60e-6 * np.minimum(np.arange(300) / 50, 1)
    u, codes = run(law, measured)
    first, code = begin(codes)[0]
    assert code == guard.RANGE and not u[first + 11 : 3300].any() and codes[-1] == 0
    steps = np.diff(u[first - 1 : first + 10], axis=0)
    np.testing.assert_allclose(steps, np.broadcast_to(-u[first - 1] / 10, (10, 2)), atol=1e-12)


def test_missing_samples_again_and_again_suspend_the_law(law):
    measured = noisy()
    measured[3000:3600:3] = np.nan
    _, codes = run(law, measured)
    assert guard.UNSTEADY in codes[3000:3100] and codes[-1] == 0
    assert np.count_nonzero(codes == guard.UNSTEADY) > PAUSE / 2


@pytest.mark.parametrize("index", [0, 1])
def test_a_scheduled_law_that_loses_speed_or_pressure_fades_out_and_comes_back(scheduled, index):
    points = [np.full(6000, value) for value in (500.0, 0.6e6)]
    points[index][3000:3500] = 0.0
    u, codes = run(scheduled, noisy(), *points)
    assert begin(codes)[0] == (3000, guard.POINT_FAR) and begin(codes)[-1][1] == 0
    assert not u[3110:3500].any()


def test_a_speed_that_has_really_jumped_is_accepted_and_one_that_reads_zero_is_not(scheduled):
    for after, back in ((100.0, True), (0.0, False)):
        speed = np.where(np.arange(6000) < 3000, 600.0, after)
        _, codes = run(scheduled, noisy(), speed, 0.5e6)
        assert begin(codes)[0] == (3000, guard.POINT_FAR) and (codes[-1] == 0) == back


def test_a_first_sample_of_zeros_and_a_lost_speed_during_a_run_up_do_not_last(scheduled):
    speed, pressure = np.linspace(100.0, 600.0, 6000), np.full(6000, 0.6e6)
    speed[0] = pressure[0] = 0.0
    speed[2000:5800] = np.nan
    _, codes = run(scheduled, noisy(), speed, pressure)
    assert codes[-1] == 0 and not codes[200:2000].any()


def test_a_pressure_step_over_the_whole_range_is_no_fault(scheduled):
    _, codes = run(scheduled, noisy(), 300.0, np.where(np.arange(6000) < 3000, 0.3e6, 0.7e6))
    assert not codes.any()


def test_a_speed_that_is_not_a_number_does_not_end_the_check_of_a_constant_law(law):
    speed = np.full(6000, 300.0)
    speed[0] = np.nan
    own = law.with_()
    for y, w in zip(noisy(), speed, strict=True):
        own.step(y, w, POINT[1])
    assert np.isfinite(own.memory).all()


@pytest.mark.parametrize("speed", [POINT[0], 4 * 628.0])
def test_evidence_counts_where_the_model_holds(law, speed):
    """A swing that grows without any output: the model, which knows the sensors, does not explain it."""
    measured = noisy()
    growth = 1e-6 * np.exp(np.minimum(np.arange(3000) / 300, 3))
    measured[3000:] += (growth * np.sin(500 * 2e-4 * np.arange(3000)))[:, None] * [1.0, -1.0]
    own = law.with_()
    most = 1.0
    for y in measured:
        own.step(y, speed, POINT[1])
        most = max(most, *own.memory[own.layout.evidence + 1 : own.layout.applied])
    assert (most > 1.0) == (speed == POINT[0])


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [("range", "20 um", "a number in SI units"), ("speed", 3.0, "two numbers"), ("jump", True, "a number"),
     ("model_speed", [1.0], "two numbers"), ("plausibility", "off", "limits by name")],
)  # fmt: skip
def test_a_file_with_limits_that_are_no_numbers_is_refused(law, tmp_path, name, value, sentence):
    law.save(tmp_path / "law.json")
    data = json.loads((tmp_path / "law.json").read_text())
    (data if name == "plausibility" else data["plausibility"])[name] = value
    (tmp_path / "law.json").write_text(json.dumps(data))
    with pytest.raises(LawError, match=sentence):
        load_law(tmp_path / "law.json")


@pytest.mark.parametrize("name", ["jump", "range", "stuck", "evidence", "speed_jump", "pressure_jump"])
def test_a_limit_that_is_switched_off_stays_off_in_the_file(law, tmp_path, name):
    law = law.with_(plausibility=replace(law.plausibility, **{name: float("inf")}))
    law.save(tmp_path / "law.json")
    assert getattr(load_law(tmp_path / "law.json").plausibility, name) == float("inf")


def test_a_pause_doubles_as_long_as_the_law_fails_soon(law):
    measured = noisy(9000)
    for first in (2000, 3200, 4800):
        measured[first : first + 10, 0] += 30e-6
    _, codes = run(law, measured)
    lengths = np.diff([k for k, _ in begin(codes)])[::2]
    assert lengths[1] - lengths[0] == PAUSE and lengths[2] - lengths[1] == 2 * PAUSE


def test_limits_come_back_bit_for_bit_from_both_kinds_of_file(law, tmp_path):
    for ending in ("json", "mat"):
        law.save(tmp_path / f"law.{ending}")
        again = load_law(tmp_path / f"law.{ending}")
        assert again.hash == law.hash and again.plausibility.limits.tolist() == law.plausibility.limits.tolist()


def test_limits_decide_the_fingerprint(law):
    assert law.with_(plausibility=replace(law.plausibility, range=1e-5)).hash != law.hash


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [({"range": 0.0}, "positive"), ({"jump": -1.0}, "positive"), ({"evidence": 1.0}, "above 1"),
     ({"speed": (3.0, 2.0)}, "lower limit first"), ({"stuck": float("nan")}, "positive")],
)  # fmt: skip
def test_limits_that_limit_nothing_are_refused(limits, sentence):
    with pytest.raises(LawError, match=sentence):
        Plausibility(**limits)


def test_an_unknown_limit_in_a_file_is_refused(law, tmp_path):
    law.save(tmp_path / "law.json")
    data = json.loads((tmp_path / "law.json").read_text())
    data["plausibility"]["rang"] = 1.0
    (tmp_path / "law.json").write_text(json.dumps(data))
    with pytest.raises(LawError, match="no 'rang'"):
        load_law(tmp_path / "law.json")


def test_the_range_is_twice_what_the_actuators_move_at_rest(model):
    gain = max(np.linalg.norm(model.at(w, p).static_gain, 2) for w in (0.0, 314.0, 628.0) for p in (3e5, 5e5, 7e5))
    assert plausibility_of(model).range == pytest.approx(2 * 5.0 * gain, rel=0.02)


# --- on the nonlinear plant ------------------------------------------------------------------------------------------


class Faulty:
    """A law whose sensors do what `fault` makes of a sample, from `first` to `last`."""

    def __init__(self, law, fault, first, last):
        self.law, self.fault, self.first, self.last, self.k = law, fault, first, last, 0
        self.codes, self.outputs = [], []

    def applied(self, reference):
        self.law.applied(reference)

    def step(self, measured, speed, pressure):
        given = self.fault(measured) if self.first <= self.k < self.last else measured
        self.k += 1
        self.outputs.append(self.law.step(given, speed, pressure))
        self.codes.append(self.law.alarm_code)
        return self.outputs[-1]


def departure(record):
    """Largest of |x|, |y| (n,) [m] from where the disc is before the fault."""
    disc = record["disc"].to_numpy()
    return np.abs(disc - disc[1200:1500].mean(axis=0)).max(axis=1)


@pytest.mark.parametrize("fault", [lambda y: y * [-1, 1], lambda y: y * [1, -1], lambda y: -y, lambda y: y[::-1]])
@pytest.mark.parametrize("point", [(100.0, 0.3e6), (500.0, 0.5e6)])
def test_a_reversed_or_swapped_sensor_is_found_before_30_um_and_the_law_comes_back(plant, law, fault, point):
    """Without the check each of them drives the disc 40 um or more away (next test)."""
    faulty = Faulty(law.with_(), fault, 1600, 2400)
    record = plant.simulate(1.2, *point, controller=faulty, seed=3)
    first = int(np.flatnonzero(faulty.codes)[0])
    assert 1600 <= first <= 1800 and departure(record)[:first].max() < 30e-6
    assert departure(record).max() < 35e-6 and not record["contact"].any()
    assert faulty.codes[-1] == 0 and np.abs(faulty.outputs[-200:]).max() > 0.05


def test_without_limits_a_reversed_sensor_drives_the_disc_far_away(plant, law):
    faulty = Faulty(law.with_(plausibility=None), lambda y: y * [-1, 1], 1600, 2400)
    assert departure(plant.simulate(0.5, 100.0, 0.3e6, controller=faulty, seed=3)).max() > 40e-6


def test_a_reference_that_is_added_is_no_evidence_against_the_sensors(plant, law):
    """PRBS of 1 V next to the law: given what acts, evidence stays small; kept from the law it comes near an alarm."""
    rng = np.random.default_rng(1)
    added = np.repeat(rng.choice([-1.0, 1.0], (200, 2)), 25, axis=0)
    added[:1300] = 0.0
    evidence = []
    for given in (True, False):
        own = law.with_()

        class Seen:
            """The law, and the largest evidence that it has had."""

            most = 1.0

            def applied(self, reference, own=own, given=given):
                if given:
                    own.applied(reference)

            def step(self, measured, speed, pressure, own=own):
                output = own.step(measured, speed, pressure)
                self.most = max(self.most, *own.memory[own.layout.evidence + 1 : own.layout.applied])
                return output

        seen = Seen()
        plant.simulate(1.0, 600.0, 0.3e6, controller=seen, reference=added, seed=5)
        evidence.append(seen.most)
    assert evidence[0] < 1e5 and evidence[1] > 10 * evidence[0], evidence


@pytest.mark.slow
def test_the_end_of_an_offset_is_no_evidence_against_the_signs(plant):
    """The displacement jumps back while the law is suspended: predictors that went on across it called it a swap."""
    from rotorsim.control.designs import h2_scheduled
    from studies.benchmarks.control_laws import rig_model

    faulty = Faulty(h2_scheduled.design(rig_model()), lambda y: np.add(y, [6e-5, 0.0]), 1855, 2241)
    speed, pressure = np.linspace(236.0, 431.0, 4000), np.linspace(0.64e6, 0.56e6, 4000)
    plant.simulate(0.8, speed, pressure, controller=faulty, seed=14)
    assert set(faulty.codes) == {0, guard.JUMP} and faulty.codes[-1] == 0


def test_the_benchmark_takes_steps_of_returns_and_of_ways_out_apart():
    """Bad in samples 4 and 5, back at 8; the last step of a return has no alarm any more."""
    from studies.benchmarks.sensor_faults import excess

    outputs = np.cumsum([0, 0.3, 0.3, 0.3, -0.5, -0.5, 0.1, 0.2, 0.7, 0.3])[:, None] * [1.0, 0.0]
    bad = np.isin(np.arange(10), (4, 5))
    alarms = np.where(np.isin(np.arange(10), (4, 5, 6, 7)), 4, 0)
    np.testing.assert_allclose(excess(outputs, alarms, bad), (0.4, 0.2))
    np.testing.assert_allclose(excess(0.01 * outputs, alarms, bad), (0.007 - guard.LEAST, 0.005 - guard.LEAST))
