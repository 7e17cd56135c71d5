"""Commands and options named in messages, docstrings and docs: all exist."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest
import typer

from rotorsim.cli import main
from rotorsim.commands.registry import click_command
from studies.benchmarks.command import bench
from studies.thesis.commands import designs, one_number, whole

ROOT = Path(__file__).parents[2]
ROOMS = ("rotorsim", "fmu", "identification", "reynolds", "fe_shaft")
OWN = {
    "fmu": ["fmu"],
    "rotorsim/live": ["live", "design"],
    "rotorsim/campaign": ["campaign"],
    "rotorsim/discrepancy": ["diagnose", "hide"],
    "rotorsim/verify": ["verify"],
}
"""Rooms whose messages are shown by these commands alone."""
NOT_COMMANDS = ("simulates", "scene", "source", "record", "apart", "worker")
"""Words after the name in prose, in marks of files and in names of threads."""
COMMAND = re.compile(r"(?:['`(]|^ *|Example: |\n *)rotorsim ([a-z][^'`)\n#]*(?:'[^'\n]*'[^'`)\n#]*)*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


@cache
def root():
    """Return the command line."""
    from rotorsim.commands.registry import app

    return typer.main.get_command(app)


def below(command, words):
    """Return the command that words lead to, and the words left."""
    while words and words[0] in group(command):
        command, words = command.get_command(None, words[0]), words[1:]
    return command, words


def group(command):
    """Return the names of the commands below a command."""
    return command.list_commands(None) if hasattr(command, "list_commands") else []


@cache
def options(*path):
    """Return the options of a command, of all below it where it is a group, and those that go anywhere."""
    command, left = below(root(), path)
    assert not left, path
    found = names(command) | names(root()) | {"--help"}
    for name in group(command):
        found |= options(*path, name)
    return found


def names(command):
    """Return the names of a command's own options."""
    return {name for p in command.params for name in (*p.opts, *p.secondary_opts) if name.startswith("--")}


@cache
def of_studies():
    """Return the options of the studies' scripts, which pages name too."""
    return set().union(*(names(click_command("study", one)) for one in (bench, designs, one_number, whole)))


@cache
def made_in(module):
    """Return the options of the commands that a module of commands makes, of all where it makes none."""
    found = set()
    for path, command in leaves(root(), ()):
        if command.callback is not None and command.callback.__module__ == module:
            found |= options(*path)
    return found or options()


def leaves(command, path):
    """Yield the path and the command of every command that is not a group."""
    for name in group(command):
        yield from leaves(command.get_command(None, name), (*path, name))
    if not group(command):
        yield path, command


@cache
def texts():
    """Return the place and the text of every string of the program and every line of the docs that matter."""
    return [found for found in every_text() if "rotorsim " in found[2] or "--" in found[2]]


def every_text():
    """Yield the place and the text of every string of the program and every line of the docs."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.JoinedStr):
                    parts = [v.value if isinstance(v, ast.Constant) else "X" for v in node.values]
                    yield path, node.lineno, "".join(parts)
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield path, node.lineno, node.value
        for path in (p for kind in ("html", "js", "toml") for p in sorted((ROOT / room).rglob(f"*.{kind}"))):
            yield from ((path, k, line) for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1))
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        yield from ((path, k, line) for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1))


def unknown_commands(text):
    """Yield what is wrong with the commands that a text names."""
    for words in COMMAND.findall(text):
        named = [w.rstrip(",;:.") for w in words.split() if w not in ("|", "...")]
        command, left = below(root(), named)
        if "run" in group(command) and left:  # the first word may be a plan
            named[len(named) - len(left) :] = ["run", *left]
            command, left = below(command, ["run", *left])
        place = "rotorsim " + words
        if command is root():
            if named[0] not in NOT_COMMANDS:
                yield f"{place}: there is no such command"
        elif group(command) and left and re.fullmatch(r"[a-z][a-z_-]+", left[0]):
            yield f"{place}: there is no such command in this group"
        else:
            known = options(*named[: len(named) - len(left)])
            yield from (f"{place}: has no {name}" for name in OPTION.findall(words) if name not in known)


def unknown_options(path, text):
    """Yield the options that a text names and the commands that can show it do not have."""
    if (
        text.startswith("-Wl") or "dask " in text or "pip install --" in text or path.suffix not in (".py", ".md")
    ):  # of other programs
        return
    room = next((own for folder, own in OWN.items() if (ROOT / folder) in path.parents), [])
    known = set().union(*map(options, room)) or options()
    if path.suffix == ".md":
        known |= of_studies()
    if ROOT / "rotorsim" / "commands" in path.parents:
        known = made_in(".".join(path.relative_to(ROOT).with_suffix("").parts))
    yield from (f"{name} is not an option" for name in OPTION.findall(text) if name not in known)


def test_every_command_that_is_named_is_there():
    wrong = [f"{p.relative_to(ROOT)}:{n}: {fault}" for p, n, text in texts() for fault in unknown_commands(text)]
    assert wrong == []


def test_every_option_that_is_named_is_there():
    wrong = [f"{p.relative_to(ROOT)}:{n}: {fault}" for p, n, text in texts() for fault in unknown_options(p, text)]
    assert wrong == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("give an LPV model (rotorsim identify --lpv)", "has no --lpv"),
        ("try 'rotorsim dream --out x'", "there is no such command"),
        ("see `rotorsim experiment prbz`", "there is no such command in this group"),
        ("    rotorsim fmu export --fmi 2 --speed '3000 rpm'", None),
        ("'rotorsim experiment prbs --amplitude 2'", None),
        ("'rotorsim experiment prbs --peak 2'", "has no --peak"),
    ],
)
def test_a_command_that_is_not_there_is_found(text, fault):
    found = list(unknown_commands(text))
    assert not found if fault is None else len(found) == 1 and fault in found[0]


def test_an_option_that_is_not_there_is_found():
    assert list(unknown_options(ROOT / "fmu" / "a.py", "give --lpv")) == ["--lpv is not an option"]
    assert list(unknown_options(ROOT / "rotorsim" / "live" / "a.py", "give --fmi")) == ["--fmi is not an option"]
    modes = ROOT / "rotorsim" / "commands" / "linear.py"
    assert list(unknown_options(modes, "give --fmi")) == ["--fmi is not an option"]
    assert not list(unknown_options(ROOT / "fmu" / "a.py", "give --fmi"))


def test_a_model_of_one_point_is_refused_with_the_command_that_writes_an_lpv_model(tmp_path, capsys):
    file = Path(__file__).parents[1] / "control" / "rig_model.json"
    from identification.lpv_model import load_model

    load_model(file).at(300.0, 5e5).save(tmp_path / "one.json")
    with pytest.raises(SystemExit) as refused:
        main(["fmu", "export", "--model", str(tmp_path / "one.json"), "--out", str(tmp_path / "u.fmu")])
    message = capsys.readouterr().err.strip()
    assert refused.value.code == 2 and "'rotorsim identify' writes" in message and not list(unknown_commands(message))
