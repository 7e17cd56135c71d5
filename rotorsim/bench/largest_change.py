"""Experiments ranked by the change that a hidden effect makes in their lines.

The hidden machine is run with its effect and without.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rotorsim.discrepancy.blind_test.hide import Truth, scaled
from rotorsim.discrepancy.data.groups import make_layout
from rotorsim.discrepancy.plan.options import Option
from rotorsim.discrepancy.residuals.comparison import THREADS, simulate
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.machine import Machine


def by_size(machine: Machine, twin: Twin, truth: Truth, allowed: Iterable[Option]) -> list[Option]:
    """Experiments by falling size of what the hidden effect changes in their lines."""
    found, points = list(allowed), (truth.point, scaled(truth, 0.0).point)
    twin.assembly  # noqa: B018  (built once, before threads)

    def change(option: Option) -> float:
        trial = option.trial(machine)
        with_it, without = (trial.vector(simulate(twin, trial, point)) for point in points)
        return float(np.linalg.norm((with_it - without)[make_layout([trial]).frequency > 0]))  # zeros are calibrated

    with ThreadPoolExecutor(THREADS) as pool:
        sizes = np.array(list(pool.map(change, found)))
    return [found[i] for i in np.argsort(-sizes, kind="stable")]


__all__ = ["by_size"]
