"""Texts of other people: nesting without bound, names that a terminal would obey, characters that no encoding takes."""

import json
import os
import subprocess
import sys
import tomllib

import pytest

import rotorsim as rs
from rotorsim.analysis.targets import read_targets
from rotorsim.base.cache import ROOT
from rotorsim.base.display import visible
from rotorsim.base.errors import RotorsimError
from rotorsim.base.input_files import parse_json, parse_toml
from rotorsim.commands.options import Console
from rotorsim.discrepancy.hidden_machine import read_truth

DEEP = {
    "lists": "[" * 100_000 + "]" * 100_000,
    "tables": '{"a":' * 100_000 + "1" + "}" * 100_000,
    "a thousand": '{"kind": "law", "A": ' + "[" * 900 + "]" * 900 + "}",
}


@pytest.mark.parametrize("deep", DEEP)
def test_json_that_is_nested_deeply_is_an_error_of_json(deep):
    with pytest.raises(json.JSONDecodeError):
        parse_json(DEEP[deep])


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000 + "]" * 5000, "a = " + "[" * 300 + "]" * 300, ("a." * 2000) + "b = 1"]
)
def test_toml_that_is_nested_deeply_is_an_error_of_toml(text):
    with pytest.raises(tomllib.TOMLDecodeError):
        parse_toml(text)


def test_what_is_nested_as_files_are_is_read_as_before():
    value = {"a": [[1.5, None], {"b": [True, "x"]}] * 3}
    assert parse_json(json.dumps(value)) == value
    assert parse_toml("[a.b]\nc = [[1, 2], [3]]") == {"a": {"b": {"c": [[1, 2], [3]]}}}


READERS = {
    "law.json": rs.load_law,
    "model.json": rs.load_model,
    "scene.json": rs.live.load_scene,
    "truth.json": read_truth,
    "machine.toml": rs.load_machine,
    "plan.toml": rs.campaign.load_plan,
    "targets.toml": read_targets,
    "mapping.toml": rs.identification.load_mapping,
}


@pytest.mark.parametrize("deep", DEEP)
@pytest.mark.parametrize("name", READERS)
def test_every_reader_refuses_deep_nesting_in_a_sentence(name, deep, tmp_path):
    path = tmp_path / name
    path.write_text(DEEP[deep] if name.endswith("json") else f"a = {DEEP['lists']}")
    with pytest.raises(RotorsimError) as caught:
        READERS[name](path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


HOSTILE = "a\x1b[31m\x1b]0;title\x07\x9b2Jb\rc\x7f\u202etxt\u2028"


def test_no_character_that_a_terminal_obeys_is_left():
    shown = visible(HOSTILE + "ü µm Ω\n\t√")
    assert shown.isprintable() is False and all(one.isprintable() or one in "\n\t" for one in shown)
    assert shown.endswith("ü µm Ω\n\t√") and r"\x1b[31m" in shown and visible(shown) == shown


def printed(code, **environment):
    """Bytes of standard output and error of code in a process whose streams are those of the command line."""
    code = f"import sys\nfrom rotorsim.cli import _careful_streams\n_careful_streams()\nhostile = {HOSTILE!r}\n{code}"
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout + done.stderr


TABLE = """
from rich.table import Table
from rotorsim.commands.options import Console
table = Table(title=hostile)
table.add_column(hostile)
table.add_row(hostile)
console = Console(force_terminal=True, color_system=None)
console.print(table)
console.print(hostile, "[/nothing] begun")
"""


PRINTING = (
    "print(hostile)",
    "print(hostile, file=sys.stderr)",
    "import typer; typer.echo(hostile); typer.echo(hostile, err=True)",
    "sys.stdout.writelines([hostile])",
    TABLE,
)


@pytest.mark.parametrize("code", PRINTING)
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_nothing_that_is_printed_is_obeyed(code, encoding):
    found = printed(code, PYTHONIOENCODING=encoding)
    assert b"a" in found and not set(found) & ({*range(32), 127} - set(b"\n\t"))


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_a_character_that_the_encoding_lacks_is_replaced(encoding):
    text = printed("import typer; print('5 µm √ \\udcff'); typer.echo('Ω √')", PYTHONIOENCODING=encoding)
    assert text.startswith(b"5 ") and text.count(b"\n") == 2


def test_markup_in_a_name_is_text():
    console = Console(width=60)
    with console.capture() as captured:
        console.print("[/x] and [link=", "rotor[0]", "add [effects.slip]")
    assert "add [effects.slip]" in captured.get()
    assert "[/x] and [link=" in captured.get() and "rotor[0]" in captured.get()


@pytest.mark.parametrize("error", [MemoryError(), RecursionError(), UnicodeEncodeError("utf-8", "\udcff", 0, 1, "")])
def test_a_limit_of_python_ends_a_command_in_one_sentence(error, monkeypatch, capsys):
    from rotorsim import cli

    def too_much(*arguments, **options):
        raise error

    monkeypatch.setattr("rotorsim.commands.registry.app", too_much)
    with pytest.raises(SystemExit) as ended:
        cli.command(["map"])
    assert ended.value.code == 2 and capsys.readouterr().err.count("\n") == 1
