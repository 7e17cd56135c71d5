"""Checks of a law's matrices and settings, and the sentence about a law for another machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.control.errors import LawError

MOST_STATES = 400


def check_shapes(law: Any) -> None:
    """Raise LawError unless the matrices fit the grid, with two inputs and outputs, and the axes ascend."""
    grid = (law.speeds.size, law.pressures.size)
    n = law.A.shape[-1] if law.A.ndim == 4 else -1
    if law.B.ndim == 4 and law.C.ndim == 4 and (law.B.shape[-1] != 2 or law.C.shape[-2] != 2):
        raise LawError(
            f"law {law.name}: {law.B.shape[-1]} measured and {law.C.shape[-2]} driven channels; "
            "the plant has disc x, y and reference x, y: two each"
        )
    shapes = {"A": (n, n), "B": (n, 2), "C": (2, n), "D": (2, 2), "W": (n, 2)}
    for name, shape in shapes.items():
        found = getattr(law, name).shape
        if found != (*grid, *shape):
            raise LawError(f"law {law.name}: {name} has shape {found}; expected {(*grid, *shape)}")
        if not np.all(np.isfinite(getattr(law, name))):
            raise LawError(f"law {law.name}: {name} holds NaN or infinite numbers; design it again")
    if n > MOST_STATES:
        raise LawError(f"law {law.name}: {n} states; give at most {MOST_STATES}, reduce it")
    for name in ("speeds", "pressures"):
        if np.any(np.diff(getattr(law, name)) <= 0) or not np.all(np.isfinite(getattr(law, name))):
            raise LawError(f"law {law.name}: {name} do not ascend; sort them and give each once")


def check_numbers(law: Any) -> None:
    """Raise LawError for settings out of their range."""
    if not 0 < law.Ts < 1:
        raise LawError(f"law {law.name}: Ts = {law.Ts} s; give a time between 0 and 1 s, e.g. {RIG_SAMPLE:g}")
    if law.refresh < 1 or law.refresh != int(law.refresh):
        raise LawError(f"law {law.name}: refresh = {law.refresh}; give a whole number of samples, 1 or more")
    if not law.limit > 0:
        raise LawError(f"law {law.name}: limit = {law.limit} V; give a positive voltage")
    if not max(map(abs, law.bias)) < law.limit:
        raise LawError(f"law {law.name}: bias = {law.bias} V leaves no room below the limit of {law.limit:g} V")
    if min(law.start, law.average, law.fade) < 0:
        raise LawError(f"law {law.name}: start, average and fade are times; give 0 s or more")


def other_machine(law: str, designed: str, name: str) -> str:
    """A sentence if a law was designed on a model of another machine than `name`; else empty.

    `designed` is name and fingerprint of the model's machine, a space between, or empty.
    """
    designed = designed.rpartition(" ")[0]
    if designed in ("", name):
        return ""
    return (
        f"law {law}: was designed on a model of {designed}, and the machine is {name}: a test of robustness; "
        "design it on a model of this machine to use it there"
    )
