"""Page of a sweep: best points, cells without a result, a chart of each quantity, a table of the cells."""

from __future__ import annotations

from pathlib import Path

from rotorsim.analysis.sweeps.sweep import SweepResult
from rotorsim.base import toml_text as tomllib
from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.report.export import display_units
from rotorsim.report.figures.sweep_plots import MOST_AXES, sweep_figure
from rotorsim.report.pages.study import Block, save_study_page

MOST_ROWS = 400
DEFINITIONS = {
    "lift_off": "Least gauge supply pressure at which the film carries the rotor.",
    "onset": "Lowest speed at which a mode of film and rotor loses its damping.",
    "load": "Static load, distributed as the rotor's mass, under which a journal reaches half of its clearance.",
    "flow": "Mass flow of all injectors and orifices.",
    "damping": "Least damping ratio of the modes near the first critical speeds.",
    "frequency": "Lowest natural frequency of film and rotor together.",
    "peak": "Largest half axis of the orbit at the measuring plane, over the stable speeds.",
}


def write_sweep(result: SweepResult, path: str | Path) -> Path:
    """Write the page; raises WriteError where it cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.sweep("dtu_gas_bearing", ["pressure=0.4 MPa, 0.5 MPa"], "flow")
    >>> page = rs.report.write_sweep(found, "sweep.html")
    """
    name = str(tomllib.loads(str(result.data.attrs["machine"])).get("name", "Unnamed machine"))
    save_study_page(f"{name}: sweep", _about(result), [*_blocks(result)], Path(path))
    return Path(path)


def _blocks(result: SweepResult) -> list[Block]:
    blocks = [Block("Best points", "", ("quantity", "best is the", "value", "at"), best_rows(result))]
    if result.reasons:
        blocks.append(Block("Cells without a result", "", ("quantity", "reason", "cells"), reason_rows(result)))
    for quantity in result.quantities:
        figure = sweep_figure(result, quantity.name)
        if figure is not None:
            blocks.append(Block(quantity.meaning.capitalize(), DEFINITIONS[quantity.name], figure=figure))
        elif result.data[quantity.name].ndim > MOST_AXES:
            blocks.append(Block(quantity.meaning.capitalize(), "More than three axes: see the table and the files."))
    head, rows = result.table()
    text = "" if len(rows) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(rows)} cells; all are in the files."
    shown = [["-" if value is None else value for value in row] for row in rows[:MOST_ROWS]]
    return [*blocks, Block("Cell by cell", text, head, shown)]


def best_rows(result: SweepResult) -> list[tuple[str, ...]]:
    """Best points as text: quantity, sense, value, point."""
    return [
        (name, one["best"], f"{one['value']:.4g} {one['unit']}".removesuffix(" 1"),
         ", ".join(f"{path} = {value}" for path, value in one["at"].items()))
        for name, one in result.best.items()
    ]  # fmt: skip


def reason_rows(result: SweepResult) -> list[tuple[str, str, str]]:
    """Cells without a result as text: quantity, reason, number."""
    return [(name, reason, str(n)) for name, found in result.reasons.items() for reason, n in found.items()]


def _about(result: SweepResult) -> str:
    attrs, axes = result.data.attrs, {str(name) for name in result.data.sizes}
    fixed = []
    if "speed" not in axes:
        fixed.append(f"{attrs['speed'] * TO_RPM:.5g} rpm")
    if "pressure" not in axes:
        fixed.append(f"{display_units.quantity(attrs['pressure'] * TO_MPA, 'MPa', '.4g')} gauge")
    at = f" at {' and '.join(fixed)}" if fixed else ""
    top = f"Onset and unbalance response are searched up to {attrs['highest_speed'] * TO_RPM:.5g} rpm."
    cut = "" if result.complete else " The sweep was interrupted and is not complete."
    return f"Equilibria and linear models of film and rotor{at}, without time simulation. {top}{cut}"
