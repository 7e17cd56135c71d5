"""`rotorsim study identification-vs-physics`: campaign, identification, comparison, claims and report."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.commands.options import MachineName

if TYPE_CHECKING:
    from rotorsim.study.identification_vs_physics import Study

app = typer.Typer(
    help="Studies that reproduce the thesis on the virtual rig.",
    epilog="Example: rotorsim study identification-vs-physics --out study",
    no_args_is_help=True,
)


@app.callback()
def _group() -> None:
    pass


@app.command(
    name="identification-vs-physics",
    epilog="Example: rotorsim study identification-vs-physics dtu_gas_bearing --out study --quick",
)
def identification_vs_physics(
    machine: MachineName = "dtu_gas_bearing",
    out: Annotated[Path, typer.Option("--out", help="Folder for records, tables and report.")] = Path("study"),
    quick: Annotated[bool, typer.Option("--quick", help="A grid of 3 x 3 points only.")] = False,
    jobs: Annotated[int, typer.Option("--jobs", help="Records at a time.")] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="Print claims and errors as JSON.")] = False,
) -> None:
    """Simulate a campaign, identify Model 3 from its records alone and hold it against the linearised physics."""
    from rotorsim.commands.data import sentences
    from rotorsim.commands.options import make_plant
    from rotorsim.study.claims import claims
    from rotorsim.study.identification_vs_physics import study
    from rotorsim.study.plan import RPM, Plan
    from rotorsim.study.records import make_records
    from rotorsim.study.table import HEADS, rows, summary

    plan = Plan(tuple(k * RPM for k in (0.0, 3000.0, 6000.0)), (0.3e6, 0.5e6, 0.7e6)) if quick else Plan()
    plant = make_plant(machine, None, None, [])
    make_records(plant.machine, plan, out / "records", jobs, _tell if sys.stderr.isatty() else None)
    with sentences():
        found = study(plant, out / "records", jobs, 1 if quick else 3)
    told = claims(found)
    found.refined.save(out / "model.json")
    numbers = {"errors": summary(found), "claims": [asdict(c) for c in told], "heads": HEADS, "rows": rows(found)}
    (out / "study.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    _page(found, told, out / "report.html", plant.machine.name)
    if as_json:
        typer.echo(json.dumps({key: numbers[key] for key in ("errors", "claims")}, indent=2))
        return
    for claim in told:
        typer.echo(f"{claim.number:4s} {claim.verdict:8s} {claim.claim}: {claim.ours}")
    for name, value in summary(found).items():
        typer.echo(f"{name.replace('_', ' ')}: {value:.2f}")
    typer.echo(f"{out / 'report.html'}: report; {out / 'model.json'}: LPV model; {out / 'study.json'}: numbers")


def _tell(done: int, total: int) -> None:
    print(f"\r{done} of {total} records", end="\n" if done == total else "", file=sys.stderr, flush=True)


def _page(found: Study, told: list[Any], path: Path, machine: str) -> None:
    from rotorsim.report.study_page import Block, save_study_page
    from rotorsim.study.figures import figures
    from rotorsim.study.table import HEADS, rows, summary

    claims = [(c.number, c.claim, c.thesis, c.ours, c.verdict, c.why) for c in told]
    blocks = [
        Block("Claims", "", ("", "claim", "thesis", "here", "verdict", "why"), claims),
        Block("Model 3 against the physics", "Largest and mean errors over the grid, in per cent.", ("", "%"),
              [(k.replace("_", " "), v) for k, v in summary(found).items()]),
        *(Block(title, text, figure=figure) for title, text, figure in figures(found)),
        Block("Point by point", "Hz, um/V, ms, %. The identified lag holds actuators and film, the other the film.",
              HEADS, rows(found)),
    ]  # fmt: skip
    if found.failed:
        blocks.append(Block("Records that could not be identified", "", ("",), [(text,) for text in found.failed]))
    save_study_page("Identification against physics", f"{machine}, virtual records only. This is a simulation.",
                    blocks, path)  # fmt: skip
