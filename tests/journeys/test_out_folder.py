"""Where results go: a folder, fresh or the user's, and never over other results by chance."""

import pytest
import typer

from rotorsim.commands.options import results_folder, told_as_kept
from rotorsim.errors import DataError

MODEL_FREE = [
    ("runup", "plain_rotor"), ("experiment", "steady", "plain_rotor"), ("map", "plain_rotor"), ("modes", "plain_rotor"),
    ("hide", "plain_rotor"), ("diagnose", "plain_rotor", "x.nc"), ("verify", "law.json"), ("study", "whole"),
    ("study", "control", "model.json"), ("study", "identification-vs-physics"),
]  # fmt: skip


@pytest.mark.parametrize("command", MODEL_FREE, ids=" ".join)
def test_a_file_is_no_folder(run, tmp_path, command):
    file = tmp_path / "file"
    file.write_text("kept")
    assert run(*command, "--out", file) == (2, "", f"--out: {file} is a file; name a folder\n")
    assert file.read_text() == "kept"


def test_results_go_to_a_fresh_folder_and_replace_others_by_force_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "verification"
    assert results_folder(None, "verification", "table.json", False).name == "verification"
    own.mkdir()
    assert results_folder(None, "verification", "table.json", False).name == "verification-2"
    assert results_folder(own, "verification", "table.json", False) == own
    (own / "table.json").touch()
    assert results_folder(own, "verification", "table.json", True) == own
    with pytest.raises(DataError, match="add --force"):
        results_folder(own, "verification", "table.json", False)


def test_ctrl_c_during_a_report_names_the_record(capsys):
    with pytest.raises(typer.Exit) as ended, told_as_kept("runup/runup.nc"):
        raise KeyboardInterrupt
    assert ended.value.exit_code == 130
    assert "the record is kept, without its results: runup/runup.nc" in capsys.readouterr().err
