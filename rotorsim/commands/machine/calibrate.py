"""`rotorsim machine calibrate`: machine-file parameters fitted to measured values, with standard deviations."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from rotorsim.analysis import calibrate, read_targets
from rotorsim.analysis.calibrate import Calibration
from rotorsim.analysis.calibrated import calibration_numbers, save_calibrated
from rotorsim.analysis.figures import UNITS
from rotorsim.base.constants import TO_MPA, TO_UM
from rotorsim.base.progress import end_line, line
from rotorsim.commands.completion import targets as shipped
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import GivenMachine, GridOptions, plant_of
from rotorsim.commands.results import files


@example(
    "rotorsim machine calibrate dtu_gas_bearing --targets dtu_orifice --out my_rig.toml",
    "rs.analysis.calibrate(rs.load_machine('dtu_gas_bearing'), rs.analysis.read_targets('dtu_orifice'))",
)
def calibrate_command(
    machine: GivenMachine,
    targets: Annotated[
        str, typer.Option(help="Targets file, or a shipped one: dtu_orifice, dtu_loss_factor.", autocompletion=shipped)
    ],
    grid: Annotated[str | None, typer.Option("--grid", help="Film grid n_theta x n_z, e.g. 32x16.")] = None,
    passes: Annotated[int, typer.Option(help="Most steps of the fit.", min=1)] = 20,
    out: Annotated[Path | None, typer.Option(help="Machine file to write; default MACHINE-calibrated.toml.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Fit named parameters within bounds to measured or published figures and write a new machine file.

    Every target is shown before and after; rows with the role 'predict' take no part in the fit. Correlations and
    directions that the targets do not determine are named: numbers along them are not to be believed one by one.
    """
    asked = read_targets(targets)
    loaded = plant_of(machine).machine
    path = out or Path(f"{Path(machine).stem}-calibrated.toml")
    with files(path, force=force):
        coarse = loaded if grid is None else GridOptions(grid).plant(machine).machine
        found = calibrate(coarse, asked, passes, None if as_json else _show_passes)
        if not as_json:
            end_line()
        save_calibrated(found, asked.name, path, loaded)
    if as_json:
        typer.echo(json.dumps(calibration_numbers(found) | {"file": str(path)}, indent=2))
    else:
        _print(found)
        typer.echo(f"{path}: written")
    if found.ended != "complete":
        print("interrupted: the best values so far are written", file=sys.stderr)
        raise typer.Exit(130)


def _show_passes(count: int, cost: float) -> None:
    line(f"{count} evaluations, cost {cost:.4g} ")


def _print(found: Calibration) -> None:
    console = Console()
    table = Table("target", "role", "asked", "before", "", "after", "", box=None, pad_edge=False)
    for row in found.rows:
        t = row.target
        asked = _range(t.low, t.high, t.quantity)
        table.add_row(t.name, t.role + ("ted" if t.role == "fit" else "ed"), asked,
                      _range(*row.before, t.quantity), row.verdicts[0],
                      _range(*row.after, t.quantity), row.verdicts[1])  # fmt: skip
    console.print(table)
    values = Table("parameter", "start", "value", "+-", "", box=None, pad_edge=False)
    for p, v, s, b in zip(found.parameters, found.values, found.sd, found.at_bound, strict=True):
        values.add_row(p.name, f"{p.start:.5g}", f"{v:.5g} {p.unit}", f"{s:.2g}", "at its bound" if b else "")
    console.print(values)
    console.print("correlations above 0.8: " + (", ".join(strong(found)) or "none"))
    for text in found.unidentifiable:
        console.print(f"not identifiable from these targets: {text}")
    for role in ("fit", "predict"):
        before, after, total = found.met(role)
        console.print(f"{role}: {before} of {total} met before, {after} after")


def strong(found: Calibration) -> list[str]:
    """Strongly correlated pairs of parameters."""
    names = [p.name for p in found.parameters]
    return [
        f"{names[i]} and {names[j]} {found.correlation[i, j]:+.2f}"
        for i in range(len(names))
        for j in range(i)
        if abs(found.correlation[i, j]) > 0.8
    ]


SCALES = {"rad/s": (1.0, "rad/s"), "s": (1e3, "ms"), "m/V": (TO_UM, "um/V"), "m": (TO_UM, "um"), "Pa": (TO_MPA, "MPa")}


def _range(low: float, high: float, quantity: str) -> str:
    scale, unit = SCALES.get(UNITS[quantity], (1.0, UNITS[quantity].replace("1", "")))
    low, high = (0.0 if abs(v * scale) < 1e-9 else v * scale for v in (low, high))
    text = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
    return f"{text} {unit}".strip()
