"""Folder of a study: resumed by the same study, closed to other commands, foreign files kept."""

import json
import re

import pytest

from rotorsim.base.errors import DataError
from rotorsim.commands.results import STUDY, results, study

INPUTS = {"kind": "control", "machine": "1", "model": "2"}


def test_a_study_continues_in_its_folder(tmp_path):
    for _ in range(2):
        with study(tmp_path / "s", INPUTS):
            (tmp_path / "s" / "report.html").write_text("ours")
    assert json.loads((tmp_path / "s" / STUDY).read_text()) == INPUTS


@pytest.mark.parametrize("name", INPUTS)
def test_a_study_of_other_inputs_is_refused(tmp_path, name):
    """Its results replaced those of the study before."""
    with study(tmp_path / "s", INPUTS):
        (tmp_path / "s" / "report.html").write_text("ours")
    wrong = f"--out: {tmp_path / 's'} holds a study of another {name}; name another folder"
    with pytest.raises(DataError, match=re.escape(wrong)), study(tmp_path / "s", INPUTS | {name: "other"}):
        pass


def test_a_study_replaces_nothing_that_is_there(tmp_path):
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(DataError, match="is there already and is not a study"), study(tmp_path, INPUTS):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_a_study_that_was_begun_before_folders_were_marked_continues(tmp_path):
    (tmp_path / "stages").mkdir()
    with study(tmp_path, INPUTS):
        pass
    assert (tmp_path / STUDY).exists()


def test_nothing_else_writes_into_the_folder_of_a_study(tmp_path):
    with study(tmp_path / "s", INPUTS):
        (tmp_path / "s" / "model.json").touch()
    with pytest.raises(DataError, match="holds a study"), results(tmp_path / "s", "map", ("map.nc",)):
        pass


def test_two_processes_do_not_run_one_study(tmp_path):
    with study(tmp_path, INPUTS), pytest.raises(DataError, match="is writing it"), study(tmp_path, INPUTS):
        pass


def test_a_study_that_is_refused_later_leaves_nothing(tmp_path):
    with pytest.raises(DataError), study(tmp_path / "new" / "s", INPUTS):
        raise DataError("no actuators")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["{", "3"])
def test_a_damaged_mark_is_a_sentence(tmp_path, content):
    (tmp_path / STUDY).write_text(content)
    with pytest.raises(DataError, match="is damaged"), study(tmp_path, INPUTS):
        pass
