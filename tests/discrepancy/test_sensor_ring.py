"""Records made with the ring of the displacement probes turned: known change, twin, plan of such a record."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification import make_record
from identification.records.mapping import parse
from refusals import refused
from rotorsim.base.errors import DataError, ReadError
from rotorsim.campaign import load_plan
from rotorsim.discrepancy import diagnose, runup_vectors
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, setting
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.changes import RING_KEY, known_changes, ring_angle, with_ring
from rotorsim.discrepancy.comparison import TwinComparison, flagged, simulate, table
from rotorsim.discrepancy.data_vector import repeats
from rotorsim.discrepancy.experiments import RING_ANGLE, campaign, options
from rotorsim.discrepancy.forecast import Forecast, Outlook, on_turned_ring
from rotorsim.discrepancy.gap import equivalent_force
from rotorsim.discrepancy.hidden_machine import draw, record_of
from rotorsim.discrepancy.loop import record_on
from rotorsim.discrepancy.ranking import ExperimentPlan, Proposal
from rotorsim.discrepancy.records import check_ring, make_trial, make_trials
from rotorsim.discrepancy.run_ups import empty_sweep
from rotorsim.discrepancy.twin import Twin
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import settle

STATED = json.dumps({"sensor_ring": {"angle": math.radians(30)}})
TURN = np.array([[math.cos(math.pi / 6), 0.5], [-0.5, math.cos(math.pi / 6)]])
"""Readings of a ring at 30 deg from those of one at 0."""


def planned(machine, hits=1):
    """A hammer record at 20 Hz."""
    first = campaign(machine)[0]
    return replace(first, experiment=replace(first.experiment, hits=hits))


def test_a_stated_angle_holds_in_place_of_the_machine_files_own(machine):
    assert known_changes(machine, STATED, "run") == {RING_KEY: pytest.approx(math.radians(30))}
    turned = with_ring(machine, math.radians(20))
    assert ring_angle(turned) == math.radians(20) and ring_angle(machine) == 0
    assert known_changes(turned, STATED, "run") == {RING_KEY: pytest.approx(math.radians(10))}
    assert known_changes(turned, '{"sensor_ring": {"angle": 0}}', "run") == {RING_KEY: pytest.approx(-math.radians(20))}


def test_the_mapping_takes_degrees():
    found = parse({"changes": {"sensor_ring": {"angle": "30 deg"}}})
    assert json.loads(found.conditions["changes"]) == {"sensor_ring": {"angle": pytest.approx(math.radians(30))}}


@pytest.mark.parametrize(
    ("ring", "sentence"),
    [
        (30, r"changes.sensor_ring: 30; write \{ angle = '30 deg' \}"),
        ({}, r"changes.sensor_ring: .*write \{ angle"),
        ({"angle": 30}, "changes.sensor_ring.angle: .*30"),
        ({"angle": "30 mm"}, "changes.sensor_ring.angle: .*not a known unit of angle"),
        ({"angle": "nan deg"}, "changes.sensor_ring.angle: .*nan"),
        ({"angle": "30 deg", "axis": "x"}, "changes.sensor_ring.axis: is not known; give angle"),
    ],
)
def test_mistakes_in_the_mapping_end_in_a_sentence(ring, sentence):
    with pytest.raises(ReadError, match=sentence) as error:
        parse({"changes": {"sensor_ring": ring}})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("angle", ["NaN", '"30 deg"', "true", "null", "7", "-Infinity"])
def test_an_angle_that_is_none_is_refused(machine, angle):
    with refused(DataError, "sensor_ring", lambda ring: ring is not None):
        known_changes(machine, f'{{"sensor_ring": {{"angle": {angle}}}}}', "run")


def test_an_angle_that_is_stated_twice_is_refused(machine):
    stated = json.dumps({"sensor_ring": {"angle": 0.5}, "effects.sensor_ring.angle": "20 deg"})
    with refused(DataError, "sensor_ring"):
        known_changes(with_ring(machine, 0.1), stated, "run")


def test_the_twin_reads_the_unturned_readings_in_the_axes_of_the_ring(machine, models):
    """To round-off, though the ring is neither in the machine file nor among the candidates."""
    rows = np.tile([200.0, 0, 0, 0, 3.0, 5.0], (400, 1))
    twin = models.twin
    assert "sensor_ring" not in machine.effects and not [f for f in candidates(twin) if f.effect == "sensor_ring"]
    still = twin.run({}, rows, 0.0)
    turned = twin.run(setting(twin, known_changes(machine, STATED, "run")), rows, 0.0)
    np.testing.assert_allclose(turned[:, :2], still[:, :2] @ TURN.T, rtol=0, atol=1e-18)
    assert turned[:, 2:].tobytes() == still[:, 2:].tobytes()  # keyphasor and speed


def test_a_hidden_record_on_a_turned_ring_leaves_nothing_where_it_is_stated(machine, models):
    """Runout of the surface under the probes' new places included; not stated it leaves most of the response."""
    twin = models.twin
    point = ParameterPoint({FitParameter("runout.0.amplitude_2x~phase_2x.c", 2e-7): 3e-6})
    known = known_changes(machine, STATED, "run")
    record = record_of(twin, planned(machine), point, 3, changes=known)
    (stated,), (silent,) = (
        make_trials(machine, [("a", record.assign_attrs(changes=text))], None) for text in (STATED, "")
    )
    size = np.abs(stated.spectra).max()
    assert np.abs(simulate(twin, stated, point) - stated.spectra).max() < 1e-6 * size
    assert np.abs(simulate(twin, silent, point) - stated.spectra).max() > 0.3 * size


