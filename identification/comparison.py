"""Several models on one held-out record: fits, modes and static gains in one table."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ModelError
from identification.local.goodness import ceiling, fit_of, noise_free_fit, project
from identification.local.identify import of_stretches
from identification.local.models import LinearModel
from identification.local.result import Identification
from identification.lpv.model import LpvModel
from identification.lpv.surfaces import SAME
from identification.records.prefilter import Prefilter
from identification.records.stretches import Signals
from identification.threads import one_thread

if TYPE_CHECKING:
    import xarray as xr

SHOWN = 2
"""Modes of a model in the table."""


@dataclass(frozen=True, eq=False)
class Compared:
    """One model on the record: number of states, fit and noise_free_fit (2,) as shares of one, wn [rad/s] and zeta of
    its oscillating modes, static gain (2, 2) [m/V]; `remark` where the model is of another operating point.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.compare_models({"lpv": lpv}, record).rows[0].fit.shape
    (2,)
    """

    name: str
    order: int
    fit: np.ndarray
    noise_free_fit: np.ndarray | None
    wn: np.ndarray
    zeta: np.ndarray
    static_gain: np.ndarray
    remark: str = ""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Models on one record, best mean fit first, and the highest fit (2,) that its noise allows.

    Examples
    --------
    >>> import rotorsim as rs
    >>> print(rs.identification.compare_models({"lpv": lpv}, record).report().split()[0])
    model
    """

    rows: tuple[Compared, ...]
    ceiling: np.ndarray

    def report(self) -> str:
        """The table as a text that a person can read."""
        table = [("model", "states", "fit x, y %", "modes Hz", "damping ratios", "gain xx, yy um/V")]
        for row in self.rows:
            first = slice(0, SHOWN)
            cells = (
                _several(100 * row.fit, ".1f"), _several(row.wn[first] / (2 * np.pi), ".2f"),
                _several(row.zeta[first], ".4f"), _several(1e6 * np.diag(row.static_gain), ".3f"),
            )  # fmt: skip
            table.append((row.name, str(row.order), *cells))
        table.append(("noise ceiling", "", _several(100 * self.ceiling, ".1f"), "", "", ""))
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
        return "\n".join([*lines, *(f"{row.name}: {row.remark}" for row in self.rows if row.remark)])


@one_thread
def compare_models(
    models: Mapping[str, Identification | LinearModel | LpvModel],
    record: xr.Dataset,
    steady: xr.Dataset | None = None,
    settings: Prefilter | None = None,
) -> Comparison:
    """Hold models against a record that none of them was made of.

    Parameters
    ----------
    models : mapping
        By name results of `identify`, linear models, or parameter-varying ones, which are frozen at the record's
        operating point.
    record : Dataset
        Record of the schema, held out; gaps are left out as in `identify`.
    steady, settings
        As for `identify`.

    Raises
    ------
    ModelError
        If there are no models, or one does not map two references to two displacements.
    SchemaError

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = {"Model 3": rs.identify(record, 3), "Model 1": rs.identify(record, 1)}
    >>> rs.identification.compare_models(found, record).rows[0].name
    'Model 3'
    """
    if not models:
        raise ModelError("compare_models: no models; give results of identify or models by name")
    signals = of_stretches(record, steady, settings)[1]
    rows = [_compared(name, one, signals) for name, one in models.items()]
    best = sorted(rows, key=lambda row: -float(np.mean(row.fit)))
    return Comparison(tuple(best), ceiling(project(signals.y, signals.Q), signals.noise))


def _compared(name: str, given: Any, signals: Signals) -> Compared:
    model, remark = _frozen(name, given, signals)
    if (model.B.shape[1], model.C.shape[0]) != (2, 2):
        raise ModelError(
            f"compare_models: {name} has {model.B.shape[1]} inputs and {model.C.shape[0]} outputs; give models from "
            "references x, y to disc x, y"
        )
    if not model.stable:
        raise ModelError(f"compare_models: {name} is unstable and cannot be simulated over a record; leave it out")
    modes = (given.wn, given.zeta) if isinstance(given, Identification) else (model.wn, model.zeta)
    return Compared(
        name, model.order, fit_of(model, signals), noise_free_fit(model, signals), *modes, model.static_gain, remark
    )


def _frozen(name: str, given: Any, signals: Signals) -> tuple[LinearModel, str]:
    """The linear model at the record's operating point, and a remark where it is not made for that point."""
    if isinstance(given, LpvModel):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = given.at(signals.speed, signals.pressure)
        return model, "extrapolated to the record's operating point" if model.extrapolated else ""
    model = given.model if isinstance(given, Identification) else given
    if not isinstance(model, LinearModel):
        raise ModelError(f"compare_models: {name} is a {type(given).__name__}; give results of identify or models")
    if "pin_x" in model.outputs:
        raise ModelError(f"compare_models: {name} is a model of the actuators; give models of the disc")
    apart = np.abs([model.speed - signals.speed, model.pressure - signals.pressure])
    return model, "made at another operating point than the record's" if np.any(apart > SAME) else ""


def _several(values: np.ndarray, form: str) -> str:
    return ", ".join(format(float(value), form) for value in values)
