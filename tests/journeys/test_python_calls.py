"""Each command names the Python call that does the same; the call exists and the table in the docs lists it."""

import ast
from pathlib import Path

import pytest
import typer

import rotorsim as rs
from fault_injection.commands import leaves
from rotorsim.commands.app import app

PAGE = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
CALLS = {" ".join(words): command.python for words, command in leaves(typer.main.get_command(app))}


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


@pytest.mark.parametrize("command", CALLS)
def test_the_docs_list_the_call_of_a_command(command):
    assert f"| `rotorsim {command}` | `{CALLS[command]}` |" in PAGE
