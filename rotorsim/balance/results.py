"""Results of a balancing as a table for people, as plain numbers and as CSV."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from rotorsim.balance.unbalance import Assessment
from rotorsim.base.constants import TO_UM

G_MM = 1e6
"""g mm in a kg m."""


def _vector(value: complex) -> str:
    return f"{abs(value) * G_MM:.2f} g mm at {np.rad2deg(np.angle(value)) % 360:.0f} deg"


def result_rows(found: Assessment) -> list[tuple[str, str]]:
    """Rows (what, result) of a table for people."""
    conditions, tests, fix = found.conditions, found.tests, found.correction
    rows = [("Conditions", f"{int(conditions.known.sum())} with known unbalance, {len(found.estimates)} without")]
    for name, test in tests.items():
        rows.append((
            name.capitalize(),
            f"every label from the others: vector error {test.vector_rms * G_MM:.2f} g mm rms a plane, magnitude "
            f"{test.magnitude_error * G_MM:.2f} g mm; 90 % regions hold {100 * test.content:.0f} %",
        ))  # fmt: skip
    if tests:
        doubtful = tests[found.method].contradicts
        rows.append(("Labels that the others contradict", ", ".join(doubtful) or "none"))
    else:
        rows.append(("Errors", "not known: too few records with known unbalance to leave one out"))
    if found.left_out:
        rows.append(("Physical model", f"left out: {found.left_out}"))
    rows.append(("Estimates by", found.method))
    if fix is not None:
        for plane, wanted, parts in zip(conditions.planes, fix.wanted, fix.weights, strict=True):
            holes = ", ".join(f"{m * 1e3:.2f} g at {np.rad2deg(a):.0f} deg" for a, m in parts)
            rows.append((f"Against {found.corrected}, {plane.name}", _vector(wanted) + (f": {holes}" if holes else "")))
        before, after = (float(np.nanmax(np.abs(v))) * TO_UM for v in (fix.before, fix.after))
        rows.append(("Largest 1X vector", f"{before:.2f} µm 0-pk, {after:.2f} µm 0-pk predicted after"))
    return rows


def summary(found: Assessment) -> dict[str, Any]:
    """The results as plain numbers, unbalances in g mm."""
    fix = found.correction
    return {
        "methods": {
            name: {"vector_rms_gmm": t.vector_rms * G_MM, "magnitude_error_gmm": t.magnitude_error * G_MM,
                   "share_in_90_percent_regions": t.content, "contradicted_labels": list(t.contradicts)}
            for name, t in found.tests.items()
        },
        "estimates_by": found.method,
        "physical_model_left_out": found.left_out,
        "unbalance": {c: [_numbers(u, s) for u, s in zip(e.unbalance, e.deviation, strict=True)]
                      for c, e in found.estimates.items()},
        "correction": None if fix is None else {
            "condition": found.corrected,
            "wanted": [_numbers(u, None) for u in fix.wanted],
            "weights": [[{"deg": float(np.rad2deg(a)), "g": m * 1e3} for a, m in w] for w in fix.weights],
        },
    }  # fmt: skip


def _numbers(value: complex, deviation: float | None) -> dict[str, Any]:
    numbers = {"gmm": abs(value) * G_MM, "deg": float(np.rad2deg(np.angle(value)) % 360)}
    return numbers if deviation is None else numbers | {"sd_gmm": deviation * G_MM if isfinite(deviation) else None}


def estimate_table(found: Assessment) -> tuple[list[str], list[tuple[str, ...]]]:
    """Heads and rows of the unknown unbalances, with the standard deviation of either component, for people."""
    units = ("[g mm]", "at [deg]", "sd [g mm]")
    heads = ["record", *(f"{plane.name} {unit}" for plane in found.conditions.planes for unit in units)]
    rows = []
    for label, one in found.estimates.items():
        numbers = [_numbers(u, float(s)) for u, s in zip(one.unbalance, one.deviation, strict=True)]
        rows.append((label, *("" if n[key] is None else f"{n[key]:{form}}" for n in numbers for key, form in
                              (("gmm", ".2f"), ("deg", ".0f"), ("sd_gmm", ".2f")))))  # fmt: skip
    return heads, rows


def unbalance_csv(found: Assessment) -> str:
    """CSV of the unknown unbalances; sd_gmm is the standard deviation of either component in the worse plane."""
    planes = range(1, len(found.conditions.planes) + 1)
    lines = [",".join(["id", *(f"U{k}_{unit}" for k in planes for unit in ("gmm", "deg")), "sd_gmm"])]
    for label, one in found.estimates.items():
        numbers = [f"{n[key]:.3f}" for u in one.unbalance for n in (_numbers(u, None),) for key in ("gmm", "deg")]
        worst = float(one.deviation.max()) * G_MM
        lines.append(",".join([label, *numbers, f"{worst:.3f}" if isfinite(worst) else ""]))
    return "\n".join(lines) + "\n"
