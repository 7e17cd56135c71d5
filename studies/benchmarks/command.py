"""Command of the benchmarks: speed and accuracy of the installed software, measured on this computer."""

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.commands.registry import example
from rotorsim.commands.results import files
from rotorsim.plant import Plant
from studies.benchmarks.accuracy import COLUMNS, REFERENCE, rig_table
from studies.benchmarks.decide import loop_figures, loops
from studies.benchmarks.diagnose import cases
from studies.benchmarks.measure_parts import measure
from studies.benchmarks.parts import PARTS
from studies.benchmarks.result import Figure
from studies.benchmarks.verdicts import confusion, figures


@example(
    "python studies/benchmarks/measure.py speed",
    "list(measure('speed'))",
)
def bench(
    part: Annotated[
        str | None,
        typer.Argument(
            metavar="[PART]",
            help=f"What to measure: {', '.join(PARTS)}, diagnose, decide, ties; all but the last three when not given.",
        ),
    ] = None,
    cold: Annotated[bool, typer.Option("--cold", help="Also time what starts with an empty cache.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Also run what takes many minutes.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Figures as JSON.")] = False,
    cases: Annotated[int, typer.Option("--cases", min=1, help="diagnose, decide, ties: number of hidden cases.")] = 200,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="diagnose, decide, ties: first seed; 100000 and on report.")
    ] = 100_000,
    keep: Annotated[
        Path | None,
        typer.Option("--keep", help="diagnose, decide, ties: file of finished cases; it resumes."),
    ] = None,
) -> None:
    """Measure speed and accuracy, each with its bound.

    Times depend on what else runs on the computer.
    """
    if part == "diagnose":
        _diagnose(cases, seed, keep, as_json)
        return
    if part in ("decide", "ties"):
        _decide(cases, seed, keep, as_json, part == "ties")
        return
    figures = _measure(part, cold, full)
    if as_json:
        typer.echo(json.dumps({"figures": [asdict(f) | {"met": f.met} for f in figures], "rig": _rig(part)}, indent=2))
    elif part in (None, "rig"):
        _print_rig()


def _measure(part: str | None, cold: bool, full: bool) -> list[Figure]:
    figures = []
    for figure in measure(part, cold, full):
        figures.append(figure)
        print(_line(figure), file=sys.stderr)
    return figures


def _diagnose(count: int, seed: int, keep: Path | None, as_json: bool) -> None:
    """Hidden cases one after another, then the table and the rates."""
    found = []
    with files(*([keep] if keep else []), force=True, another="--keep"):
        for case in cases(count, seed, keep):
            found.append(case)
            hidden, named = ", ".join(case.hidden) or case.kind, ", ".join(case.named)
            text = f"{case.number} {case.kind}: {hidden} -> {case.status} {named}: {case.verdict}, {case.seconds:.0f} s"
            print(text, file=sys.stderr, flush=True)
    rates = list(figures(found))
    if as_json:
        numbers = {"cases": [asdict(c) for c in found], "figures": [asdict(f) | {"met": f.met} for f in rates]}
        typer.echo(json.dumps(numbers, indent=2))
        return
    typer.echo(confusion(found))
    for figure in rates:
        typer.echo(_line(figure))


def _decide(count: int, seed: int, keep: Path | None, as_json: bool, faint: bool) -> None:
    """Loops one after another, then the rates."""
    found = []
    with files(*([keep] if keep else []), force=True, another="--keep"):
        for case in loops(count, seed, keep, faint=faint):
            found.append(case)
            odds = " -> ".join(f"{100 * p:.0f} % {name}" for name, p, _ in case.tops)
            print(f"{case.number} {', '.join(case.hidden)}: {odds}: {case.end}", file=sys.stderr, flush=True)
    rates = list(loop_figures(found))
    if as_json:
        numbers = {"loops": [asdict(c) for c in found], "figures": [asdict(f) | {"met": f.met} for f in rates]}
        typer.echo(json.dumps(numbers, indent=2))
        return
    for figure in rates:
        typer.echo(_line(figure))


def _line(figure: Figure) -> str:
    bound = "" if figure.bound is None else f"  (bound {figure.bound:g}: {'met' if figure.met else 'NOT MET'})"
    return f"{figure.name:<58} {figure.value:>10.4g} {figure.unit}{bound}"


def _rig(part: str | None) -> list[dict[str, float]]:
    """Rows of the rig's table as numbers."""
    if part not in (None, "rig"):
        return []
    rows = rig_table(Plant("dtu_gas_bearing"))
    return [{"MPa": mpa, "rpm": rpm, **dict(zip(COLUMNS, values, strict=True))} for mpa, rpm, values in rows]


def _print_rig() -> None:
    typer.echo("| MPa | rpm | " + " | ".join(COLUMNS) + " |")
    typer.echo("|" + "---|" * (2 + len(COLUMNS)))
    for mpa, rpm, values in rig_table(Plant("dtu_gas_bearing")):
        reference = (*REFERENCE[mpa, int(rpm)], None, None)
        cells = [f"{v:.4g}" if r is None else f"{v:.4g} ({r:.4g})" for v, r in zip(values, reference, strict=True)]
        typer.echo(f"| {mpa} | {rpm:.0f} | " + " | ".join(cells) + " |")
