"""Commands are imported when they run; lists of commands show their docstrings without importing them."""

import subprocess
import sys

import pytest
import typer

from rotorsim.commands.app import app
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
