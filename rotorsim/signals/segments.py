"""Overlapping segments of a record, read in blocks, and their windowed Fourier transforms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr
from scipy.signal.windows import hann

from rotorsim.signals.record_blocks import BLOCK, Values, blocks


def segments(record: xr.Dataset, names: Sequence[str], length: int, hop: int) -> Iterator[Values]:
    """Segments of `length` samples, a new one every `hop` samples; a rest shorter than that is left out."""
    held: Values = {}
    for values in blocks(record, names, max(BLOCK // 2, length)):
        held = {k: np.concatenate((held[k], v)) for k, v in values.items()} if held else values
        start = 0
        while start + length <= len(held[names[0]]):
            yield {k: v[start : start + length] for k, v in held.items()}
            start += hop
        held = {k: v[start:] for k, v in held.items()}


def taper(length: int) -> np.ndarray:
    """Periodic Hann window (length, 1)."""
    return np.asarray(hann(length, sym=False))[:, None]


def transformed(values: np.ndarray, window: np.ndarray) -> np.ndarray:
    """One-sided Fourier transform (frequency, channel) of values (n, channel) without their mean."""
    return np.fft.rfft((values - values.mean(axis=0)) * window, axis=0)
