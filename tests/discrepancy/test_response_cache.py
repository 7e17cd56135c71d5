"""Responses that are not computed twice: the cache of an interrupted diagnosis, derivatives from what is known."""

import numpy as np
import pytest

from rotorsim.base.cache import Cache
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, other_law
from rotorsim.discrepancy.comparison import SensitivityColumns, TwinComparison, simulate
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.records import make_trial
from rotorsim.discrepancy.trial import trial_of
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from rotorsim.plant import Plant


def test_a_response_is_computed_once_for_every_place(machine, models, tmp_path):
    planned = next(p for p in campaign(machine) if p.name == "fit_3")
    trial = make_trial(record_of(models.twin, planned, ParameterPoint(), 1), "fit", "r")
    cache = Cache(tmp_path / "unfinished")
    first = TwinComparison(models.twin, [trial], cache=cache)
    here, there = ParameterPoint(), ParameterPoint({FitParameter("shaft_damping", 0.1): 0.2})
    kept = first.predict(here), first.predict(there)
    again = TwinComparison(models.twin, [trial], cache=cache)
    np.testing.assert_array_equal(again.predict(here), kept[0])
    np.testing.assert_array_equal(again.predict(there), kept[1])
    assert (first.evaluations, again.evaluations) == (2, 0)
    assert np.abs(kept[0] - kept[1]).max() > 1e-9


def test_a_file_cut_off_is_computed_again(machine, models, tmp_path):
    planned = next(p for p in campaign(machine) if p.name == "fit_3")
    trial = make_trial(record_of(models.twin, planned, ParameterPoint(), 1), "fit", "r")
    comparison = TwinComparison(models.twin, [trial], cache=Cache(tmp_path))
    kept = comparison.predict(ParameterPoint())
    (path,) = tmp_path.glob("*.npy")
    path.write_bytes(path.read_bytes()[:200])
    assert comparison.predict(ParameterPoint()) == pytest.approx(kept, abs=0)


def turning(models, speeds=(150.0, 210.0, 260.0)):
    """Comparison with records that only turn, and the runs of each that it makes."""
    rows = [np.tile([v, 0.0, 0.0, 0.0, 0.0, 0.0], (6000, 1)) for v in speeds]
    trials = [trial_of(one, np.zeros((6000, 2)), 0.3, f"{one[0, 0]:g}") for one in rows]
    made, runs = TwinComparison(models.twin, trials, threads=1), []
    run = made.run
    made.run = lambda jobs, *more, **given: runs.extend(jobs) or run(jobs, *more, **given)
    return made, runs


def test_neither_a_response_nor_a_step_of_a_difference_is_computed_twice(models):
    """A central Jacobian where one of one side is known takes the other side alone; both are derivatives."""
    made, runs = turning(models)
    here, damping = ParameterPoint(), FitParameter("shaft_damping", 0.1)
    first = made.predict(here)
    np.testing.assert_array_equal(made.predict(ParameterPoint()), first)
    assert len(runs) == 3
    one_sided = made.jacobian(here, [damping])
    assert len(runs) == 6
    np.testing.assert_array_equal(made.jacobian(here, [damping]), one_sided)
    central = made.jacobian(here, [damping], central=True)
    assert len(runs) == 9
    ahead, behind = (made.predict(here.moved([damping], np.array([step]))) for step in (0.05, -0.05))
    direct = (ahead - behind) / 0.1
    assert np.linalg.norm(central[:, 0] - direct) < 0.02 * np.linalg.norm(direct)
    assert np.linalg.norm(one_sided[:, 0] - direct) < 0.2 * np.linalg.norm(direct)


def test_the_sine_of_a_phase_follows_from_its_cosine_and_one_run(models):
    """A force that turns at 2X gives a quarter of a period later the same response, a quarter of a period later."""
    stem, origin = "coupling.0.force_2x~phase_2x", ParameterPoint()
    both = [FitParameter(f"{stem}.{part}", 0.5) for part in "cs"]
    made, runs = turning(models)
    found = made.jacobian(origin, both)
    assert len(runs) == 3 + 3 + 1
    direct = made.column(origin, both[1], made.predict(origin))
    assert np.linalg.norm(found[:, 1] - direct) < 1e-3 * np.linalg.norm(direct)
    assert abs(found[:, 0] @ direct) < 0.1 * np.linalg.norm(direct) ** 2  # not the same response


