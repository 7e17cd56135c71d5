"""Output folders: new or existing, locked by one process, no files overwritten without --force."""

import subprocess
import sys
from pathlib import Path

import pytest
import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.options import reporting_kept_samples
from rotorsim.commands.results import files, results
from rotorsim.control.designs import p

ROTOR = "plain_rotor"
FOLDERS = {
    ("runup", ROTOR): ("runup.nc", "report.html"),
    ("experiment", "steady", ROTOR): ("steady.nc", "steady.html"),
    ("map", ROTOR): ("map.nc", "report.html"),
    ("modes", ROTOR, "--count", "2"): ("modes.nc", "mode_1.png", "mode_2.png"),
    ("diagnose", ROTOR, "x.nc"): ("diagnosis.json", "gap.nc", "machine.toml", "machine.diff", "report.html"),
    ("verify", "law.json"): ("table.json", "report.html"),
}
"""Commands and what they write into --out."""
FILES = {
    ("design", "p", "model.json", "--report"): ("out.json", "out.html"),
    ("identify", "x.nc"): ("out.json",),
    ("machine", "calibrate", ROTOR, "--targets", "dtu_orifice"): ("out.json",),
    ("fmu", "export", ROTOR): ("out.json.fmu",),
    ("fmu", "export", ROTOR, "--fmi", "2,3"): ("out.json_fmi2.fmu", "out.json_fmi3.fmu"),
    ("fmu", "system", "law.json"): ("out.json",),
}
"""Commands and what they write for `--out out.json`; a unit's name ends in .fmu."""
STUDIES = [("study", "identification-vs-physics")]


def cases(table):
    """Command and one of its files."""
    return [pytest.param(c, name, id=f"{' '.join(c[:2])} {name}") for c, names in table.items() for name in names]


@pytest.mark.parametrize("command", [*FOLDERS, ("hide", ROTOR), *STUDIES], ids=" ".join)
def test_a_file_is_no_folder(run, tmp_path, command):
    file = tmp_path / "file"
    file.write_text("kept")
    assert run(*command, "--out", file) == (2, "", f"--out: {file} is a file; name a folder\n")
    assert file.read_text() == "kept"


@pytest.mark.parametrize("command", [*FOLDERS, ("hide", ROTOR), *STUDIES], ids=" ".join)
@pytest.mark.parametrize("name", ["page.html", "numbers.csv"])
def test_a_folder_has_no_name_of_a_file(run, tmp_path, command, name):
    code, out, words = run(*command, "--out", name)
    assert (code, out) == (2, "") and words.startswith("--out: ") and f"'{name}'" in words
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("command", "name"), cases(FOLDERS))
def test_a_command_names_the_file_that_it_would_replace_and_computes_nothing(run, tmp_path, command, name):
    p.make(p.Spec()).save(tmp_path / "law.json")
    mine = tmp_path / "d" / name
    mine.parent.mkdir()
    mine.write_text("mine")
    assert run(*command, "--out", "d") == (2, "", f"d/{name}: is there already; choose another --out or add --force\n")
    assert mine.read_text() == "mine" and list(mine.parent.iterdir()) == [mine]


@pytest.mark.parametrize(("command", "name"), cases(FILES))
def test_a_file_is_not_replaced_without_force(run, tmp_path, command, name):
    mine = tmp_path / name
    mine.write_text("mine")
    refused = (2, "", f"{name}: is there already; choose another --out or add --force\n")
    assert run(*command, "--out", "out.json") == refused
    assert mine.read_text() == "mine" and list(tmp_path.iterdir()) == [mine]


def test_hidden_records_are_never_replaced(run, tmp_path):
    (tmp_path / "hidden" / "records").mkdir(parents=True)
    refused = (2, "", "hidden/records: is there already; choose another --out\n")
    assert run("hide", ROTOR) == refused


@pytest.mark.parametrize("command", [*FOLDERS, *STUDIES], ids=" ".join)
def test_the_folder_of_a_campaign_takes_nothing_else(run, tmp_path, command):
    p.make(p.Spec()).save(tmp_path / "law.json")
    (tmp_path / "camp").mkdir()
    (tmp_path / "camp" / "store.json").write_text("{}")
    assert run(*command, "--out", "camp") == (2, "", "--out: camp holds a campaign; name another folder\n")


