"""What speaks against a further effect next to another: their responses cancel, or it explains the other's form error.

A model of an effect is never exact: damping, a delay of the recorder, the shape of the effect itself leave a share of
its own response in the same line groups. What is left and is small against what the effect does there, group by group,
is measured as that form error and gets no name of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.residuals.localise import flagged, table

CANCEL = 0.5
"""Responses cancel where their sum is below this share of the largest: of two equal ones, a cosine below -0.87."""
FORM = 0.1
"""Share of its own response that an effect's form may leave in a group. Chosen, not measured: a remainder of .4 % in
energy, as a bow in records of another program left, is 0.06 in amplitude."""
OTHERS = 0.02
"""Share of its largest response in a record's channel that an effect's form may leave in any group: of forces that are
not linear, such as those of a crack, a model has the strongest harmonics right. Chosen as FORM was."""


def cancel(responses: Sequence[np.ndarray]) -> bool:
    """Whether responses (n,) of several effects nearly cancel."""
    if len(responses) < 2:
        return False
    largest = max(float(np.linalg.norm(r)) for r in responses)
    return float(np.linalg.norm(np.sum(responses, axis=0))) < CANCEL * largest


def within_form_error(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> bool:
    """Whether what an effect leaves is small against its own response in every group that is beyond its floor.

    Where the group itself has little of that response, the largest one in the same channel of the record counts.
    `before` and `after` are whitened residuals (n,) without the effect and with it.
    """
    left = flagged(table(comparison, after))
    own = {(f.number, f.channel, f.group): f.rms for f in table(comparison, before - after)}
    largest: dict[tuple[int, str], float] = {}
    for (number, channel, _), size in own.items():
        largest[number, channel] = max(largest.get((number, channel), 0.0), size)
    return all(
        f.rms < max(FORM * own[f.number, f.channel, f.group], OTHERS * largest[f.number, f.channel]) for f in left
    )
