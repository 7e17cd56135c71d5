"""Fixture that runs a command in this process as a user would."""

import pytest

from rotorsim.cli import main


@pytest.fixture
def run(monkeypatch, tmp_path, capsys):
    """Run a command in an empty folder and a wide window: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(a) for a in arguments])
        return int(caught.value.code or 0), *capsys.readouterr()

    return call
