"""`rotorsim design` and `rotorsim verify`: a control law from an identified model, and its test on the plant."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.display import on_terminal, progress_line
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_json
from rotorsim.base.input_files import parse_json
from rotorsim.base.units import parse
from rotorsim.commands import options
from rotorsim.commands.registry import command
from rotorsim.commands.results import files, results

if TYPE_CHECKING:
    from rotorsim.control import Law, RunoutTable
    from rotorsim.verify import Verification

FAILED = 1
"""Exit code of a verification in which a criterion fails."""


@command(
    "design",
    "rotorsim design hinf model.json --spec weights.k_0=0.7 --out hinf.json",
    "rs.control.design('hinf', rs.load_model('model.json'))",
)
def design(
    name: Annotated[
        str,
        typer.Argument(
            help=f"{', '.join(options.laws()[:-1])} or {options.laws()[-1]}.", autocompletion=options.designs
        ),
    ],
    model: Annotated[Path | None, typer.Argument(help="Model that 'rotorsim identify' wrote.")] = None,
    spec: Annotated[list[str] | None, typer.Option(help="FIELD=VALUE; may be repeated; see --fields.")] = None,
    preset: Annotated[str, typer.Option(help="Named specification, e.g. 'hardening' of lead.")] = "",
    bias: Annotated[str, typer.Option(help="Constant references x,y, e.g. '0.5 V,0 V'.")] = "",
    zero_dc: Annotated[
        str, typer.Option(help="Corner of a high-pass in front of the law, e.g. '5 Hz'; below 1250 Hz.")
    ] = "",
    runout: Annotated[
        Path | None, typer.Option(help="Slow roll whose runout the law takes off what it measures: a record.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Law file (JSON) to write; NAME.json by default.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the law file if it is there.")] = False,
    report: Annotated[bool, typer.Option("--report", help="Write an HTML report of the loop next to the law.")] = False,
    *,
    page: options.PageOptions,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    fields: Annotated[bool, typer.Option("--fields", help="List the fields of --spec for this design.")] = False,
) -> None:
    """Design a control law on an identified model.

    The loop is checked over the model's range.
    """
    if fields:
        from rotorsim.control import field_rows, make_spec

        options.print_rows(("field", "unit", "default", "limits", "meaning"), field_rows(make_spec(name, (), preset)))
        return
    page.check(report)
    if model is None:
        raise DataError(f"design {name}: no model; give the file that 'rotorsim identify' wrote")
    target = out or Path(f"{name}.json")
    html = [target.with_suffix(".html")] if report else []
    if target in html:
        raise DataError(f"--out: {target} would be the name of the report too; name a .json")
    with files(target, *html, force=force):
        from identification import load_model
        from rotorsim.control import biased, overview, without_dc

        page.begin(target.with_suffix(".html"), force)
        loaded = load_model(model)
        law = _made(name, loaded, spec or (), preset)
        if zero_dc:
            law = without_dc(law, options.quantity("zero-dc", zero_dc, "Hz"))
        if bias:
            law = biased(law, _pair(bias))
        if runout is not None:
            law = law.with_(runout=_runout_table(runout, law))
        law.save(target)
        findings = overview(law, loaded) | {"law": str(target)}
        if report:
            from rotorsim.report.control import write_design

            findings["report"] = str(write_design(law, loaded, html[0]))
            findings |= page.finish(html[0])
    _print_findings(findings, as_json)


def _runout_table(path: Path, law: Law) -> RunoutTable:
    """Table of a slow roll, of the record's date or, where it has none, the file's; refused for another machine's."""
    from identification import load
    from identification.records.schema import machine_of
    from rotorsim.control import runout_table

    record = load(path)
    table = runout_table(record)
    if not table.taken:
        file = max(path.glob("*.nc"), key=lambda one: one.stat().st_mtime, default=path) if path.is_dir() else path
        table = replace(table, taken=datetime.fromtimestamp(file.stat().st_mtime, UTC).date().isoformat())
    rolled, designed = machine_of(record), str(law.about.get("machine", ""))
    if rolled and designed and rolled != designed:
        alike = rolled.rpartition(" ")[0] == designed.rpartition(" ")[0]
        where = "with the model's machine file and grid: something in the two files differs" if alike else "there"
        raise DataError(
            f"--runout {path}: is a slow roll of {_identity(rolled)}, and the model is one of {_identity(designed)}; "
            f"record one {where}",
            argument="runout",
            value=rolled,
        )
    return table


def _identity(machine: str) -> str:
    """Name and fingerprint in words: machines of one name may differ."""
    name, _, mark = machine.rpartition(" ")
    return f"{name} ({mark})"