@pytest.mark.parametrize("key", ["shaft_damping", "coupling.0.force_2x", "runout.0.amplitude_2x"])
def test_candidates_that_are_off_take_no_part_in_a_run_and_change_no_bit(models, key):
    made, _ = turning(models)
    values = {key: 1e-6 if "runout" in key else 0.2}
    lean = models.twin.lean(values)
    assert set(lean.slots) < set(models.twin.slots) and lean is models.twin.lean(dict(values))
    rows = made.trials[0].rows[:600]
    for one in (values, {}):
        np.testing.assert_array_equal(models.twin.run(one, rows, 0.0), models.twin.lean(one).run(one, rows, 0.0))


def test_twins_of_one_grid_share_their_machine_code():
    """A pedestal adds coordinates, slip a flow: what few candidates leave of both is the machine code of all."""
    twin = Twin(load_machine("dtu_gas_bearing"), (16, 4))
    few, (law, _) = twin.lean({"shaft_bow.0.bow": 1e-6}), other_law(twin)
    assert len(few.slots) < len(twin.slots) and len(law.slots) < len(twin.slots)
    modules = {one.assembly.module.run.__module__ for one in (twin, few, law)}
    assert len(modules) == 1
    plain = Plant("dtu_gas_bearing", n_theta=16, n_z=4).assembly
    assert plain.module.newton is twin.assembly.module.newton and plain.rotor.n < twin.assembly.rotor.n


@pytest.mark.slow
def test_a_step_of_a_difference_that_goes_on_from_the_motion_nearby_gives_the_same_derivative():
    """A film has forgotten a small change within 0.12 s to half a percent, at two thirds of the samples."""
    twin = Twin(load_machine("dtu_gas_bearing"), (16, 4), only=("runout", "actuator_delay", "actuator_gain"))
    rows, t = np.zeros((6000, 6)), np.arange(6000) * 2e-4
    rows[:, 0], rows[:, 1] = 2 * np.pi * 50, 0.4e6
    rows[:, 2] = 0.3 * sum(np.cos(2 * np.pi * f * t + f) for f in range(20, 200, 15))
    trial = trial_of(rows, np.zeros((6000, 2)), 0.3, "multisine")
    assert trial.lead > 0
    origin, key = ParameterPoint(), FitParameter("shaft_damping", 0.1)
    delay, gain = FitParameter("actuator_delay.0.delay", 5e-5), FitParameter("actuator_gain.0.error", 1e-3)
    late = origin.moved([delay], np.array([5e-3]))
    steps = [(origin, p) for p in (key, FitParameter("actuator_x", 0.02), FitParameter("unbalance.0.me~phase.c", 1e-6))]
    for begin, parameter in (*steps, (late, gain), (origin, delay)):
        there = begin.moved([parameter], np.array([parameter.step]))
        here, cold = simulate(twin, trial, begin), simulate(twin, trial, there)
        assert np.abs(simulate(twin, trial, there, near=begin) - cold).max() < 0.02 * np.abs(cold - here).max()


@pytest.mark.slow
@pytest.mark.parametrize("key", ["ball_bearing.0.clearance", "sensor_delay.0.delay", "internal_damping.0.time",
                                 "weak_injector.0.blocked", "hysteresis.0.weight"])  # fmt: skip
def test_a_run_from_the_motion_of_the_machine_without_a_candidate_has_the_bits_of_one_from_its_own(key):
    """A candidate that is off moves nothing, so that the motion of a twin without it is its motion."""
    twin = Twin(load_machine("dtu_gas_bearing"), (16, 4))
    rows, t = np.zeros((4000, 6)), np.arange(4000) * 2e-4
    rows[:, 0], rows[:, 1], rows[:, 2] = 2 * np.pi * 50, 0.4e6, 0.3 * np.cos(2 * np.pi * 45 * t)
    values = {"unbalance.0.me": 2e-6, key: 1e-6 if "clearance" in key else 1e-4}
    own, led = twin.lean(values), twin.lean({"unbalance.0.me": 2e-6})
    assert own is not led and led.assembly.w.size <= own.assembly.w.size
    found = [own.over_period(values, rows, 0.3, 0.4e6, 2000, {"unbalance.0.me": 2e-6}, one) for one in (None, led)]
    np.testing.assert_array_equal(*found)
    assert len(led._motions) == 1 and np.ptp(found[0][:, 0]) > 1e-7


