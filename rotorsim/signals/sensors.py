"""Sensor errors: offset, noise and spectrum of measured minus true displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.missing import need
from rotorsim.signals.record_blocks import blocks
from rotorsim.signals.spectrum import Spectrum, spectrum_of


@dataclass(frozen=True)
class Difference:
    """Measured less true displacement of the disc, per axis [m]: mean `offset`, `rms` about it, `peak_to_peak`; its
    `spectrum`."""

    offset: np.ndarray
    rms: np.ndarray
    peak_to_peak: np.ndarray
    spectrum: Spectrum


def difference_of(record: xr.Dataset, most: float) -> Difference:
    """Compare `disc_measured` with `disc`; frequencies up to `most` [Hz]. Raises MissingError without both."""
    need("disc" in record and "disc_measured" in record, "The record has not both the true and the measured motion.")
    count, total, squares = 0, np.zeros(2), np.zeros(2)
    least, largest = np.full(2, np.inf), np.full(2, -np.inf)
    for block in blocks(record, ("disc", "disc_measured")):
        d = block["disc_measured"] - block["disc"]
        count, total, squares = count + len(d), total + d.sum(axis=0), squares + (d**2).sum(axis=0)
        least, largest = np.minimum(least, d.min(axis=0)), np.maximum(largest, d.max(axis=0))
    need(bool(np.any(largest > least) or np.any(total != 0)), "The sensors show the true motion without any error.")
    mean = total / count
    rms = np.sqrt(np.maximum(squares / count - mean**2, 0))
    return Difference(mean, rms, largest - least, spectrum_of(record, "disc_measured", most, less="disc"))
