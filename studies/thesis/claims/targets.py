"""Performance targets of identification on the virtual rig, and the values reached in a study."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.study.identification_vs_physics import Study, errors


@dataclass(frozen=True)
class FigureTarget:
    """A figure, its value here, its bound, whether it is met, and a remark."""

    figure: str
    value: float
    bound: float
    unit: str
    met: bool
    remark: str = ""


def targets(study: Study) -> list[FigureTarget]:
    """All figures that the study's records yield."""
    return [*_fits(study), *_knee(study), *_runout(study), *_physics(study), *_surfaces(study)]


def _at_most(figure: str, value: float, bound: float, unit: str, remark: str = "") -> FigureTarget:
    return FigureTarget(figure, float(value), bound, unit, bool(value <= bound), remark)


def _fits(study: Study) -> list[FigureTarget]:
    known, rows = [p for p in study.points if p.validation], []
    for kind in ("2", "3") if known else ():
        gap = 100 * np.array([p.ceiling - p.validation[kind] for p in known])
        within = int(np.sum(gap.mean(axis=1) <= 3))
        rows.append(_at_most(f"validation fit below the noise ceiling, Model {kind}, mean of x and y, largest",
                             gap.mean(axis=1).max(), 3.0, "points",
                             f"{within} of {len(known)} records within; mean {gap.mean():.2f}"))  # fmt: skip
    best = [100 * np.mean(fits["noise ceiling"] - fits["order 8"]) for _, fits in study.sweep]
    rows.append(_at_most("the same of a black-box model of order 8, largest", max(best), 3.0, "points",
                         "what is left there no linear model with constant coefficients follows"))  # fmt: skip
    return rows


def _knee(study: Study) -> list[FigureTarget]:
    mean = [{name: 100 * float(np.mean(f)) for name, f in fits.items()} for _, fits in study.sweep]
    rise, after = min(m["order 6"] - m["order 5"] for m in mean), max(m["order 8"] - m["order 6"] for m in mean)
    return [
        FigureTarget("knee: gain of fit from order 5 to 6, smallest", rise, 1.0, "points", rise >= 1.0, "at least"),
        _at_most("knee: gain of fit from order 6 to 8, largest", after, 1.0, "points"),
    ]


def _runout(study: Study) -> list[FigureTarget]:
    rows = []
    for rpm in (5000.0, 6000.0):
        at = [p for p in study.points if p.runout and abs(p.source.speed * TO_RPM - rpm) < 1]
        for_all = [p.runout for p in at if p.runout is not None]
        if for_all:
            before, after = (TO_UM * max(float(pair[i].max()) for pair in for_all) for i in (0, 1))
            rows.append(_at_most(f"extended runout at {rpm:.0f} rpm after the filter, largest of all pressures", after,
                                 0.5, "um", f"{before:.2f} um before, 0-pk"))  # fmt: skip
    return rows


def _physics(study: Study) -> list[FigureTarget]:
    rows = []
    for kind in ("2", "3"):
        found = errors(study, kind)
        for key, name, bound in (("wn", "frequencies", 1.0), ("zeta", "damping ratios", 15.0)):
            worst = 100 * np.abs(found[key]).max(axis=1)
            rows.append(_at_most(f"{name} against the plant's eigenvalues, Model {kind}, largest error", worst.max(),
                                 bound, "%", f"{int(np.sum(worst <= bound))} of {len(worst)} points within; mean error "
                                 f"{100 * found[key].mean():+.2f} %"))  # fmt: skip
    return rows


def _surfaces(study: Study) -> list[FigureTarget]:
    ratio = study.lpv.rms_hold_out / study.lpv.rms_identification
    worst = study.lpv.parameters[int(np.argmax(ratio))]
    rows = [_at_most("RMS of surfaces at points between the grid's over RMS at the grid's, largest of the parameters",
                     float(np.max(ratio)), 2.0, "", f"median {np.median(ratio):.2f}; largest for {worst}")]  # fmt: skip
    if {"plain, grid", "plain, between"} <= study.distances.keys():
        share = study.distances["plain, between"].mean() / study.distances["plain, grid"].mean()
        rows.append(_at_most("the same of the distance of frequency responses", float(share), 2.0, ""))
    return rows
