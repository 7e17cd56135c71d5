"""Fuzz tests of the command line: a result or one sentence, never a traceback, NaN, hang or partial file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import identification as idn
from fuzzing.arguments import NOT_TIMES, calls, changes, known, wrong_calls
from fuzzing.machines import machines, texts
from fuzzing.measured import data_calls
from fuzzing.mutations import mutated
from fuzzing.outcome import check_run, checked, command, files, folder
from fuzzing.whole import whole_machines
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.units import show
from rotorsim.commands.experiment import ClosedLoopSetup, read
from rotorsim.experiments import EXPERIMENTS
from rotorsim.machine import load_machine
from rotorsim.machine.schema import Machine

FIXED = {"derandomize": True, "database": None, "suppress_health_check": list(HealthCheck)}
EXTREME = (0.0, 1.0, -1.0, 5e-324, 1e-300, 1e-9, 1e9, 1e19, 1e30, 1e154, 1e300, 1.7e308, -1e300)


def some(number):
    """Settings for so many examples, the same every time."""
    return settings(max_examples=number, **FIXED)


@pytest.fixture(scope="module")
def compiled():
    """Compile all structures before time is taken."""
    with folder():
        for name, text in texts().items():
            Path(f"{name}.toml").write_text(text, encoding="utf-8")
            point = ["--speed=100 rpm", "--pressure=0.5 MPa", "--duration=1 ms", "--no-report", f"--out={name}"]
            ended = command(["experiment", "steady", f"{name}.toml", *point], limit=600)
            assert ended.code == 0, ended.err


def check_call(arguments):
    """A run ends in a whole record or in a sentence."""
    with folder():
        for name, text in texts().items():
            Path(f"{name}.toml").write_text(text, encoding="utf-8")
        before = files()
        ended = checked(arguments)
        check_run(ended, arguments, before)


def check_file(text):
    """A machine file is good, or every problem is a sentence that begins with the file."""
    with folder():
        Path("machine.toml").write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        before = files()
        ended = checked(["machine", "check", "machine.toml"])
        assert files() == before
        assert all(line.startswith("machine.toml: ") for line in ended.err.splitlines()), ended.err


def check_data(files_and_arguments):
    """A file of data is read, or refused with one sentence and nothing written."""
    contents, arguments = files_and_arguments
    with folder():
        for name, content in contents.items():
            Path(name).write_bytes(content)
        before = files()
        ended = checked(arguments, codes=(0, 2, 3))
        added = files() - before
        assert not added or ended.code == 0, added
        for name in added:
            idn.read(name)


def check_round_trip(text):
    """A machine that is read is read again from its own text, file and every changed value."""
    try:
        machine = Machine.from_text(text)
    except MachineFileError as error:
        assert all(": " in problem or "no film" in problem for problem in error.problems)
        return
    assert Machine.from_text(machine.text) == machine
    assert Machine.from_text(machine.text).hash == machine.hash
    with folder():
        machine.save("saved.toml")
        assert load_machine("saved.toml") == machine
        assert files() == {"saved.toml"}


def check_replace(name_and_changes):
    """A machine with other values reads back from its text, whichever they are."""
    name, changed = name_and_changes
    machine = machines()[name]
    for change in changed:
        path, _, value = change.partition("=")
        try:
            machine = machine.replace(path, value if " " in value else float(value))
        except MachineFileError:
            continue
        assert Machine.from_text(machine.text) == machine


REPLACED = st.sampled_from(sorted(texts())).flatmap(lambda name: st.tuples(st.just(name), changes(name, 8)))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_no_value_of_a_parameter_is_too_strange_for_a_sentence(name):
    kind = ClosedLoopSetup if name == "controlled" else EXPERIMENTS[name]
    for key, param in known(name).items():
        for text in (*(show(value, param.unit) for value in EXTREME), *NOT_TIMES):
            try:
                experiment = kind(**{key: read(key, text, param)})
                rows = experiment.rows(0, min(experiment.samples, 50)) if name != "controlled" else np.zeros(1)
            except (DataError, MachineFileError) as error:
                assert "\n" not in str(error)
                continue
            assert np.all(np.isfinite(rows)) or name == "coastdown"


@pytest.mark.slow
@some(35)
@given(calls())
def test_a_few_legal_runs(compiled, arguments):
    check_call(arguments)


@pytest.mark.slow
@some(40)
@given(wrong_calls())
def test_a_few_runs_with_something_wrong(compiled, arguments):
    check_call(arguments)


@some(40)
@given(mutated())
def test_a_few_machine_files_with_a_mishap(text):
    check_file(text)


@some(25)
@given(data_calls())
def test_a_few_files_of_data(files_and_arguments):
    check_data(files_and_arguments)


@some(20)
@given(whole_machines())
def test_a_few_machines_read_back(text):
    check_round_trip(text)


@pytest.mark.slow
@some(100)
@given(calls())
def test_many_legal_runs(compiled, arguments):
    check_call(arguments)


@pytest.mark.slow
@some(250)
@given(wrong_calls())
def test_many_runs_with_something_wrong(compiled, arguments):
    check_call(arguments)


@pytest.mark.slow
@some(350)
@given(mutated())
def test_many_machine_files_with_a_mishap(text):
    check_file(text)


@pytest.mark.slow
@some(300)
@given(data_calls())
def test_many_files_of_data(files_and_arguments):
    check_data(files_and_arguments)


@pytest.mark.slow
@some(250)
@given(whole_machines())
def test_many_machines_read_back(text):
    check_round_trip(text)


@pytest.mark.slow
@some(50)
@given(REPLACED)
def test_many_replaced_values_read_back(name_and_changes):
    check_replace(name_and_changes)
