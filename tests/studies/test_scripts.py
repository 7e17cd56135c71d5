"""Scripts of the studies: each shows its help without what it compares with, and refuses bad input in a sentence."""

import runpy
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[2] / "studies"
SCRIPTS = {path.stem: path for path in sorted(STUDIES.rglob("*.py")) if "__main__" in path.read_text(encoding="utf-8")}
COMMANDS = {name for name, path in SCRIPTS.items() if "single(" in path.read_text(encoding="utf-8")}
"""Scripts with the frame of rotorsim's own commands, which tests of these cover."""


@pytest.fixture
def script(monkeypatch, capsys):
    """A function that runs a script with arguments, without ROSS; exit code, standard output and error."""

    def run(name, *arguments):
        monkeypatch.setattr(sys, "argv", [str(SCRIPTS[name]), *arguments])
        monkeypatch.setitem(sys.modules, "ross", None)
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(SCRIPTS[name]), run_name="__main__")
        return ended.value.code or 0, *capsys.readouterr()

    return run


@pytest.mark.parametrize("name", sorted(SCRIPTS.keys() - COMMANDS))
def test_a_script_shows_its_help(script, name):
    code, out, _ = script(name, "--help")
    assert code == 0 and out.startswith("usage: ")


def test_the_scripts_are_there():
    assert len(SCRIPTS) > 10 and {"whole", "one_number", "designs", "measure"} == COMMANDS


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("compare_ross", ()),
        ("ross_records", ("out",)),
        ("ross_records", ("out", "no_such_case")),
        ("diagnose_ross", ("no_such_folder",)),
        ("diagnose_foreign", ("no_such_case",)),
        ("diagnose_lab_formats", ("x",)),
    ],
)
def test_a_script_refuses_bad_input_and_a_missing_package_in_a_sentence(script, tmp_path, monkeypatch, name, arguments):
    monkeypatch.chdir(tmp_path)
    code, out, err = script(name, *arguments)
    assert code == 2 and not out and "Traceback" not in err and not list(tmp_path.iterdir())
