"""`rotorsim identify PATHS`: models from campaign folders or measured files, without a machine file.

Records at one operating point give a linear model, records at several a parameter-varying one.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Column, Table

from identification import Prefilter
from identification.campaign import SourceResult
from identification.local.dead_time import FREE
from identification.local.models import plain
from identification.lpv.fit import REFINEMENTS
from identification.lpv.surfaces import ORDERS
from identification.records.runout import KINDS
from rotorsim.base.errors import DataError
from rotorsim.base.progress import counter
from rotorsim.base.sentences import told_apart
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import quantity
from rotorsim.commands.results import files
from rotorsim.study.identify_records import identify_records


@example(
    "rotorsim identify records --model 3 --out model.json",
    "rs.identify_records(['records'], model=3)",
)
def identify(
    paths: Annotated[list[Path], typer.Argument(metavar="PATHS", help="Folder of records, or files.")],
    model: Annotated[str, typer.Option("--model", help="1, 2, 2-rate, 3, actuator or blackbox.")] = "3",
    order: Annotated[int | None, typer.Option("--order", help="Of a black-box model; 6 if not given.")] = None,
    method: Annotated[str, typer.Option("--method", help="auto, oe, two-stage (closed loop) or pem.")] = "auto",
    surfaces: Annotated[str, typer.Option("--surfaces", help="Degree over speed and pressure, or hold-out.")] = "2",
    refine: Annotated[str, typer.Option("--refine", help="Of the surfaces: none, frequency or global.")] = "none",
    dead_time: Annotated[str, typer.Option("--dead-time", help="Of model 3: free, 0, or e.g. '0.8 ms'.")] = "free",
    runout: Annotated[str, typer.Option("--runout", help="Runout filter: harmonic, table or none.")] = "harmonic",
    median: Annotated[int, typer.Option("--median", help="Samples of a running median against spikes.")] = 1,
    lowpass: Annotated[str, typer.Option("--lowpass", help="Corner of a Butterworth filter, e.g. '800 Hz'.")] = "",
    probes: Annotated[str, typer.Option("--probes", help="Probes of one plane as outputs, e.g. 'DE_x,DE_y'.")] = "",
    mapping: Annotated[Path | None, typer.Option("--mapping", help="TOML file: which column is which.")] = None,
    out: Annotated[Path, typer.Option("--out", help="Model file (JSON) to write.")] = Path("model.json"),
    force: Annotated[bool, typer.Option("--force", help="Replace the model file if it is there.")] = False,
    jobs: Annotated[int, typer.Option("--jobs", help="Records identified at a time.")] = 2,
    advice: Annotated[bool, typer.Option("--advice", help="Propose order, delay and model, and fit nothing.")] = False,
    compare: Annotated[
        list[Path] | None, typer.Option("--compare", help="Model file to hold against the records; fits nothing.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Identify a grey-box, black-box or LPV model from records.

    Records at several operating points give an LPV model.
    """
    _check(surfaces, refine, runout, median)
    corner = quantity("lowpass", lowpass, "Hz") if lowpass else None
    outputs = tuple(name.strip() for name in probes.split(",")) if probes else ()
    settings = Prefilter(runout=runout, median=median, lowpass=corner, probes=outputs)
    if advice or compare:
        if advice and compare:
            raise DataError("--advice and --compare: one at a time")
        from rotorsim.commands.identify_looks import print_advice, print_comparison

        if advice:
            print_advice(paths, settings, mapping, as_json)
        else:
            print_comparison(paths, compare or [], settings, mapping, as_json)
        return
    dead = dead_time if dead_time == FREE else 0.0 if dead_time == "0" else quantity("dead-time", dead_time, "s")
    degree = int(surfaces) if surfaces.isdecimal() else surfaces
    shown = partial(counter, things="records")
    with files(out, force=force):
        made, found = identify_records(
            paths, model, order, method, settings, mapping, degree, refine, jobs, shown, dead
        )
        made.save(out)
    _print(found, made, out, as_json)


def _check(surfaces: str, refine: str, runout: str, median: int) -> None:
    """Refuse what would be refused after minutes of work."""
    degrees = (*map(str, ORDERS), "hold-out")
    for option, value, known in (
        ("surfaces", surfaces, degrees),
        ("refine", refine, REFINEMENTS),
        ("runout", runout, (*KINDS, "none")),
    ):
        if value not in known:
            raise DataError(f"--{option}: '{value}' is not known; choose one of {', '.join(known)}")
    if median < 1 or median % 2 == 0:
        raise DataError(f"--median: {median} samples; give an odd number, 1 for no filter")


def _print(found: list[SourceResult], made: Any, out: Path, as_json: bool) -> None:
    rows = [_row(one, name) for one, name in zip(found, told_apart([one.source.path for one in found]), strict=True)]
    if as_json:
        typer.echo(json.dumps({"model": str(out), "kind": type(made).__name__, "records": rows}, indent=2))
        return
    console = Console()
    heads = (Column("record", no_wrap=True), "rpm", "MPa", "fit %", "ceiling %", "Hz", "zeta", "delay ms")
    table = Table(*heads, box=None, pad_edge=False)
    for row in rows:
        if "error" not in row:
            table.add_row(*map(escape, _cells(row)))
    console.print(table)
    if len(found) == 1 and found[0].result is not None:  # its report has its warnings
        console.print(escape(found[0].result.report()), soft_wrap=True)
    else:
        for row in rows:
            for text in [row["error"]] if "error" in row else row["warnings"]:
                console.print(escape(f"{row['record']}: {text}" if "error" not in row else text), soft_wrap=True)
    console.print(escape(f"{out}: {type(made).__name__} written"), soft_wrap=True)


def _row(one: SourceResult, name: str) -> dict[str, Any]:
    if one.result is None:
        return {"record": name, "error": one.error}
    r = one.result
    numbers = {"speed": r.speed, "pressure": r.pressure, "fit": r.fit, "ceiling": r.ceiling, "wn": r.wn,
               "zeta": r.zeta, "delay": r.delay, "static_gain": r.static_gain, "parameters": r.parameters,
               "noise_free_fit": r.noise_free_fit, "seconds": r.seconds, "dead_time": r.dead_time,
               "intervals": [asdict(one) | {"low": one.low, "high": one.high} for one in r.intervals]}  # fmt: skip
    return {"record": name, "warnings": list(r.warnings), "notes": list(r.notes)} | {
        key: plain(value) for key, value in numbers.items()
    }


def _cells(row: dict[str, Any]) -> list[str]:
    def several(values: Any, form: str, scale: float) -> str:
        return ", ".join("-" if value is None else format(value * scale, form) for value in values)

    return [
        row["record"], several([row["speed"]], ".0f", 9.549297), several([row["pressure"]], ".3f", 1e-6),
        several(row["fit"], ".1f", 100), several(row["ceiling"], ".1f", 100), several(row["wn"], ".2f", 0.1591549),
        several(row["zeta"], ".4f", 1), several(row["delay"], ".3f", 1e3),
    ]  # fmt: skip
