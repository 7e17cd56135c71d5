"""Records that state what was changed on purpose: trial weights and parameters of effects."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from identification.records.mapping import parse
from rotorsim.base.errors import DataError, ReadError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import FitParameter, contributions, setting
from rotorsim.discrepancy.changes import known_changes
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import draw, record_of
from rotorsim.machine import load_machine

WEIGHT = {"me": 3e-5, "phase": math.radians(70)}
STATED = json.dumps({"trial_weight": [WEIGHT]})
KEY = "unbalance.0.me~phase"
KEPT = ("fit_1", "fit_2", "fit_3", "fit_5", "fit_2_repeat", "held_out_1", "held_out_2", "untouched_2", "untouched_4")


@pytest.fixture(scope="module")
def plain():
    return load_machine("plain_rotor")


def test_a_trial_weight_adds_to_the_unbalance_as_a_vector(plain):
    found = known_changes(plain, STATED, "run")
    assert complex(found[f"{KEY}.c"], found[f"{KEY}.s"]) == pytest.approx(3e-5 * np.exp(1j * WEIGHT["phase"]))


def test_two_weights_and_a_new_unbalance_add_up(plain):
    table = {"trial_weight": [WEIGHT, WEIGHT], "effects.unbalance.me": "0 g*mm"}
    found = known_changes(plain, json.dumps(table), "run")
    own = plain.effects["unbalance"][0]
    expected = 6e-5 * np.exp(1j * WEIGHT["phase"]) - own.me * np.exp(1j * own.phase)
    assert complex(found[f"{KEY}.c"], found[f"{KEY}.s"]) == pytest.approx(expected)


def test_a_record_that_states_nothing_changes_nothing(plain):
    assert known_changes(plain, None, "run") == known_changes(plain, "", "run") == {}


def test_the_mapping_takes_units():
    found = parse({"changes": {"trial_weight": {"me": "30 g*mm", "phase": "70 deg"}}})
    weight = json.loads(found.conditions["changes"])["trial_weight"][0]
    assert weight["me"] == pytest.approx(3e-5) and weight["phase"] == pytest.approx(WEIGHT["phase"])


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"trial_weight": 3}, "trial_weight: 3; write"),
        ({"trial_weight": {"me": "3 mm"}}, "not a known unit of mass"),
        ({"trial_weight": {"me": "3 g*mm", "radius": "30 mm"}}, "radius: is not known"),
        ({"effects": {"unbalance": 3}}, "quote the path"),
    ],
)
def test_mistakes_in_the_mapping_end_in_a_sentence(table, sentence):
    with pytest.raises(ReadError, match=sentence):
        parse({"changes": table})


@pytest.mark.parametrize(
    ("stated", "sentence"),
    [
        ("{", "is not JSON"),
        ("[1]", "is not a table"),
        ('{"trial_weight": ["heavy"]}', "give me, phase"),
        ('{"trial_weight": [{"me": 1e-5, "position": 0.123}]}', r"at 123 mm, where the machine file has no"),
        ('{"shaft.damping_ratio": 0.1}', "may differ from record to record"),
        ('{"effects.coupling.force_2x": "3 N"}', "may differ from record to record"),
        ('{"effects.unbalance.mass": "3 g"}', "mass"),
    ],
)
def test_a_change_that_no_record_can_have_ends_in_a_sentence(plain, stated, sentence):
    with pytest.raises(DataError, match=f"^run: .*{sentence}"):
        known_changes(plain, stated, "run")


@pytest.mark.slow
def test_the_response_with_a_stated_weight_is_that_of_the_machine_with_the_weight(machine, models):
    twin = models.twin
    rows = np.tile([200.0, 0, 0, 0, 0, 0], (400, 1))
    known = setting(twin, contributions({}, 200.0, 0.0, known_changes(machine, STATED, "run")))
    own = machine.effects["unbalance"][0]
    total = own.me * np.exp(1j * own.phase) + 3e-5 * np.exp(1j * WEIGHT["phase"])
    direct = {"unbalance.0.me": abs(total), "unbalance.0.phase": float(np.angle(total))}
    np.testing.assert_allclose(twin.run(known, rows, 0.0), twin.run(direct, rows, 0.0), atol=1e-15)


@pytest.mark.slow
def test_records_with_a_stated_trial_weight_are_no_disagreement(machine, models, truth_plant):
    truth = draw(truth_plant, (), 3, (3.0, 6.0))
    weight = [FitParameter(f"{KEY}.{part}", 1e-9) for part in "cs"]
    vector = 3e-5 * np.array([np.cos(WEIGHT["phase"]), np.sin(WEIGHT["phase"])])
    records = []
    kept = [p for p in campaign(machine) if p.name in KEPT]
    for i, planned in enumerate(kept):
        planned = replace(planned, experiment=replace(planned.experiment, hits=1))
        there = planned.name in ("fit_2", "fit_2_repeat", "held_out_1", "untouched_2")
        record = record_of(truth_plant, planned, truth.point.moved(weight, vector) if there else truth.point, 3)
        noise = np.random.default_rng([3, i]).normal(0, 1e-7, record.disc_measured.shape)
        record["disc_measured"] = record.disc_measured.copy(data=record.disc_measured.values + noise)
        records.append(record.assign_attrs(changes=STATED) if there else record)
    found = diagnose(machine, records, models=models)
    assert found.status == "no_disagreement"
    assert any("changed on purpose" in note and "fit_2" in note for note in found.notes)
    silent = diagnose(machine, [r.assign_attrs(changes="") for r in records], models=models)
    assert silent.status != "no_disagreement"
