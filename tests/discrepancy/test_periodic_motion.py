"""Periodic initial motion of a record: omitted for an unstable rotor, even where numbers overflow."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison, simulate
from rotorsim.discrepancy.discovery import LawTerm, ProposedLaw, load, written
from rotorsim.discrepancy.hidden_machine import unshaken
from rotorsim.discrepancy.law_terms import SLIPPING_SPRING
from rotorsim.discrepancy.shooting import forced_motion
from rotorsim.discrepancy.trial import block_lines, trial_of, with_repeats
from rotorsim.discrepancy.twin import RIG_SAMPLE, Twin, in_motion, repeating_motion
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine, load_machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import READ
from rotorsim.plant.simulation import Simulation, settle
from studies.benchmarks.foreign_rotor import BEARINGS, DIAMETER, DISCS, ELEMENTS, LENGTH, RHO, machine_text

pytestmark = pytest.mark.numerical
EFFECTS = ("coupling", "runout", "shaft_bow")
"""Candidates of the twins, those of the shared models."""


@pytest.mark.parametrize("coupling", ["100 MN/m"])
def test_a_rotor_that_whirls_away_begins_at_rest(coupling):
    """Cross coupling grows by e^(100 t) and faster: beyond the range of numbers within a turn at 2 rad/s."""
    machine = load_machine("plain_rotor")
    for k in range(2):
        machine = machine.replace(f"bearings.{k}.kxy", coupling).replace(f"bearings.{k}.kyx", f"-{coupling}")
    a = Plant(machine).assembly
    w = settle(a, 2.0, 0.0)
    np.testing.assert_array_equal(in_motion(a, w.copy(), 2.0, 0.0), w)


def test_a_machine_that_is_shaken_at_random_has_no_period_and_the_twin_of_a_diagnosis_is_not_shaken():
    """Its records are whole runs from the motion without the random forces; simulated means leave these out."""
    machine = load_machine("plain_rotor").replace("effects.broadband_force", [{"density": "1e-3 N^2/Hz"}, {}])
    machine = machine.replace("effects.speed_wander.sd", 0.01)
    hidden, plain = Twin(machine, scatter=True), Twin(load_machine("plain_rotor"), scatter=True)
    assert unshaken(hidden, {}) == {"broadband_force.0.density": 0.0, "speed_wander.0.sd": 0.0}
    assert unshaken(hidden, {"speed_wander.0.sd": 0.0}) == {"broadband_force.0.density": 0.0}
    assert unshaken(plain, {}) == {}
    assert not {"broadband_force", "speed_wander"} & {*Twin(machine).equipped[0].effects, *Twin(machine).slots}


@pytest.mark.parametrize("times", [0.25, 0.5, 3.0])
def test_a_bearing_that_is_calibrated_sags_by_its_load_over_its_stiffness(times):
    """The sag is that of the rule of the lever; in six modes on the bearings of the file alone it is up to 3 % off."""
    machine = Machine.from_text(machine_text())
    load = sum(mass * node / ELEMENTS for node, mass, *_ in DISCS) + RHO * np.pi * DIAMETER**2 / 4 * LENGTH / 2
    setting = {"plane": LENGTH, "bearing.1.ky": 1 - 1 / times}
    sag = -Twin(machine, only=()).run(setting, np.zeros((1, 6)), 0.0)[0, 1]
    assert sag == pytest.approx(9.81 * load / (times * BEARINGS[1][2]), rel=1e-9)


def test_the_motion_found_repeats_from_turn_to_turn(machine, truth_plant):
    """At 40 Hz a turn is 125 samples; a start at rest would beat for a minute (damping ratio 0.002 at 44 Hz)."""
    rows = np.zeros((1000, 6))
    rows[:, 0] = 2 * np.pi * 40
    y = truth_plant.run({}, rows, 0.0, turning=True)[:, :2]
    np.testing.assert_allclose(y[-125:], y[:125], atol=1e-3 * np.ptp(y))
    assert np.ptp(y[:125], axis=0) == pytest.approx(np.ptp(y[:125, 0]), rel=0.01)  # a circle


@pytest.mark.parametrize("hertz", [16.0, 41.37])
def test_a_rotor_that_only_turns_is_run_over_a_few_turns_and_has_the_lines_of_the_whole_record(
    models, monkeypatch, hertz
):
    """Turns of 312.5 and 120.86 samples: what a whole run from the same motion shows, at a tenth of its samples."""
    rows, count, advance = np.zeros((12000, 6)), [0], Simulation.advance
    rows[:, 0] = 2 * np.pi * hertz

    def counted(self, inputs):
        count[0] += len(inputs)
        return advance(self, inputs)

    monkeypatch.setattr(Simulation, "advance", counted)
    trial = trial_of(rows, np.zeros((len(rows), 2)), 0.7, "turning")
    unbalanced = ParameterPoint(fixed={"coupling.0.force_2x": 3.0})
    found, few = simulate(models.twin, trial, unbalanced), count[0]
    whole = simulate(models.twin, trial, unbalanced, whole=True)
    assert few < 0.2 * (count[0] - few)
    assert np.abs(found - whole).max() < 1e-10 < 1e-3 * np.abs(whole).max()


def test_what_does_not_turn_with_the_shaft_does_not_repeat_with_its_turns():
    rows = np.zeros((12000, 6))
    rows[:, 0] = 2 * np.pi * 40
    trial, t = trial_of(rows, np.zeros((len(rows), 2)), 0.0, "turning"), np.arange(375) * 2e-4
    turning = 1e-5 * np.column_stack([np.cos(80 * np.pi * t), np.sin(240 * np.pi * t)])
    assert np.abs(trial.lines_of_turn(turning)).max() == pytest.approx(1e-5, rel=1e-3)
    other = turning + 1e-8 * np.cos(2 * np.pi * 50 * t)[:, None]
    assert trial.lines_of_turn(other) is None


def shaken(speed, onset=False):
    """Force (n, 6) of a multisine along x and y that repeats every 0.8 s, from 1 s on with `onset`."""
    t = np.arange(12000) * 2e-4
    f = np.arange(5, 250, 4) / 0.8
    phases = np.pi * np.arange(len(f)) ** 2 / len(f)
    rows = np.zeros((len(t), 6))
    rows[:, 0] = speed
    rows[:, 4] = np.sum(np.cos(2 * np.pi * np.outer(t, f) + phases), axis=1)
    rows[:, 5] = 0.5 * np.roll(rows[:, 4], 700)
    rows[:5000, 4:] *= not onset
    return rows


@pytest.mark.parametrize(
    ("setting", "known"),
    [
        ({}, True),
        ({"shaft_bow.0.bow": 1e-5}, True),
        ({"runout.0.amplitude_1x": 1e-5, "runout.0.drift": 0.2}, True),
        ({"sensor_lag.0.time": 1e-4}, False),
        ({"asymmetric_shaft.0.difference": 1e3}, False),
    ],
)
def test_the_last_shot_for_a_motion_is_not_run_again_where_the_plant_is_linear_and_sensors_remember_nothing(
    setting, known
):
    """At 40 Hz 0.8 s hold 32 turns: its readings are those of a run from the motion found, also where sensors know the
    number of a sample."""
    rows = shaken(80 * np.pi)[:4000]
    twin = Twin(load_machine("plain_rotor").replace("effects.noise.sigma", "100 nm"), scatter=True).lean(setting)
    a = twin.set(setting)
    found = repeating_motion(a, settle(a, 80 * np.pi, 0.0), 80 * np.pi, 0.0, rows)
    assert (found.readings is not None) == known
    if known:
        run = Simulation(a, found.w.copy()).advance(rows)[:, READ : READ + 5]
        assert np.all(np.abs(found.readings - run).max(axis=0) <= 1e-8 * np.abs(run).max(axis=0))


@pytest.mark.parametrize(("stiffness", "most"), [(0.0, 2), (3e5, 8)])
def test_a_motion_that_a_rub_bends_is_that_of_a_long_run_and_one_nearby_begins_in_it(stiffness, most):
    """After 40 s a run has forgotten its start to 1e-9. Slightly other numbers need fewer."""
    rows = shaken(80 * np.pi)[:4000]
    setting = {"rub.0.stiffness": stiffness, "rub.0.gap": 5e-6, "rub.0.friction": 0.0}
    twin = Twin(load_machine("plain_rotor")).lean(setting)
    found = forced_motion(twin, setting, rows, 0.0, 0.0)
    assert found is not None and found.runs <= most
    long = twin.run(setting, np.tile(rows, (50, 1)), 0.0)[-4000:, :2]
    assert np.abs(found.readings[:, :2] - long).max() < 1e-5 * np.ptp(long)
    other = setting | {"rub.0.stiffness": 1.01 * stiffness, "shaft_damping": 0.01}
    apart = forced_motion(twin, other, rows, 0.0, 0.0)
    nearby = forced_motion(twin, other, rows, 0.0, 0.0, found)
    assert apart is not None and nearby is not None and nearby.runs < max(apart.runs, 3)
    change = np.abs(apart.readings - found.readings)[:, :2].max()
    assert np.abs(nearby.readings - apart.readings)[:, :2].max() < 2e-3 * change


@pytest.mark.parametrize(("hertz", "period", "left"), [(40.0, 0, 1e-12), (41.3, 4000, 1e-3)])
def test_a_delayed_sensor_shows_the_motion_found_from_the_first_sample_on(hertz, period, left):
    """A delay of 5 samples: its ring of 64 ends where the record begins, whatever was run to find the motion.

    At 41.3 Hz a turn ends within half a sample of one.
    """
    rows = shaken(2 * np.pi * hertz)[:4000] * [1, 1, 1, 1, period > 0, period > 0]
    setting = {"sensor_delay.0.delay": 1e-3}
    twin = Twin(load_machine("plain_rotor")).lean(setting)
    late = twin.run(setting, rows, 0.0, turning=True, period=period)[:, :2]
    ahead = twin.run({}, np.roll(rows, 5, axis=0), 0.0, -5 * rows[0, 0] * 2e-4, turning=True, period=period)[:, :2]
    assert np.abs(late - ahead).max() < left * np.ptp(late)


@pytest.mark.parametrize("hertz", [0.0, 40.0, 41.3])
def test_a_shaken_rotor_that_a_record_shows_in_steady_state_begins_in_it(machine, models, hertz):
    """A run of 40 s that repeats the force has forgotten its start; the last periods of it are the record."""
    speed = 2 * np.pi * hertz
    rows = shaken(speed)
    long = np.concatenate([np.tile(rows[:4000], (50, 1)), rows])
    angle = -speed * 2e-4 * (len(long) - len(rows))
    y = models.twin.run({}, long, 0.0, angle, turning=True)[-len(rows) :, :2]
    trial = trial_of(rows, y, 0.0, "shaken")
    comparison = TwinComparison(models.twin, [trial])
    assert trial.settled
    left = comparison.measured - comparison.predict(ParameterPoint())
    assert np.linalg.norm(left) < 2e-3 * np.linalg.norm(comparison.measured)


@pytest.mark.parametrize("zeta", [2e-3, 2e-4])
def test_a_light_damping_need_not_forget_where_no_period_holds_whole_turns(machine, zeta):
    """On linear bearings the response to the force alone repeats with it, whatever the damping; after
    10 s exp(-2 pi 44 Hz 10 s zeta) is left of another beginning, 58 % for the smaller one."""
    twin = Twin(machine.replace("shaft.damping_ratio", zeta), only=EFFECTS)
    rows = shaken(2 * np.pi * 41.3)
    trial = replace(trial_of(rows, np.zeros((len(rows), 2)), 0.0, "light"), settled=True)
    assert not trial.periodic
    ahead, window, angle = trial.from_motion
    both = simulate(twin, trial, ParameterPoint())
    unforced = np.concatenate([ahead, window])
    unforced[:, 2:] = 0.0
    turning = trial.lines_of_window(twin.run({}, unforced, 0.0, angle, turning=True)[len(ahead) :, :2])
    forced = both - turning
    assert np.linalg.norm(np.diff(forced, axis=0)) < 1e-5 * np.linalg.norm(forced)


def test_a_record_that_shows_the_onset_begins_at_rest(models):
    rows = shaken(0.0, onset=True)
    assert not trial_of(rows, models.twin.run({}, rows, 0.0)[:, :2], 0.0, "onset").settled


@pytest.mark.parametrize("damping_ratio", [5e-4, 0.001, 0.002, 0.005])
def test_a_motion_that_begins_at_rest_and_fades_slowly_is_an_onset(damping_ratio):
    """A mode of 61.25 Hz rings down over ten blocks of .8 s, less from one to the next."""
    rows = np.tile(shaken(0.0)[:4000], (10, 1))
    t = np.arange(len(rows)) * 2e-4
    ringing = 1e-5 * np.exp(-damping_ratio * 2 * np.pi * 61.25 * t) * np.cos(2 * np.pi * 61.25 * t)
    moved = 1e-6 * np.column_stack([rows[:, 4], rows[:, 5]]) - np.column_stack([ringing, ringing])
    assert not trial_of(rows, moved, 0.0, "onset").settled


def test_a_line_that_does_not_repeat_is_no_onset():
    """It leaks into all lines: between any two blocks they change by as much as from the first to the last."""
    rows = shaken(0.0)
    t = np.arange(len(rows)) * 2e-4
    steady = 1e-6 * np.column_stack([rows[:, 4], rows[:, 5]])
    other = 2e-5 * np.column_stack([np.cos(2 * np.pi * 7.1 * t), np.sin(2 * np.pi * 7.1 * t)])
    lines = block_lines(steady + other, 0, 4000, 3, 200)[:, :, 5::4]
    assert np.linalg.norm(lines[0] - lines[-1]) > 0.2 * np.linalg.norm(lines[-1])
    assert trial_of(rows, steady + other, 0.0, "line").settled


def moved_at_random(sizes, speed=0.0, unbalanced=0.0, angle=0.0):
    """Record of four blocks with 1X and a line of 61.25 Hz, an excited one: of its own amplitude (4, 2) in each."""
    rows = np.tile(shaken(speed)[:4000], (4, 1))
    t, forced = np.arange(len(rows)) * 2e-4, 1e-6 * np.column_stack([rows[:, 4], rows[:, 5]])
    waves = np.array([np.cos(2 * np.pi * 61.25 * t), np.sin(2 * np.pi * 61.25 * t)])
    both = np.einsum("nk,kn->n", np.repeat(sizes, 4000, axis=0), waves)[:, None] + forced
    turning = unbalanced * np.column_stack([np.cos(speed * t + angle), np.sin(speed * t + angle)])
    return trial_of(rows, both + turning, angle, "r")


def test_a_random_line_is_no_onset_where_the_blocks_of_repeats_differ_as_much_and_a_rest_is_one_in_each():
    """Two later blocks that a random line moves alike make an onset of one record in four, of two that repeat in 18."""
    rng = np.random.default_rng(1)
    pairs = [[moved_at_random(3e-6 * rng.normal(size=(4, 2))) for _ in (0, 1)] for _ in range(100)]
    alone = np.mean([not t.settled for pair in pairs for t in pair])
    assert 0.2 < alone < 0.35
    assert np.mean([not with_repeats(t, pair).settled for pair in pairs for t in pair]) < 0.25 * alone
    fading = 5e-6 * 0.4 ** np.arange(4)[:, None] * np.ones(2)
    at_rest = [moved_at_random(fading + 2e-7 * rng.normal(size=(4, 2))) for _ in (0, 1)]
    assert not any(with_repeats(t, at_rest).settled for t in at_rest)
    # a record in motion from the start is simulated by itself
    mixed = [at_rest[0], moved_at_random(2e-7 * rng.normal(size=(4, 2)))]
    assert [with_repeats(t, mixed).settled for t in mixed] == [False, True] and mixed[0].inputs != mixed[1].inputs


@pytest.mark.parametrize("hertz", [61.25, 41.3])
@pytest.mark.parametrize(("unbalanced", "angle"), [(2e-5, 0.0), (2e-5, 2.0), (1e-6, 0.0)])
def test_a_rest_is_an_onset_whatever_the_angle_at_the_start_and_the_weights_of_repeats_are(hertz, unbalanced, angle):
    """1X on an excited line, or between two of a block: it repeats within each record, not from one to the next."""
    fading, speed = 1e-5 * 0.4 ** np.arange(4)[:, None] * np.ones(2), 2 * np.pi * hertz
    pair = [moved_at_random(fading, speed, 2e-5, 0.0), moved_at_random(fading, speed, unbalanced, angle)]
    assert [with_repeats(t, pair).settled for t in pair] == [False, False]


def test_every_input_has_to_repeat_with_the_period():
    """A force that repeats next to a reference that does not has no period, and each alone has its own."""
    rows = shaken(0.0)
    assert trial_of(rows, np.zeros((len(rows), 2)), 0.0, "force").length == 4000
    rows[:, 2] = np.random.default_rng(1).normal(size=len(rows))
    assert not trial_of(rows, np.zeros((len(rows), 2)), 0.0, "both").repeating


@pytest.mark.parametrize("reach", [4e-6, 1e-6])
def test_a_motion_with_a_spring_behind_dry_friction_is_that_of_a_long_run(reach, request):
    """The spring slips in each period; a run takes its stretch over from the last one."""
    one = LawTerm(SLIPPING_SPRING, (("reach", reach),), one=True)
    load(written(ProposedLaw("disc 0", (one,), np.ones(1), 0, 0, 0, np.zeros(0), np.ones(1)), {"disc 0": 0.3}, "slips"))
    request.addfinalizer(lambda: REGISTRY.pop("slips"))
    rotor = load_machine("plain_rotor").replace("effects.slips.slipping_spring", "2e5 N/m")
    twin, speed = Twin(rotor.replace("effects.slips.reach", f"{reach!r} m")), 80 * np.pi
    t = np.arange(4000) * RIG_SAMPLE
    rows = np.zeros((len(t), 6))
    rows[:, 0], rows[:, 4] = speed, 4 * np.sin(2 * np.pi * 25 * t) + 2 * np.sin(2 * np.pi * 37.5 * t)
    found = forced_motion(twin, {}, rows, 0.0, 0.0)
    long = Simulation(twin.assembly, settle(twin.assembly, speed, 0.0)).advance(np.tile(rows, (50, 1)))
    assert found.readings[:, :2] == pytest.approx(long[-len(rows) :, READ : READ + 2], abs=1e-9)
