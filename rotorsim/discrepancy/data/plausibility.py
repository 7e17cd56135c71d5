"""Plausibility of records for this machine: share of the response unexplained after re-calibration."""

from __future__ import annotations

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.groups import EXCITED
from rotorsim.discrepancy.residuals.comparison import TwinComparison

UNLIKE, FOREIGN = 0.5, 0.8
"""Shares of the response that stay unexplained: from the first nothing is named, from the second it is refused."""


def unexplained(comparison: TwinComparison, fitted: np.ndarray) -> float:
    """Fraction of the measured response to excitation not explained by a prediction (n,) [m]; 0 if unexcited.

    Orders of the shaft do not count: a missing force may well be larger than what the unbalance does.
    """
    layout = comparison.layout
    excited = np.isin(layout.group, [layout.groups.index(band) for band in EXCITED])
    y, f = comparison.measured[excited], fitted[excited]
    return float(np.linalg.norm(y - f)) / max(float(np.linalg.norm(y)), 1e-300)


def check_after(comparison: TwinComparison, fitted: np.ndarray) -> list[str]:
    """Warnings for a poorly matching machine; raises DataError if the records cannot be this machine's."""
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
