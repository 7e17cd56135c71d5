"""Commands are imported when they run; lists of commands show their docstrings without importing them."""

import subprocess
import sys

import pytest
import typer

from rotorsim.cli import main
from rotorsim.commands.app import GROUPS as GROUPS_OF_APP, PANELS, Commands, app
from rotorsim.commands.lazy_group import LazyGroup

HEAVY = {"numpy", "numba", "scipy", "xarray"}


def groups(group, path=()):
    """Yield the path and every group of commands below and with a group."""
    yield path, group
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        if isinstance(command, LazyGroup):
            yield from groups(command, (*path, name))


GROUPS = dict(groups(typer.main.get_command(app)))


@pytest.mark.parametrize("path", GROUPS, ids=" ".join)
def test_the_list_of_a_group_shows_the_help_of_its_commands(path):
    group = GROUPS[path]
    loaded = {name: group.get_command(None, name).help for name in group.list_commands(None)}
    with group.listed():
        assert {name: group.get_command(None, name).help for name in group.list_commands(None)} == loaded
    assert all(loaded.values())


def test_every_command_stands_under_one_title_of_the_help():
    listed = [name for names in PANELS.values() for name in names]
    assert sorted(listed) == sorted(Commands.places | GROUPS_OF_APP) and len(set(listed)) == len(listed)


def test_the_help_has_one_line_a_command_and_two_examples(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as end:
        main(["-h"])
    text = capsys.readouterr().out
    assert end.value.code == 0 and text.count("Example: rotorsim ") == 2
    for title, names in PANELS.items():
        panel = text.partition(f"─ {title} ─")[2].partition("╰")[0]
        assert [line.split()[1] for line in panel.splitlines()[1:]] == list(names)


@pytest.mark.parametrize("path", ["map", "machine", "experiment impact", "campaign", "fmu export"])
def test_the_short_option_shows_the_help_of_every_command(path, capsys):
    for option in ("-h", "--help"):
        with pytest.raises(SystemExit) as end:
            main([*path.split(), option])
        assert end.value.code == 0
    short, *_, rest = capsys.readouterr().out.partition("Usage: ")[2].partition("Usage: ")
    assert short.split() == rest.split()


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["machine", "--help"], ["study", "--help"]])
def test_lists_of_commands_import_no_command(words):
    program = "import sys; from rotorsim.commands.app import app; app(sys.argv[1:], standalone_mode=False);"
    program += f"print(*sorted({HEAVY!r} & set(sys.modules)))"
    ran = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == ""


def test_completion_lists_the_commands_without_importing_them():
    program = "import os, sys; os.environ.update(COMP_WORDS='rotorsim m', COMP_CWORD='1', _ROTORSIM_COMPLETE="
    program += "'complete_bash')\nfrom rotorsim.commands.app import app\n"
    program += "try: app([], prog_name='rotorsim')\nexcept SystemExit: pass\n"
    program += f"print(*sorted({HEAVY!r} & set(sys.modules)))"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines() == ["map", "modes", "machine", ""]
