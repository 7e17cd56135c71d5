"""Whether records can be this machine's at all: what re-calibration leaves of the response."""

from __future__ import annotations

import numpy as np

from rotorsim.discrepancy.comparison import Comparison
from rotorsim.discrepancy.groups import EXCITED
from rotorsim.errors import DataError

UNLIKE, FOREIGN = 0.5, 0.8
"""Shares of the response that stay unexplained: from the first nothing is named, from the second it is refused."""


def unexplained(comparison: Comparison, fitted: np.ndarray) -> float:
    """Share of the measured response to excitation that a prediction (n,) [m] does not explain; 0 without excitation.

    Orders of the shaft do not count: a missing force may well be larger than what the unbalance does.
    """
    layout = comparison.layout
    excited = np.isin(layout.group, [layout.groups.index(band) for band in EXCITED])
    y, f = comparison.measured[excited], fitted[excited]
    return float(np.linalg.norm(y - f)) / max(float(np.linalg.norm(y)), 1e-300)


def check_after(comparison: Comparison, fitted: np.ndarray) -> list[str]:
    """Sentences on a machine that is hardly alike; raises DataError where the records cannot be this machine's."""
    share = unexplained(comparison, fitted)
    if share < UNLIKE:
        return []
    if share > FOREIGN:
        raise DataError(
            f"records: even re-calibrated, the machine file leaves {100 * share:.0f} % of the response unexplained; "
            "are they of this machine, and are the machine file, speed and pressure right?"
        )
    return [
        f"re-calibrated, the machine file leaves {100 * share:.0f} % of the response unexplained: nothing is named; "
        "check that the records are of this machine"
    ]
