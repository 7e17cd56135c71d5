"""`rotorsim hide MACHINE`: records of a machine with hidden effects, as test data for `rotorsim diagnose`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.display import line
from rotorsim.base.errors import DataError
from rotorsim.commands.completion import parameters
from rotorsim.commands.options import AsJson, GivenMachine, a_folder, note_compiling
from rotorsim.commands.registry import command
from rotorsim.commands.results import results


@command(
    "hide",
    "rotorsim hide dtu_gas_bearing --effect coupling.force_2x --seed 3 --out puzzle",
    "rs.hide(rs.load_machine('dtu_gas_bearing'), ('coupling.force_2x',), 3, 'puzzle')",
)
def hide(
    machine: GivenMachine,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            help="What to hide, e.g. runout or runout.amplitude_2x; may be repeated.",
            autocompletion=parameters,
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Draws size, phase, calibration and noise.")] = 0,
    out: Annotated[
        Path, typer.Option("--out", callback=a_folder, help="Folder for records and the sealed truth.")
    ] = Path("hidden"),
    as_json: AsJson = False,
) -> None:
    """Make records with hidden effects, to try 'diagnose' on.

    Without --effect nothing is hidden.

    Records go to OUT/records; the truth to OUT/sealed/truth.json, which `rotorsim diagnose` never opens.
    """
    if not 0 <= seed < 2**31:
        raise DataError(f"--seed: {seed} must be a whole number from 0 to 2^31 - 1; give e.g. 0")

    from rotorsim.machine import load_machine

    believed = load_machine(machine)
    from rotorsim.discrepancy.hidden_machine import hide as record_hidden, truth_twin

    def progress(done: int, of: int) -> None:
        line(f"record {done} of {of}", done == of)

    twin = truth_twin(believed)
    with results(out, "hidden", ("records", "sealed"), force=None):
        note_compiling(twin.assembly, "settle", "run")
        records = record_hidden(believed, tuple(effect or ()), seed, out, twin=twin, progress=progress)
    files = [str(out / "records" / f"{r.attrs['record']}.nc") for r in records]
    if as_json:
        typer.echo(json.dumps({"records": files, "sealed": str(out / "sealed" / "truth.json")}, indent=2))
        return
    typer.echo(f"{len(files)} records: {out / 'records'}; the truth, sealed: {out / 'sealed' / 'truth.json'}")
