"""Rules edited after a run of a study: the report states which, from what to what."""

import json

import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from studies.thesis.claims.edited import KEPT, edited, edited_block, edited_markdown, judging


def test_the_first_run_keeps_the_rules_and_the_same_rules_say_nothing(tmp_path):
    assert edited(tmp_path) == []
    assert edited(tmp_path) == []
    assert json.loads((tmp_path / KEPT).read_text()) == judging()
    assert edited_block([]) == []
    assert edited_markdown([]) == ""


def test_an_interval_a_point_and_a_figure_that_changed_are_stated_old_and_new(tmp_path):
    edited(tmp_path)
    now = judging()
    now["I2.identification_x"] = now["I2.identification_x"] | {"met": "[0.0, 100.0]"}
    now["points.rest"] = [[0.0, 0.5]]
    now["I2.new"] = now.pop("I2.validation_y")
    sentences = edited(tmp_path, now)
    assert [one.split(":")[0] for one in sentences] == [
        "I2.identification_x",
        "I2.new",
        "I2.validation_y",
        "points.rest",
    ]
    assert "met [86.1, 91.5]" in sentences[0] and "[0.0, 100.0]" in sentences[0]
    assert "not there at the first run" in sentences[1]
    assert sentences[2].endswith("not there now")
    assert "[[0.0, 0.3]] at the first run, [[0.0, 0.5]] now" in sentences[3]
    (block,) = edited_block(sentences)
    assert len(block.rows) == 4
    assert all(one in edited_markdown(sentences) for one in sentences)
    assert edited(tmp_path, now) == sentences  # the first run's stay


@pytest.mark.parametrize("name", ["report.html", "study.json", "control.json", "claims.md"])
def test_rules_that_were_deleted_after_a_report_are_missed_in_every_later_run(tmp_path, name):
    edited(tmp_path)
    (tmp_path / name).write_text("judged")
    (tmp_path / KEPT).unlink()
    (sentence,) = edited(tmp_path)
    assert sentence.startswith(f"rules.json: was not there, though {name} of an earlier run was")
    assert edited(tmp_path) == [sentence]
    now = judging() | {"points.rest": [[0.0, 0.5]]}
    assert [one.split(":")[0] for one in edited(tmp_path, now)] == ["rules.json", "points.rest"]
    assert sentence in edited_markdown([sentence]) and len(edited_block([sentence])) == 1


def test_a_first_run_that_was_stopped_before_its_report_has_lost_no_rules(tmp_path):
    (tmp_path / "stages").mkdir()
    assert edited(tmp_path) == []


@pytest.mark.parametrize("text", ['{"points', "[1, 2]"])
def test_a_damaged_file_is_refused(tmp_path, text):
    (tmp_path / KEPT).write_text(text)
    with refused(DataError, "folder", tmp_path / KEPT):
        edited(tmp_path)


def test_every_part_of_the_rules_that_judges_is_kept():
    kept = judging()
    assert {"thesis", "met", "near"} <= set(kept["I2.validation_x"])
    assert kept["C6.gamma"]["kind"] == "not comparable"
    assert "points.centres" in kept
