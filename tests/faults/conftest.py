"""Fixtures of the fault tests: inputs, undisturbed reference runs, trial folders."""

import os
import shutil
from pathlib import Path

import pytest
import typer

from fault_injection.commands import leaves
from fault_injection.inputs import make_failed, make_hidden, make_inputs, make_store
from fault_injection.trials import CommandTrial, Undisturbed
from rotorsim.commands.registry import app

NEEDS = {"campaign collect": make_store, "campaign retry": make_failed, "diagnose": make_hidden}
"""Inputs that take long, by the words of the command."""
KEPT = os.environ.get("ROTORSIM_FAULT_INPUTS")
"""Folder that keeps inputs and undisturbed runs, to run parts of the suite one after the other."""


@pytest.fixture(scope="session")
def inputs(tmp_path_factory):
    """Folder of what the commands read."""
    return make_inputs(Path(KEPT) if KEPT else tmp_path_factory.mktemp("inputs"))


@pytest.fixture(scope="session")
def trials(inputs, tmp_path_factory):
    """A function that makes a trial of a command in a new folder."""
    known = dict(leaves(typer.main.get_command(app)))

    def make(command, environment=None):
        needed = NEEDS.get(" ".join(command.words))
        path = needed(inputs) if needed else None
        prepare = None
        if command.words == ("campaign", "retry"):

            def prepare(out):
                shutil.copytree(path, out / "store")

        force = any(p.name == "force" for p in known[command.words].params)
        work = tmp_path_factory.mktemp("work")
        return CommandTrial(command, inputs, work, force, prepare, environment or {}).begin()

    return make


@pytest.fixture(scope="session")
def reference(trials, inputs):
    """A function that gives a command's undisturbed run; the second one, whose kernels are there, is timed."""
    made = {}

    def get(command):
        kept = inputs / "references" / command.name.replace(" ", "-")
        if command not in made and (kept / "seconds").exists():
            made[command] = Undisturbed(kept / "results", float((kept / "seconds").read_text()))
        if command not in made:
            for _ in range(1 + command.compiles):
                trial = trials(command)
                ended = trial.run()
                assert ended.code == command.code, ended.stderr
                assert all(any(trial.out.glob(name)) for name in command.files), ended.stdout
            shutil.copytree(trial.out, kept / "results")
            (kept / "seconds").write_text(str(ended.seconds))
            made[command] = Undisturbed(kept / "results", ended.seconds)
        return made[command]

    return get
