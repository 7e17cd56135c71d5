"""`rotorsim design`: a control law from an identified model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from identification import load_model
from rotorsim.base.errors import DataError
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import print_table
from rotorsim.commands.results import files
from rotorsim.control import Law
from rotorsim.control.catalogue import design as make
from rotorsim.control.loop.analysis import overview
from rotorsim.control.variants import biased, without_dc


@example("rotorsim design hinf model.json --spec weights.k_0=0.7 --out hinf.json")
def design(
    name: Annotated[str, typer.Argument(help="p, lead, placement, lqr, hinf, lpv, h2_scheduled or youla.")],
    model: Annotated[Path, typer.Argument(help="Model that 'rotorsim identify' wrote.")],
    spec: Annotated[list[str] | None, typer.Option("--spec", help="FIELD=VALUE; may be repeated.")] = None,
    preset: Annotated[str, typer.Option("--preset", help="Named specification, e.g. 'hardening' of lead.")] = "",
    bias: Annotated[str, typer.Option("--bias", help="Constant references x,y in V.")] = "0,0",
    zero_dc: Annotated[float, typer.Option("--zero-dc", help="Corner in Hz below which the law does nothing.")] = 0.0,
    out: Annotated[Path | None, typer.Option("--out", help="Law file (JSON) to write; NAME.json by default.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the law file if it is there.")] = False,
    report: Annotated[bool, typer.Option("--report", help="Write an HTML report of the loop next to the law.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Design a control law on an identified model and check its loop over the model's range."""
    target = out or Path(f"{name}.json")
    page = [target.with_suffix(".html")] if report else []
    if target in page:
        raise DataError(f"--out: {target} would be the name of the report too; name a .json")
    with files(target, *page, force=force):
        loaded = load_model(model)
        law = make(name, loaded, spec or (), preset)
        if zero_dc:
            law = without_dc(law, zero_dc)
        volts = _pair(bias)
        law = biased(law, volts) if any(volts) else law
        law.save(target)
        findings = _findings(law, loaded) | {"law": str(target)}
        if report:
            from rotorsim.report.pages.design import write_design

            findings["report"] = str(write_design(law, loaded, page[0]))
    _print(findings, as_json)


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
        if not abs(x) + abs(y) < 1e3:
            raise ValueError(text)
    except ValueError as error:
        raise DataError(f"--bias: '{text}' is not a pair of voltages; write e.g. --bias 0.5,0") from error
    return x, y


def _findings(law: Law, model: Any) -> dict[str, Any]:
    """What a user wants to know about the loop with the model."""
    return overview(law, model)


def _print(findings: dict[str, Any], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(findings, indent=2))
        return
    written: dict[str, str] = {key: str(findings.pop(key)) for key in ("law", "report") if key in findings}
    shown = {key: f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in findings.items()}
    rows = [(key.replace("_", " "), value) for key, value in shown.items()]
    print_table(rows, written)
