"""Lists of commands, help and refusals of a machine file: complete, and without the packages that compute."""

import subprocess
import sys

import pytest
import typer

from fault_injection.commands import leaves
from rotorsim.cli import main
from rotorsim.commands.registry import COMMANDS, GROUPS, PANELS, app
from rotorsim.machine import machine_text

HEAVY = ("numba", "scipy", "xarray", "plotly", "pandas", "dask", "control", "pyvista", "nicegui", "fmpy")
"""Packages that compute, draw or serve."""
LEAVES = [" ".join(words) for words, _ in leaves(typer.main.get_command(app))]
PROGRAM = f"""import sys
from contextlib import redirect_stdout, redirect_stderr
from io import StringIO
from rotorsim.cli import command
for line in sys.argv[1:]:
    with redirect_stdout(StringIO()) as text, redirect_stderr(text):
        try:
            command(line.split(","))
        except SystemExit as ended:
            code = ended.code or 0
    loaded = sorted(set({HEAVY!r}) & set(sys.modules))
    print(code, line, *loaded, sep="|")
    print(text.getvalue() if code not in (0, 2) else "", end="")
    sys.exit(1) if loaded else None
"""


def ran(*lines):
    """Run commands one after the other in one process up to the first that loads a heavy package; code and line."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, *lines], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout.splitlines()[-1:] + done.stderr.splitlines()[-3:]
    return [tuple(line.split("|")) for line in done.stdout.splitlines()]


def test_every_command_stands_under_one_title_of_the_help():
    listed = [name for names in PANELS.values() for name in names]
    assert sorted(listed) == sorted({"runup", *COMMANDS[""], *GROUPS}) and len(set(listed)) == len(listed) > 20


def test_the_help_has_one_line_a_command_and_two_examples(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as end:
        main(["-h"])
    text = capsys.readouterr().out
    assert end.value.code == 0 and text.count("Example: rotorsim ") == 2
    for title, names in PANELS.items():
        panel = text.partition(f"─ {title} ─")[2].partition("╰")[0]
        assert [line.split()[1] for line in panel.splitlines()[1:]] == list(names)


def test_every_command_has_help_an_example_and_a_python_call():
    assert len(LEAVES) > 40
    for words, command in leaves(typer.main.get_command(app)):
        assert command.help and command.python and "Example: rotorsim " in command.epilog, words


@pytest.mark.parametrize("path", ["map", "machine", "experiment impact", "campaign", "fmu export"])
def test_the_short_option_shows_the_help_of_every_command(path, capsys):
    for option in ("-h", "--help"):
        with pytest.raises(SystemExit) as end:
            main([*path.split(), option])
        assert end.value.code == 0
    short, *_, rest = capsys.readouterr().out.partition("Usage: ")[2].partition("Usage: ")
    assert short.split() == rest.split()


def test_help_of_every_command_and_group_loads_nothing_that_computes():
    groups = {words.rpartition(" ")[0] for words in LEAVES}
    lines = [",".join([*words.split(), "--help"]) for words in sorted({*LEAVES, *groups})]
    assert {code for code, *_ in ran("--version", *lines)} == {"0"} and len(lines) > 50


def test_help_of_a_command_loads_its_own_chapter_and_no_arrays():
    program = "import sys\nfrom rotorsim.cli import main\ntry: main(['campbell', '--help'])\nexcept SystemExit: pass\n"
    program += (
        "print('loaded', *(name for name in sys.modules if name == 'numpy' or name.startswith('rotorsim.commands.')))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = {name.removeprefix("rotorsim.commands.") for name in done.stdout.splitlines()[-1].split()[1:]}
    assert loaded == {"registry", "linear", "options", "results"}


def test_a_machine_file_is_refused_before_anything_that_computes_is_loaded(tmp_path):
    """Commands whose first argument is a machine: one that is no file, and one with an unknown field."""
    broken = tmp_path / "broken.toml"
    broken.write_text(machine_text("plain_rotor") + "\n[nonsense]\nsize = 1\n", encoding="utf-8")
    takers = ["runup", "map", "sweep", "response", "campbell", "modes", "live", "balance", "warm", "fmu,export",
              "machine,check", "machine,show", "experiment,prbs", "experiment,controlled", "hide", "diagnose",
              "machine,calibrate"]  # fmt: skip
    more = {"balance": ",x.csv,--mapping,x.toml", "diagnose": ",x.nc", "machine,calibrate": ",--targets,dtu_orifice"}
    lines = [f"{taker},{machine}{more.get(taker, '')}" for machine in ("nothing", broken) for taker in takers]
    found = ran(*lines)
    assert {code for code, *_ in found} == {"2"} and len(found) == len(lines)


def test_completion_lists_the_commands_without_what_computes():
    program = "import os, sys; os.environ.update(COMP_WORDS='rotorsim m', COMP_CWORD='1', _ROTORSIM_COMPLETE="
    program += "'complete_bash')\nfrom rotorsim.commands.registry import app\n"
    program += "try: app([], prog_name='rotorsim')\nexcept SystemExit: pass\n"
    program += f"print(*sorted(set({HEAVY!r}) & set(sys.modules)))"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines() == ["map", "modes", "machine", ""]


@pytest.mark.parametrize(("words", "hint"), [
    ("responses", "no command 'responses'; did you mean 'response'?"),
    ("data converts", "no command 'converts'; did you mean 'convert'?"),
    ("map plain_rotor --speeds 3", "no option --speeds; did you mean --speed? 'rotorsim map --help' lists its options"),
    ("response plain_rotor --speed 3", "no option --speed; did you mean --speeds? "),
    ("modes --zzz", "no option --zzz; 'rotorsim modes --help' lists its options"),
    ("map dtu_gas_bearng", "'dtu_gas_bearng' is neither a shipped machine nor a file; did you mean 'dtu_gas_bearing'?"),
    ("campaign check thesi", "'thesi' is neither a shipped plan nor a file; did you mean 'thesis'?"),
    ("identify nothing --model 4", "--model: '4' is not known; choose one of 1, 2, 2-rate, 3, actuator, blackbox"),
])  # fmt: skip
def test_a_misspelt_name_is_answered_with_the_nearest_in_one_sentence(capsys, words, hint):
    with pytest.raises(SystemExit) as end:
        main(words.split())
    shown = capsys.readouterr()
    assert end.value.code == 2 and shown.out == "" and hint in shown.err and shown.err.count("\n") == 1