def test_a_map_and_a_run_up_do_not_share_a_report(run, tmp_path):
    """Both write a report.html."""
    assert run("map", ROTOR, "--speed", "0 rpm:100 rpm:2", "--pressure", "0.3 MPa", "--out", "d")[0] == 0
    page = (tmp_path / "d" / "report.html").read_bytes()
    code, _, err = run("runup", ROTOR, "--stop", "60 rpm", "--rate", "600 rpm/s", "--out", "d")
    assert (code, err) == (2, "d/report.html: is there already; choose another --out or add --force\n")
    assert (tmp_path / "d" / "report.html").read_bytes() == page and not (tmp_path / "d" / "runup.nc").exists()


def test_several_files_are_named_in_one_sentence(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).touch()
    with pytest.raises(
        DataError, match=f"^{tmp_path}: a and b are there already; choose another --out or add --force$"
    ):
        files(tmp_path / "a", tmp_path / "b").__enter__()


@pytest.mark.parametrize("force", [False, True])
def test_a_folder_is_not_taken_for_a_file(tmp_path, force):
    with pytest.raises(DataError, match="is a folder; choose another --out"):
        files(tmp_path, force=force).__enter__()


def test_results_go_to_a_fresh_folder_which_goes_away_if_it_stays_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with results(None, "map", ("map.nc",)) as first, results(None, "map", ("map.nc",)) as second:
        assert (first.name, second.name) == ("map", "map-2")
        (first / "map.nc").touch()
    with results(tmp_path / "new" / "below", "map", ("map.nc",)):
        pass
    with results(None, "map", ("map.nc",), force=True) as replaced:
        assert replaced.name == "map"
    assert [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")] == ["map", "map/map.nc"]


def test_a_file_that_is_being_written_is_refused_to_others_force_or_not(tmp_path):
    path = tmp_path / "runup.nc"
    with files(path), pytest.raises(DataError, match=r"runup.nc: process \d+ on .* is writing it; wait for its end"):
        files(path, force=True).__enter__()
    with files(path):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal of POSIX")
def test_a_killed_process_lets_go_of_its_files(tmp_path):
    path = tmp_path / "runup.nc"
    program = "import os, sys; from pathlib import Path; from rotorsim.commands.results import files\n"
    program += "with files(Path(sys.argv[1])): os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", program, path])
    assert [left.name for left in tmp_path.iterdir()] == [".runup.nc.lock"]
    with files(path):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal of POSIX")
def test_the_next_command_removes_what_a_killed_one_left_whatever_it_writes_itself(tmp_path):
    program = "import os, sys; from pathlib import Path; from rotorsim.base.files import replacing\n"
    program += "from rotorsim.commands.results import files; path = Path(sys.argv[1])\n"
    program += "with files(path), replacing(path) as part: part.touch(); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", program, tmp_path / "report.html"])
    assert len(list(tmp_path.iterdir())) == 2
    others = tmp_path / ".tool.lock"
    others.write_text("of another program")
    with files(tmp_path / "model.json"):
        pass
    assert list(tmp_path.iterdir()) == [others]


def test_ctrl_c_during_a_report_names_the_record(capsys):
    with pytest.raises(typer.Exit) as ended, reporting_kept_samples("runup/runup.nc"):
        raise KeyboardInterrupt
    assert ended.value.exit_code == 130
    assert "the record is kept, without its results: runup/runup.nc" in capsys.readouterr().err


def test_a_report_of_another_command_that_is_replaced_is_named(run, tmp_path):
    assert run("map", "plain_rotor", "--speed", "0 rpm, 600 rpm", "--pressure", "0 Pa", "--out", "o")[0] == 0
    short = ["runup", "plain_rotor", "--stop", "60 rpm", "--rate", "600 rpm/s", "--out", "o", "--force"]
    code, _, err = run(*short)
    sentence = f"{Path('o') / 'report.html'}: replaced that of another command, 'plain_rotor: operating map'"
    assert code == 0 and sentence in err.splitlines()
    code, _, err = run(*short)
    assert code == 0 and "replaced" not in err
