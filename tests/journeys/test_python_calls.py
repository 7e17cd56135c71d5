"""Each command names the Python call that does the same; it exists, and the docs list it, or an experiment's help."""

import ast
from inspect import signature
from pathlib import Path
from shlex import split

import pytest
import typer

import rotorsim as rs
from fault_injection.commands import leaves
from rotorsim.commands.experiment import ClosedLoopSetup
from rotorsim.commands.registry import app

PAGE = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
CALLS = {" ".join(words): command.python for words, command in leaves(typer.main.get_command(app))}
EXPERIMENTS = {command: call for command, call in CALLS.items() if command.startswith("experiment ")}


def called(text):
    """Dotted names of the functions that an expression calls; not the methods of what they return."""
    names = [ast.unparse(node.func) for node in ast.walk(ast.parse(text, mode="eval")) if isinstance(node, ast.Call)]
    return [name for name in names if "(" not in name]


@pytest.mark.parametrize("command", CALLS)
def test_the_call_of_a_command_exists_and_is_documented(command):
    names = [name for name in called(CALLS[command]) if name.startswith("rs.")]
    assert names
    for name in names:
        value = rs
        for part in name.split(".")[1:]:
            assert part in dir(value), name
            value = getattr(value, part)
        assert callable(value) and value.__doc__, name


@pytest.mark.parametrize("command", sorted(CALLS.keys() - EXPERIMENTS.keys()))
def test_the_docs_list_the_call_of_a_command(command):
    assert f"| `rotorsim {command}` | `{CALLS[command]}` |" in PAGE


@pytest.mark.parametrize("command", EXPERIMENTS)
def test_the_call_of_an_experiment_takes_the_values_of_its_example(command):
    """The call binds to the function, and has every value of the command's example in SI."""
    name = command.split()[1]
    call = ast.parse(EXPERIMENTS[command], mode="eval").body
    given = {word.arg: ast.unparse(word.value) for word in call.keywords}
    bound = signature(getattr(rs.experiments, name)).bind(*call.args, **given)
    assert {"plant", *given} <= set(bound.arguments)
    if name == "controlled":
        return
    kind = rs.experiments.EXPERIMENTS[name]
    words = split(kind.example)
    texts = {
        word[2:].replace("-", "_"): text for word, text in zip(words[::2], words[1::2], strict=True) if word != "--seed"
    }
    made = kind(**{key: ast.literal_eval(value) for key, value in given.items() if key != "seed"})
    for (key, value), wanted in zip(vars(kind(**texts)).items(), vars(made).values(), strict=True):
        assert value == (pytest.approx(wanted, rel=1e-5) if isinstance(wanted, float) else wanted), key


def test_the_call_of_the_closed_loop_is_that_of_its_example():
    """The built-in law about the equilibrium, with the hits of the command."""
    law = rs.experiments.ProportionalLaw()
    setup = ClosedLoopSetup(pressure=0.6e6, gain_x=0.25e6, gain_y=0.22e6, hit=20.0, duration=2.0)
    assert setup.excitations() == (rs.experiments.Impact(peak=20.0, hits=2),)
    assert (law.gain_x, law.gain_y) == (0.25e6, 0.22e6)