@pytest.mark.slow
def test_a_step_of_a_delay_begins_with_the_references_before_also_where_the_motion_has_none_of_them():
    """A delay that is off keeps the references: its motion is its own, not that of a twin that keeps none."""
    twin = Twin(load_machine("dtu_gas_bearing"), (16, 4))
    rows, t = np.zeros((4000, 6)), np.arange(4000) * 2e-4
    rows[:, 0], rows[:, 1], rows[:, 2] = 2 * np.pi * 50, 0.4e6, 0.3 * np.cos(2 * np.pi * 45 * t)
    near = {"unbalance.0.me": 2e-6}
    values = near | {"actuator_delay.0.delay": 1e-3}
    own, led = twin.lean(values), twin.lean(near)
    found = [own.over_period(values, rows, 0.3, 0.4e6, 2000, near, one) for one in (None, led)]
    np.testing.assert_array_equal(*found)
    assert not led._motions and len(own._motions) == 1
    off, cold = (own.over_period(one, rows, 0.3, 0.4e6, 2000)[:, :2] for one in (near, values))
    assert np.abs(found[0][:, :2] - cold).max() < 0.005 * np.abs(off - cold).max()


@pytest.mark.slow
def test_steps_of_forms_with_other_options_go_on_from_one_motion(monkeypatch):
    """Options of an effect that is off change nothing: its forms' steps need one run from the equilibrium, not each."""
    twin = Twin(load_machine("dtu_gas_bearing"), (16, 4), only=("runout",))
    rows, t = np.zeros((6000, 6)), np.arange(6000) * 2e-4
    rows[:, 0], rows[:, 1], rows[:, 2] = 2 * np.pi * 50, 0.4e6, 0.3 * np.cos(2 * np.pi * 45 * t)
    comparison, led = TwinComparison(twin, [trial_of(rows, np.zeros((6000, 2)), 0.3, "sine")], threads=1), []
    own = Twin._led
    monkeypatch.setattr(Twin, "_led", lambda *given: led.append(1) or own(*given))
    size, origin = FitParameter("runout.0.amplitude_2x", 1e-6), ParameterPoint()
    held = [origin.holding({"runout.0.phase_2x": phase}) for phase in (0.0, 0.5, 1.0)]
    here = comparison.predict(origin)
    columns = [comparison.column(point, size, here) for point in held]
    assert len(led) == 1  # for the response there, whose motion is that of all
    direct = (comparison.predict(held[2].moved([size], np.array([1e-6]))) - here) / 1e-6
    assert np.linalg.norm(columns[2] - direct) < 0.02 * np.linalg.norm(direct)
    assert np.linalg.norm(columns[2] - columns[0]) > 0.1 * np.linalg.norm(direct)


def test_records_that_repeat_each_other_share_their_derivatives(models):
    made, runs = turning(models, (150.0, 150.01, 210.0))
    damping = FitParameter("shaft_damping", 0.1)
    found = made.jacobian(ParameterPoint(), [damping])[:, 0]
    assert len(runs) == 3 + 2
    alone, _ = turning(models, (150.01,))
    direct = alone.jacobian(ParameterPoint(), [damping])[:, 0]
    assert np.linalg.norm(found[made.layout.record == 1] - direct) < 1e-2 * np.linalg.norm(direct)


def test_a_kept_sensitivity_does_not_depend_on_who_asked_first(models, tmp_path):
    """The column of a sine by its own step and the one from its cosine have a file each."""
    made, _ = turning(models)
    cosine, sine = (FitParameter(f"unbalance.0.me~phase.{part}", 1e-6) for part in "cs")

    def asked(folder, *together):
        store = SensitivityColumns(made)
        store.cache = Cache(tmp_path / folder)
        return [store.columns(ParameterPoint(), parameters) for parameters in together]

    alone, pair = asked("a", [sine], [cosine, sine])
    own_pair, own_alone = asked("b", [cosine, sine], [sine])
    np.testing.assert_array_equal(pair, own_pair)
    np.testing.assert_array_equal(alone, own_alone)
    assert np.any(alone[:, 0] != pair[:, 1])