def test_records_that_differ_by_the_ring_do_not_repeat_each_other(machine, models):
    trial = make_trial(record_of(models.twin, planned(machine), ParameterPoint(), 3))
    turned = replace(trial, changes=known_changes(machine, STATED, "run"))
    assert repeats(trial, trial) and repeats(turned, turned) and not repeats(trial, turned)


def test_tables_of_vectors_that_differ_by_what_was_changed_are_simulated_apart(machine):
    like = empty_sweep(np.linspace(50.0, 250.0, 20), 0.0, (1,))
    assert replace(like, changes=known_changes(machine, STATED, "run")).inputs != like.inputs


def test_a_single_probe_and_a_turned_ring_are_refused(machine, models):
    record = record_of(models.twin, planned(machine), ParameterPoint(), 3)
    trial = replace(make_trial(record), probe_angle=0.3)
    check_ring(machine, trial)
    sentence = "the sensor ring is turned, but the record has one probe; leave the ring out"
    for own, changes in ((machine, known_changes(machine, STATED, "run")), (with_ring(machine, 0.2), {})):
        with pytest.raises(DataError, match=sentence):
            check_ring(own, replace(trial, changes=changes))


def test_a_run_up_that_turns_backwards_and_a_turned_ring_are_refused(machine):
    t = np.arange(20000) / 5000
    angle = -(2 * np.pi * (10 * t + 5 * t**2))
    disc = 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    record = make_record(t, {"disc_measured": disc, "angle_measured": angle}, {"record": "run"})
    assert runup_vectors(record).sizes["axis"] == 2
    with refused(DataError, "sensor_ring", STATED):
        runup_vectors(record.assign_attrs(changes=STATED))


def test_the_equivalent_force_has_its_direction_in_x_and_y_whatever_the_ring(machine, models):
    """2 N along 50 deg at 63 Hz, seen by probes at 30 and 120 deg."""
    twin = models.twin
    trial = make_trial(record_of(twin, planned(machine), ParameterPoint(), 3))
    trial = replace(trial, changes=known_changes(machine, STATED, "run"))
    c = TwinComparison(twin, [trial], 1)
    c.sigma = np.full(len(c.measured), 1e-9)
    line = int(np.argmin(np.abs(trial.frequencies - 63.0)))
    f = trial.frequencies[line]
    G = linearise(twin.set({}), settle(twin.set({}), trial.speed, 0.0), trial.speed).transfer(2j * np.pi * f)[:, 2:4]
    residual = trial.spectra * 0
    residual[:, :, line] = TURN @ G @ (2.0 * np.array([math.cos(math.radians(50)), math.sin(math.radians(50))]))
    white = trial.vector(residual) / c.sigma
    found = equivalent_force(c, ParameterPoint(), white, flagged(table(c, white)))["lines"][0]
    assert found["direction"] == "along 50 deg from x"
    assert found["force_n"] == pytest.approx(2.0, rel=1e-6)


def test_a_plan_turns_the_ring_at_every_operating_point_and_its_record_states_it(machine, models, tmp_path):
    trial = make_trial(record_of(models.twin, planned(machine), ParameterPoint(), 3))
    found = options(machine, [trial], ("speed", "sensor-ring"))
    turned = [o for o in found if o.ring]
    assert len(turned) == len({o.speed for o in found}) == len(found) / 2
    option = turned[0]
    assert option.name.endswith(", sensor ring turned by 30 deg") and option.minutes > 12
    assert option.trial(machine).changes == {RING_KEY: RING_ANGLE}
    record = record_on(machine, models.twin, ParameterPoint(), 3, option, 1)
    assert json.loads(record.attrs["changes"]) == {"sensor_ring": {"angle": RING_ANGLE}}
    outlook = Outlook(0.1, 0.9, 0.9, np.full(2, 0.9), np.full(2, 0.9))
    plan = ExperimentPlan(1.0, ("a", "b"), (Proposal(option, outlook),), odds=(0.5, 0.5))
    (tmp_path / "next.toml").write_text(plan.campaign(machine, "plain_rotor"))
    assert "30 deg" in (tmp_path / "next.toml").read_text()
    loaded = load_plan(tmp_path / "next.toml")
    made = loaded._machine_of(loaded.case(0).case)
    assert ring_angle(made) == pytest.approx(RING_ANGLE) and list(loaded.cases())