def _made(name: str, model: Any, spec: Sequence[str], preset: str) -> Law:
    """The law of a design, whose steps a terminal shows meanwhile."""
    from rotorsim.control import design as make

    with progress_line(f"design {name}") as progress:
        return make(name, model, spec, preset, progress)


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (parse(part.strip(), "V") for part in text.split(","))
    except ValueError as error:
        raise DataError(f"--bias: '{text}' is not a pair of voltages; write e.g. --bias '0.5 V,0 V'") from error
    return x, y


def _print_findings(findings: dict[str, Any], as_json: bool) -> None:
    if as_json:
        options.print_json(findings)
        return
    written: dict[str, str] = {key: str(findings.pop(key)) for key in ("law", "report", "figures") if key in findings}
    shown = {key: f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in findings.items()}
    rows = [(key.replace("_", " "), value) for key, value in shown.items()]
    options.print_table(rows, written)


@command(
    "verify",
    "rotorsim verify hinf.json dtu_gas_bearing --out verification",
    "rs.verify.closed_loop(rs.load_law('hinf.json'), plant)",
)
def verify(
    law: Annotated[Path, typer.Argument(help="Law that 'rotorsim design' wrote.")],
    machine: options.MachineName = "dtu_gas_bearing",
    quick: Annotated[bool, typer.Option("--quick", help="Five impact points, this machine alone.")] = False,
    safe: Annotated[bool, typer.Option("--safe-speed", help="Also run up until the safety circle is left.")] = False,
    out: Annotated[Path | None, typer.Option(callback=options.a_folder, help="Folder for report and table.")] = None,
    *,
    settings: options.PlantOptions,
    page: options.PageOptions,
    force: options.Force = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
) -> None:
    """Verify a control law on a machine's nonlinear plant.

    Exit code 1 if a criterion fails.
    """
    page.check()
    plant = settings.plant(machine)
    from rotorsim.control import load_law
    from rotorsim.verify import closed_loop, safe_speed
    from rotorsim.verify.closed_loop import edited

    loaded = load_law(law)
    with results(out, "verification", ("table.json", "report.html"), force) as folder:
        page.begin(folder / "report.html", force)
        options.note_compiling(plant.assembly, "settle", "run")
        steps = (lambda step: print(f"{step} ...", file=sys.stderr)) if on_terminal() else None
        result = closed_loop(loaded, plant, quick=quick, progress=steps)
        if safe:
            pair = [safe_speed(plant, one) for one in (None, loaded)]
            result.runs["safe_speed"] = pair
        first = _first(folder / "table.json") or result.settings["criteria"]
        result.settings.update(first=first, edited=edited(first, result.settings["criteria"]))
        write_json(folder / "table.json", _plain(result))
        written = {"report": str(result.report(folder / "report.html"))}
        written |= page.finish(written["report"])
    _print_verification(result, written, as_json)
    raise typer.Exit(0 if result.passed else FAILED)


def _first(path: Path) -> dict[str, float | None] | None:
    """Bounds of the first verification in the folder, from the table that is replaced; None where it states none."""
    try:
        before = parse_json(path.read_text(encoding="utf-8-sig"))
        found = before.get("first_criteria", before["criteria"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return found if isinstance(found, dict) else None


def _plain(result: Verification) -> dict[str, object]:
    from rotorsim.verify.transients import comparison

    numbers: dict[str, object] = {"law": result.law.name, "machine": result.machine, "passed": result.passed}
    numbers |= {"criteria": result.settings["criteria"], "first_criteria": result.settings["first"]}
    numbers["edited"] = result.settings["edited"]
    numbers["rows"] = [
        {key: None if isinstance(v, float) and not isfinite(v) else v for key, v in row.items()} for row in result.table
    ]
    numbers["alarms"] = [asdict(one) for one in result.alarms]
    if result.remark:
        numbers["remark"] = result.remark
    if "safe_speed" in result.runs:
        numbers["safe_speed"] = comparison(*result.runs["safe_speed"])
    return numbers


def _print_verification(result: Verification, files: dict[str, str], as_json: bool) -> None:
    if as_json:
        options.print_json(_plain(result) | files)
        return
    words = {True: "pass", False: "FAIL", None: "-"}
    rows = [
        (row.check, f"{row.measured:.3g} {row.unit}", "" if row.bound is None else f"{row.bound:.3g}",
         words[row.passed], row.remark)
        for row in result.rows
    ]  # fmt: skip
    options.print_rows(("criterion", "measured", "bound", "", "remark"), rows)
    console = options.Console()
    for bound in result.settings["edited"]:
        console.print(f"edited bound: {bound}")
    if "safe_speed" in result.runs:
        from rotorsim.verify.transients import sentence

        console.print(f"safe speed: {sentence(*result.runs['safe_speed'])}", soft_wrap=True)
    console.print(f"{result.law.name} on {result.machine}: {'passed' if result.passed else 'FAILED'}")
    for kind, path in files.items():
        console.print(f"{kind}: {path}", soft_wrap=True)
