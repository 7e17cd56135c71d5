"""`rotorsim design`: a control law from an identified model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from identification import load_model
from rotorsim.base.errors import DataError
from rotorsim.base.progress import line
from rotorsim.base.units import parse
from rotorsim.commands.completion import designs
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import print_table, quantity
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import files
from rotorsim.control import Law
from rotorsim.control.catalogue import design as make, field_rows, make_spec
from rotorsim.control.loop.analysis import overview
from rotorsim.control.variants import biased, without_dc


@example(
    "rotorsim design hinf model.json --spec weights.k_0=0.7 --out hinf.json",
    "rs.control.design('hinf', rs.load_model('model.json'))",
)
def design(
    name: Annotated[
        str, typer.Argument(help="p, lead, placement, lqr, hinf, lpv, h2_scheduled or youla.", autocompletion=designs)
    ],
    model: Annotated[Path | None, typer.Argument(help="Model that 'rotorsim identify' wrote.")] = None,
    spec: Annotated[
        list[str] | None, typer.Option("--spec", help="FIELD=VALUE; may be repeated; see --fields.")
    ] = None,
    preset: Annotated[str, typer.Option("--preset", help="Named specification, e.g. 'hardening' of lead.")] = "",
    bias: Annotated[str, typer.Option("--bias", help="Constant references x,y, e.g. '0.5 V,0 V'.")] = "",
    zero_dc: Annotated[
        str, typer.Option("--zero-dc", help="Corner of a high-pass in front of the law, e.g. '5 Hz'; below 1250 Hz.")
    ] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Law file (JSON) to write; NAME.json by default.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the law file if it is there.")] = False,
    report: Annotated[bool, typer.Option("--report", help="Write an HTML report of the loop next to the law.")] = False,
    *,
    page: PageOptions,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    fields: Annotated[bool, typer.Option("--fields", help="List the fields of --spec for this design.")] = False,
) -> None:
    """Design a control law on an identified model.

    The loop is checked over the model's range.
    """
    if fields:
        _print_fields(name, preset)
        return
    page.check(report)
    if model is None:
        raise DataError(f"design {name}: no model; give the file that 'rotorsim identify' wrote")
    target = out or Path(f"{name}.json")
    html = [target.with_suffix(".html")] if report else []
    if target in html:
        raise DataError(f"--out: {target} would be the name of the report too; name a .json")
    with files(target, *html, force=force):
        page.begin(target.with_suffix(".html"), force)
        loaded = load_model(model)
        law = _made(name, loaded, spec or (), preset)
        if zero_dc:
            law = without_dc(law, quantity("zero-dc", zero_dc, "Hz"))
        if bias:
            law = biased(law, _pair(bias))
        law.save(target)
        findings = _findings(law, loaded) | {"law": str(target)}
        if report:
            from rotorsim.report.control import write_design

            findings["report"] = str(write_design(law, loaded, html[0]))
            findings |= page.finish(html[0])
    _print(findings, as_json)


def _made(name: str, model: Any, spec: Sequence[str], preset: str) -> Law:
    """The law of a design, whose steps a terminal shows meanwhile."""
    try:
        return make(name, model, spec, preset, lambda step: line(f"design {name}: {step} ..."))
    finally:
        line("")


def _print_fields(name: str, preset: str) -> None:
    table = Table("field", "unit", "default", "limits", "meaning", box=None, pad_edge=False)
    for row in field_rows(make_spec(name, (), preset)):
        table.add_row(*map(escape, row))
    Console().print(table)


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (parse(part.strip(), "V") for part in text.split(","))
    except ValueError as error:
        raise DataError(f"--bias: '{text}' is not a pair of voltages; write e.g. --bias '0.5 V,0 V'") from error
    return x, y


def _findings(law: Law, model: Any) -> dict[str, Any]:
    """What a user wants to know about the loop with the model."""
    return overview(law, model)


def _print(findings: dict[str, Any], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(findings, indent=2))
        return
    written: dict[str, str] = {key: str(findings.pop(key)) for key in ("law", "report", "figures") if key in findings}
    shown = {key: f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in findings.items()}
    rows = [(key.replace("_", " "), value) for key, value in shown.items()]
    print_table(rows, written)