def test_vectors_of_two_probes_can_be_made_on_a_turned_ring_and_those_of_one_cannot(machine):
    like = empty_sweep(np.linspace(50.0, 250.0, 20), 0.0, (1,))
    turned = [o for o in options(machine, [like], ("sensor-ring",)) if o.ring]
    assert len(turned) == 1 and turned[0].trial(machine).changes == {RING_KEY: RING_ANGLE}
    single = replace(like, probe_angle=0.0)
    with refused(DataError, "allow", "sensor-ring"):
        options(machine, [single], ("sensor-ring",))
    assert not [o for o in options(machine, [single], ()) if o.ring]


def test_sensitivities_of_the_motion_turn_with_the_ring_and_those_of_the_sensors_are_simulated(machine):
    """Both as the plant gives them on the turned ring."""
    twin = Twin(machine, only=("sensor_gain", "shaft_bow"))
    usual, option = options(
        machine, [make_trial(record_of(twin, planned(machine), ParameterPoint(), 3))], ("sensor-ring",)
    )
    keys = ("unbalance.0.me~phase.c", "shaft_bow.0.bow~phase.c", "sensor_gain.0.x")
    steps = (1e-5, 1e-6, 0.03)
    parameters = [FitParameter(key, step) for key, step in zip(keys, steps, strict=True)]
    fit = SimpleNamespace(parameters=parameters, point=ParameterPoint({p: 0.0 for p in parameters}))
    forecast = Forecast(TwinComparison(twin, [usual.trial(machine)], 1), [fit], [0.0])
    trials = [usual.trial(machine), option.trial(machine)]
    means = forecast.means(trials)
    near, exact = forecast.columns(trials, means)
    (of_sensors,) = forecast.columns(trials[1:], means[1:], of_sensors=True)
    assert {key for _, key in of_sensors} == {"sensor_gain.0.x"}
    found = on_turned_ring(near, option.ring) | of_sensors
    assert found.keys() == exact.keys() == {(-1, key) for key in keys}
    for key, column in exact.items():
        np.testing.assert_allclose(found[key], column, rtol=0, atol=1e-9 * np.abs(column).max())
        assert np.abs(near[key] - column).max() > 0.1 * np.abs(column).max()


@pytest.mark.slow
def test_stated_rings_are_no_disagreement_and_silent_ones_are(machine, models, truth_plant):
    truth = draw(truth_plant, (), 3, (3.0, 6.0))
    kept = ("fit_1", "fit_2", "fit_3", "fit_5", "fit_2_repeat", "held_out_1", "held_out_2", "untouched_2")
    known, records = known_changes(machine, STATED, "run"), []
    for i, one in enumerate(p for p in campaign(machine) if p.name in kept):
        one = replace(one, experiment=replace(one.experiment, hits=1))
        there = one.name in ("fit_2", "fit_2_repeat", "held_out_1", "untouched_2")
        record = record_of(truth_plant, one, truth.point, 3, changes=known if there else None)
        noise = np.random.default_rng([3, i]).normal(0, 1e-7, record.disc_measured.shape)
        record["disc_measured"] = record.disc_measured.copy(data=record.disc_measured.values + noise)
        records.append(record.assign_attrs(changes=STATED) if there else record)
    found = diagnose(machine, records, models=models)
    assert found.status == "no_disagreement"
    assert any("changed on purpose" in note and "fit_2 (sensor_ring.0.angle)" in note for note in found.notes)
    silent = diagnose(machine, [r.assign_attrs(changes="") for r in records], models=models)
    assert silent.status != "no_disagreement"


@pytest.mark.slow
def test_a_run_on_a_turned_ring_shows_as_much_of_the_motion_as_the_usual_one(machine, models, recorded):
    """Two probes with the same scatter read all of the motion on any ring; the first look has sensitivities."""
    records, _ = recorded(("shaft_bow",), 5, (1.0, 2.0))
    found = diagnose(machine, records[:1], models=models, plan_next=("sensor-ring",))
    assert found.planned is not None and found.planned.tried == 2
    usual, turned = sorted(found.planned.proposals, key=lambda p: p.option.ring)
    assert turned.option.ring == RING_ANGLE and not turned.bare
    assert turned.outlook.entropy == pytest.approx(usual.outlook.entropy, abs=0.02)
    assert turned.outlook.entropy < found.planned.entropy - 0.02  # both take away more than they may differ by
