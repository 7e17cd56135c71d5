"""Disk cache of sensitivities, shared between diagnoses.

They are taken at rounded speeds, pressures and angles, so that the same campaign, recorded again, finds them, and so
that they are the same whoever computed them first. A search starts from them and updates those of its best forms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rotorsim.base.cache import Cache, in_cache
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.residuals.comparison import ParameterPoint, TwinComparison


def rounded(trial: Trial) -> Trial:
    """Trial at rounded speed, pressure and angle, which repeated recordings share."""
    rows = np.round(trial.rows, 9)
    if not trial.orders:
        rows[:, 0], rows[:, 1] = np.round(rows[:, 0], 1), np.round(rows[:, 1], -3)
    # a clock's offset follows from measured lines, of which sensitivities know nothing
    angle = float(np.round(trial.angle, 1) % 6.3)
    return replace(trial, rows=rows, pressure=float(rows[0, 1]), angle=angle, clock=0.0)


@dataclass(eq=False)
class SensitivityColumns:
    """Sensitivity columns of a comparison at rounded points; `here` caches the reference responses."""

    comparison: TwinComparison
    here: list[tuple[ParameterPoint, np.ndarray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        c = self.comparison
        self.rough = TwinComparison(c.twin, [rounded(t) for t in c.trials], c.threads)
        self.cache = Cache(in_cache("sensitivities"))

    def columns(
        self, point: ParameterPoint, parameters: Sequence[FitParameter], progress: Callable[[], None] | None = None
    ) -> np.ndarray:
        """As `TwinComparison.jacobian`, but in metres (n, k), kept on disk column by column."""
        comparison = self.comparison
        share = {k: np.array([k.share(t.speed, t.pressure) for t in comparison.trials]) for k in parameters if k.trend}
        out = []
        for parameter in parameters:
            if parameter.key in comparison.directions:
                out.append(comparison.directions[parameter.key])
                continue
            column = self._column(
                point, FitParameter(parameter.key, parameter.step, low=parameter.low, high=parameter.high), progress
            )
            out.append(column * (share[parameter][comparison.layout.record] if parameter.trend else 1.0))
        return np.column_stack(out) if out else np.zeros((len(comparison.measured), 0))

    def _column(
        self, point: ParameterPoint, parameter: FitParameter, progress: Callable[[], None] | None
    ) -> np.ndarray:
        key = self.rough.key(point, self.rough.twin, parameter.key, parameter.step, parameter.low, parameter.high)
        shape = self.comparison.measured.shape
        return self.cache.array(key, shape, lambda: self.rough.column(point, parameter, self._at(point), progress))

    def _at(self, point: ParameterPoint) -> np.ndarray:
        """The response at a point; options that are held for an effect that is off change nothing."""
        slots, own = self.comparison.twin.slots, self.comparison.twin.machine.effects
        at_work = {name for name, table in slots.items() if table < len(own.get(name, ()))}
        fixed = {key: v for key, v in point.fixed.items() if key.split(".")[0] in at_work or point.values}
        same = replace(point, fixed=fixed)
        known = next((y for p, y in self.here if (p.values, p.fixed) == (same.values, same.fixed)), None)
        if known is None:
            known = self.rough.predict(same)
            self.here.append((same, known))
        return known


def columns(
    comparison: TwinComparison,
    point: ParameterPoint,
    parameters: Sequence[FitParameter],
    progress: Callable[[], None] | None = None,
) -> np.ndarray:
    """Sensitivity columns of a comparison at one point."""
    return SensitivityColumns(comparison).columns(point, parameters, progress)
