"""Stretches of prefiltered records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.records.prefilter import Signals


def cut(signals: Signals, at: slice) -> Signals:
    """The samples of a slice, without a rest of their own; regressors are made orthonormal again."""
    return replace(
        signals, u=signals.u[at], y=signals.y[at], Q=np.linalg.qr(signals.Q[at])[0], rest=0,
        truth=None if signals.truth is None else signals.truth[at],
        pins=None if signals.pins is None else signals.pins[at],
        acting=None if signals.acting is None else signals.acting[at],
    )  # fmt: skip
