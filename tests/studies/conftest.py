"""Fixtures of the studies: a study's command in this process, the identified model of the shipped rig."""

from pathlib import Path

import pytest

import identification as idn
from rotorsim.cli import main
from rotorsim.commands.registry import single


@pytest.fixture(scope="session")
def model():
    """LPV model over 0 to 6 krpm, 0.3 to 0.7 MPa."""
    return idn.load_model(Path(__file__).parents[1] / "control" / "rig_model.json")


@pytest.fixture
def run(monkeypatch, tmp_path, capsys):
    """Run a command of a study in an empty folder and a wide window: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def call(command, *arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(a) for a in arguments], app=single(command))
        return int(caught.value.code or 0), *capsys.readouterr()

    return call
