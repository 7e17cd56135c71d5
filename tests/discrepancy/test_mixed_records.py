"""Diagnosis of records at constant speed together with a coast-down over time, whose vectors it makes itself."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification import make_record, make_vectors
from rotorsim.discrepancy import diagnose, runup_vectors
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.data_vector import floor, make_layout, repeat_scatter, unknown_sources
from rotorsim.discrepancy.diagnosis import DiagnosisRun, trials_of
from rotorsim.discrepancy.experiments import PlannedRecord
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.records import UNTESTED, limits, make_trials
from rotorsim.discrepancy.run_ups import TOLERANCE, is_table, make_sweeps, sweeps, with_tables
from rotorsim.experiments import Coastdown

EFFECTS = ("coupling", "runout", "shaft_bow")
RATE = 2 * np.pi * 2.0


def coast(seconds=10.0, **attrs):
    """A coast-down from 300 rad/s at 20 rad/s2 with 1X of 2 um, lag 0.5."""
    t = np.arange(int(seconds * 5000)) / 5000
    angle = 300 * t - 10 * t**2
    disc = 2e-6 * np.column_stack([np.cos(angle - 0.5), np.sin(angle - 0.5)]) + [1e-5, 0.0]
    channels = {"disc_measured": disc, "angle_measured": angle, "speed_measured": 300 - 20 * t}
    return make_record(t, channels, {"record": "coast", **attrs})


def steady(speed=200.0):
    """A second and a half at constant speed with 1X of 2 um and noise of 10 nm."""
    t = np.arange(7500) / 5000
    noise = np.random.default_rng(int(speed)).normal(0, 1e-8, (len(t), 2))
    disc = 2e-6 * np.column_stack([np.cos(speed * t), np.sin(speed * t)]) + noise
    return make_record(t, {"disc_measured": disc, "angle": speed * t, "speed": np.full(len(t), speed)})


def test_a_record_whose_speed_sweeps_becomes_vectors_and_a_note_says_so():
    (name, table), (_, same) = with_tables([("run", coast(role="untouched")), ("still", steady())])
    assert name == "run" and is_table(table) and not is_table(same)
    one = table["amplitude"].values * np.exp(-1j * table["phase"].values)
    np.testing.assert_allclose(one[:, 0, 0], 2e-6 * np.exp(-0.5j), atol=1e-8)
    assert table.attrs["role"] == "untouched" and table.attrs["rate"] == pytest.approx(20, rel=0.01)
    (note,) = table.attrs["notes"]
    assert note.endswith(f"rpm: taken as {table.sizes['speed']} vectors, each over 8 revolutions")


def test_the_revolutions_of_a_window_are_those_that_the_record_states():
    (_, table), = with_tables([("run", coast(turns=4.0))])  # fmt: skip
    assert table.attrs["turns"] == 4 and "each over 4 revolutions" in table.attrs["notes"][0]


def test_records_at_constant_speed_or_with_excitation_or_without_angle_stay_records():
    given = coast()
    force = np.zeros((given.sizes["time"], 2))
    force[100:110, 0] = 5.0
    hit = given.assign(disc_force=(("time", "axis"), force))
    assert sweeps(given) and not sweeps(steady())
    assert not sweeps(hit) and not sweeps(given.drop_vars("angle_measured"))
    assert not sweeps(runup_vectors(given))


def test_a_stated_role_is_that_of_all_rows_and_without_one_every_use_has_some(machine):
    (_, whole), (_, split) = with_tables([("a", coast(role="held_out")), ("b", coast())])
    assert {t.role for t in trials_of(machine, [("a", whole)], None)} == {"held_out"}
    assert {t.role for t in trials_of(machine, [("b", split)], None)} == {"fit", "held_out", "untouched"}
    assert {t.role for t in trials_of(machine, [("b", split)], "fit")} == {"fit"}


def both_kinds(machine):
    records = make_trials(machine, [("a", steady()), ("b", steady(150.0))], "fit")
    speeds = np.linspace(100, 300, 24)
    empty = np.zeros((24, 3, 2))
    return records, make_sweeps(make_vectors(speeds, empty + 1e-6, empty, (1, 2, 3), {"rate": 20.0}), "t", False)[:1]


def test_rows_of_vectors_and_lines_of_records_do_not_share_their_scatter(machine, rng):
    """Each kind has the floor that it has alone, to the last bit, and is known by itself."""
    records, tables = both_kinds(machine)
    size = {id(t): 1e-6 * rng.normal(size=t.spectra.shape) for t in records}
    size |= {id(t): 1e-8 * rng.normal(size=t.spectra.shape) for t in tables}
    parts = [repeat_scatter(part, [size[id(t)] for t in part]) for part in (records, tables, [*records, *tables])]
    (lines, means, drifts, known), (rows, *_, guessed), (all_, all_means, all_drifts, all_known) = parts
    np.testing.assert_array_equal(all_[:2, :, : lines.shape[2]], lines)
    np.testing.assert_array_equal(all_[2:, :, : rows.shape[2]], rows)
    np.testing.assert_array_equal(all_means[:2], means)
    np.testing.assert_array_equal(all_drifts[:2], drifts)
    assert known and not guessed and not all_known
    assert unknown_sources([*records, *tables]) == ["neighbouring rows"] and unknown_sources(records) == []


def test_vectors_have_their_tolerance_and_records_theirs(machine):
    trials = [t for part in both_kinds(machine) for t in part]
    layout, n = make_layout(trials), len(trials)
    none = np.zeros((n, 2, max(t.spectra.shape[2] for t in trials)))
    response = np.where(layout.drift, 0.0, 1e-3)
    low = floor(trials, layout, none, none[:, :, 0], none[:, :, 0], response, 0 * response, 0.004)
    ratio = (low / 1e-3)[~layout.drift & (layout.frequency > 0)]
    of_rows = (layout.record == n - 1)[~layout.drift & (layout.frequency > 0)]
    np.testing.assert_allclose(ratio[of_rows], TOLERANCE, rtol=1e-5)
    np.testing.assert_allclose(ratio[~of_rows], 0.004, rtol=1e-5)


def test_the_zeros_of_the_sensors_are_those_of_the_records(machine, models):
    records, tables = both_kinds(machine)
    mixed = TwinComparison(models.twin, [*records, *(replace(t, alone=False) for t in tables)])
    shown = {int(i) for i in mixed.layout.record[mixed.directions["offset_x"] > 0]}
    assert shown == {0, 1}
    assert TwinComparison(models.twin, list(tables)).directions["offset_x"].sum() == 1


@pytest.mark.parametrize("roles", [("fit",), ("fit", "held_out"), ("fit", "held_out", "untouched")])
def test_records_of_which_none_is_untouched_have_the_note_that_nothing_tests_the_verdict(machine, roles):
    records, _ = both_kinds(machine)
    fitted = SimpleNamespace(trials=records, scatter_known=True)
    run = SimpleNamespace(fitted=fitted, machine=machine, trials=records, parts=dict.fromkeys(roles, fitted))
    assert (UNTESTED in DiagnosisRun._notes_on_records(run)) == ("untouched" not in roles)


def test_a_sweep_shows_what_one_speed_does_not(machine):
    records, tables = both_kinds(machine)
    assert any("one speed only" in note for note in limits(records[:1], False))
    assert not any("speed" in note for note in limits([records[0], *tables], False))
    assert limits(tables, False) == []


def with_coast_down(recorded, truth_plant, effects, seed, **attrs):
    """Hidden records and a coast-down at 120 rpm/s of the same machine, with the noise of the records."""
    records, truth = recorded(effects, seed)
    planned = PlannedRecord("coast", "fit", Coastdown(2 * np.pi * 38, 2 * np.pi * 8, RATE), 77)
    down = record_of(truth_plant, planned, truth.point, seed)
    noise = np.random.default_rng([seed, 77]).normal(0, 1e-7, down.disc_measured.shape)
    down["disc_measured"] = down.disc_measured.copy(data=down.disc_measured.values + noise)
    del down.attrs["role"]
    return [*records, down.assign_attrs(attrs)], truth


@pytest.mark.slow
@pytest.mark.parametrize("hum", [0.0, 2e-6])
def test_nothing_is_missing_in_records_and_a_coast_down(machine, models, recorded, truth_plant, hum):
    """Accuracy: 0.1 um of scatter over 8 revolutions of 130 samples or more is 4 nm; 30 nm are stated.

    2X passes the hum of 50 Hz at 1500 rpm.
    """
    records, _ = with_coast_down(recorded, truth_plant, (), 4, accuracy=3e-8)
    tone = hum * np.cos(2 * np.pi * 50 * records[-1]["time"].values)
    records[-1]["disc_measured"] = records[-1]["disc_measured"] + tone[:, None]
    found = diagnose(machine, records, effects=EFFECTS, models=models)
    assert found.status == "no_disagreement" and found.localisation == ()
    assert any("hum of the mains at 50 Hz, 2 um in x, 2 um in y" in note for note in found.notes) == bool(hum)
    assert any("'coast': its speed sweeps" in note and "8 revolutions" in note for note in found.notes)
    assert {"coast, fit", "coast, held_out", "coast, untouched", "fit_1"} <= set(found.gap["record"].values)


@pytest.mark.slow
def test_a_hidden_force_is_named_by_records_and_a_coast_down(machine, models, recorded, truth_plant):
    """Accuracy: the shaft rings on where 2X has passed its resonance with 9 um; at 873 rpm that is 3X of 1.7 um, with
    phases at which no twin's run begins. With 0.1 um stated the force explains too little of that and is partial.
    """
    records, _ = with_coast_down(recorded, truth_plant, ("coupling.force_2x",), 8, accuracy=2e-7)
    found = diagnose(machine, records, effects=EFFECTS, models=models)
    assert found.status == "named" and [f.form for f in found.effects] == ["coupling.force_2x"]
    assert {"fit_1", "coast, fit"} <= {flag.record for flag in found.localisation}
