"""`rotorsim balance MACHINE RECORDS`: unbalance from measured 1X vectors, and the weights against it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from rotorsim.balance import (
    Conditions,
    Correction,
    Estimate,
    Influence,
    LeftOut,
    correction,
    estimate,
    fit_influence,
    fit_physical,
    leave_one_out,
    read_conditions,
)
from rotorsim.base.constants import TO_UM
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_json, write_text
from rotorsim.base.sentences import listing, quote
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, GivenMachine, WithReport, a_folder, print_table
from rotorsim.commands.results import results
from rotorsim.machine import load_machine

G_MM = 1e6
"""g mm in a kg m."""
METHODS = ("influence coefficients", "physical model")


@example("rotorsim balance bently_rk4 docs/rk4/open.csv docs/rk4/unlabelled.csv --mapping docs/rk4/balance.toml")
def balance(
    machine: GivenMachine,
    records: Annotated[list[Path], typer.Argument(metavar="RECORDS", help="CSV files of 1X vectors, a row a record.")],
    mapping: Annotated[Path, typer.Option(help="TOML file: which columns are probes, planes and known unbalances.")],
    correct: Annotated[str, typer.Option(help="Condition to balance; default the first without added unbalance.")] = "",
    out: Annotated[Path | None, typer.Option(callback=a_folder, help="Folder; default a new folder 'balance'.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are in the folder.")] = False,
    report: WithReport = True,
    as_json: AsJson = False,
) -> None:
    """Estimate unbalance by influence coefficients and by the machine's model, side by side, and correct it."""
    model = load_machine(machine)
    conditions = read_conditions(records, mapping)
    known = conditions.known
    if not known.any():
        raise DataError("no condition has a known unbalance; add a trial weight in each plane and label it")
    tests, fits = {}, {}
    for name, fit in zip(METHODS, (fit_influence, fit_physical(model, conditions)), strict=True):
        tests[name] = leave_one_out(conditions, fit)
        fits[name] = fit(conditions.flat[known], conditions.unbalance[known])
    best = min(METHODS, key=lambda name: tests[name].vector_rms)
    fix = _correction(conditions, fits[best], correct)
    found = {c: estimate(fits[best], conditions.flat[k]) for k, c in enumerate(conditions.labels) if not known[k]}
    names = ["balance.json", "unbalance.csv", *(["report.html"] if report else [])]
    with results(out, "balance", names, force) as folder:
        summary = _summary(conditions, tests, best, found, fix)
        write_json(folder / "balance.json", summary)
        write_text(folder / "unbalance.csv", _table(conditions, found))
        files = {"results": str(folder / "balance.json"), "unbalance": str(folder / "unbalance.csv")}
        rows = _rows(conditions, tests, best, found, fix)
        if report:
            from rotorsim.report.pages.balance import write_balance

            files["report"] = str(
                write_balance(conditions, tests, fix[1] if fix else None, rows, folder / "report.html")
            )
    if as_json:
        typer.echo(json.dumps({**summary, "files": files}, indent=2))
    else:
        print_table(rows, files)


def _correction(conditions: Conditions, found: Influence, wanted: str) -> tuple[str, Correction] | None:
    """Condition to balance and its weights; None if there is no condition without added unbalance."""
    if wanted and wanted not in conditions.labels:
        raise DataError(f"--correct: no condition {quote(wanted)}; there are {listing(conditions.labels)}")
    bare = [c for c, u in zip(conditions.labels, conditions.unbalance, strict=True) if (u == 0).all()]
    label = wanted or (bare[0] if bare else "")
    if not label:
        return None
    vectors = conditions.flat[conditions.labels.index(label)]
    return label, correction(found, vectors, conditions.planes)


def _vector(value: complex) -> str:
    return f"{abs(value) * G_MM:.2f} g mm at {np.rad2deg(np.angle(value)) % 360:.0f} deg"


def _rows(
    conditions: Conditions, tests: dict[str, LeftOut], best: str, found: dict[str, Estimate], fix: Any
) -> list[tuple[str, str]]:
    rows = [("Conditions", f"{int(conditions.known.sum())} with known unbalance, {len(found)} without")]
    for name, test in tests.items():
        rows.append((
            name.capitalize(),
            f"every label from the others: vector error {test.vector_rms * G_MM:.2f} g mm rms a plane, magnitude "
            f"{test.magnitude_error * G_MM:.2f} g mm; 90 % regions hold {test.content:.0%}",
        ))  # fmt: skip
    doubtful = tests[best].contradicts
    rows.append(("Labels that the others contradict", ", ".join(doubtful) or "none"))
    rows.append(("Estimates below by", best))
    if fix:
        label, weights = fix
        for plane, wanted, parts in zip(conditions.planes, weights.wanted, weights.weights, strict=True):
            holes = ", ".join(f"{m * 1e3:.2f} g at {np.rad2deg(a):.0f} deg" for a, m in parts)
            rows.append((f"Against {label}, {plane.name}", _vector(wanted) + (f": {holes}" if holes else "")))
        before, after = (float(np.nanmax(np.abs(v))) * TO_UM for v in (weights.before, weights.after))
        rows.append(("Largest 1X vector", f"{before:.2f} µm 0-pk, {after:.2f} µm 0-pk predicted after"))
    return rows


def _summary(
    conditions: Conditions, tests: dict[str, LeftOut], best: str, found: dict[str, Estimate], fix: Any
) -> dict[str, Any]:
    return {
        "methods": {
            name: {"vector_rms_gmm": t.vector_rms * G_MM, "magnitude_error_gmm": t.magnitude_error * G_MM,
                   "share_in_90_percent_regions": t.content, "contradicted_labels": list(t.contradicts)}
            for name, t in tests.items()
        },
        "estimates_by": best,
        "unbalance": {c: [_numbers(u, s) for u, s in zip(e.unbalance, e.deviation, strict=True)]
                      for c, e in found.items()},
        "correction": None if fix is None else {
            "condition": fix[0],
            "wanted": [_numbers(u, None) for u in fix[1].wanted],
            "weights": [[{"deg": float(np.rad2deg(a)), "g": m * 1e3} for a, m in w] for w in fix[1].weights],
        },
    }  # fmt: skip


def _numbers(value: complex, deviation: float | None) -> dict[str, float]:
    numbers = {"gmm": abs(value) * G_MM, "deg": float(np.rad2deg(np.angle(value)) % 360)}
    return numbers if deviation is None else numbers | {"sd_gmm": deviation * G_MM}


def _table(conditions: Conditions, found: dict[str, Estimate]) -> str:
    """CSV of the unknown unbalances; sd_gmm is the standard deviation of either component in the worse plane."""
    planes = range(1, len(conditions.planes) + 1)
    lines = [",".join(["id", *(f"U{k}_{unit}" for k in planes for unit in ("gmm", "deg")), "sd_gmm"])]
    for label, one in found.items():
        numbers = [f"{n[key]:.3f}" for u in one.unbalance for n in (_numbers(u, None),) for key in ("gmm", "deg")]
        lines.append(",".join([label, *numbers, f"{one.deviation.max() * G_MM:.3f}"]))
    return "\n".join(lines) + "\n"
