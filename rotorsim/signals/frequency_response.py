r"""Frequency response for a figure, from a record of any length: the lines at which its inputs drive it.

Spectra are summed block by block; H1 and the multiple coherence :math:`\gamma_i^2`, the share of the motion along axis
i that follows linearly from the inputs, are those of `identification.records.frequency_response`, which an
identification starts from. Assumes: noise at the output only, inputs that do not follow the output (no feedback).

Cites: bendat_2010.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import reduce

import numpy as np
import xarray as xr

from identification.records.frequency_response import CrossSpectra, segments_of, transforms
from rotorsim.signals.record_blocks import need, overlapping, sampling_time

LONGEST, LEAST = 2.0, 0.2
"""Longest and shortest segment [s]."""
FEWEST = 4
"""Fewest segments of an average."""
UNDRIVEN = 1e-4
"""Frequencies whose input has less than this share of the largest power are left out."""
AT_REST = 0.01
"""Inputs with less than this share of the power of the strongest at a frequency count as at rest there."""
LINES, WEAKEST_LINE = 0.5, 1e-3
"""Inputs that act at less than the first share of the frequencies are made of lines, of the second share or more of the
strongest line's power."""
SINGULAR = 1e-3
"""Inputs whose spectra leave less than this share independent cannot be separated."""


@dataclass(frozen=True)
class Transfer:
    """Frequency response `H` (frequency, output, input) [m per unit of the input], NaN where undriven, at
    `frequency` [Hz]; `coherence` (frequency, output), None for a single average; `inputs` are the axes driven,
    `count` the averages."""

    frequency: np.ndarray
    H: np.ndarray
    coherence: np.ndarray | None
    inputs: tuple[int, ...]
    input_name: str
    output_name: str
    count: int
    together: bool = False


def welch_transfer(record: xr.Dataset, inputs: tuple[int, ...], drive: str, output: str, most: float) -> Transfer:
    """H1 with Hann segments that overlap by half.

    Parameters
    ----------
    record : Dataset
        With `drive` and `output` (time, axis), evenly sampled; read in blocks.
    inputs : tuple of int
        Axes of `drive` that move.
    drive, output : str
        Names of variables.
    most : float
        Highest frequency kept [Hz].

    Returns
    -------
    Transfer
        Test: ``test_signals.py::test_a_known_two_by_two_system_is_found_with_its_noise_in_the_coherence``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.welch_transfer(record, (0, 1), "reference", "disc", 500.0).H.shape[1:]
    (2, 2)
    """
    dt, n = sampling_time(record), record.sizes["time"]
    length = round(min(LONGEST, max(LEAST, n * dt / 8)) / dt)
    reason = f"The record of {n * dt:.2g} s is too short: a frequency response takes {FEWEST} averages of {LEAST:g} s."
    need(n >= FEWEST / 2 * length + length // 2, reason)
    window = segments_of(length, dt)
    parts = (
        CrossSpectra.of(*(transforms(window, part[k], "constant") for k in (drive, output)))
        for part in overlapping(record, (drive, output), length, window.hop)
    )
    sums = reduce(operator.add, parts)
    return solve(
        sums.at(np.arange(length // 2 + 1), np.array(inputs)), np.fft.rfftfreq(length, dt), inputs, drive, output, most
    )


def solve(
    sums: CrossSpectra, frequency: np.ndarray, inputs: tuple[int, ...], drive: str, output: str, most: float
) -> Transfer:
    """H1 and coherence from summed spectra; inputs that move together are reduced to the first."""
    kept = np.flatnonzero((frequency > 0) & (frequency <= most))
    sums, frequency = sums.at(kept), frequency[kept]
    together = len(inputs) > 1 and _together(sums.uu)
    if together:
        sums, inputs = sums.at(np.arange(len(kept)), slice(1)), inputs[:1]
    H = np.full((len(frequency), sums.yu.shape[1], len(inputs)), np.nan, complex)
    active = driven(np.real(np.einsum("fii->fi", sums.uu)))
    for columns in {tuple(row) for row in active.tolist() if any(row)}:
        rows, c = np.flatnonzero(np.all(active == columns, axis=1)), np.flatnonzero(columns)
        H[np.ix_(rows, np.arange(H.shape[1]), c)] = sums.at(rows, c).h1()[0]
    explained = sums.explained(np.nan_to_num(H))
    coherence = np.clip(explained / np.maximum(sums.yy, 1e-300), 0, 1) if sums.count > len(inputs) else None
    return Transfer(frequency, H, coherence, inputs, drive, output, sums.count, together)


def driven(power: np.ndarray) -> np.ndarray:
    """Which inputs act at which frequency, from their powers (frequency, input); of lines, only their tops."""
    active = (power > UNDRIVEN * power.max(axis=0)) & (power > AT_REST * power.max(axis=1, keepdims=True))
    if active.mean() < LINES:
        padded = np.pad(power, ((1, 1), (0, 0)))
        active &= (power >= padded[:-2]) & (power >= padded[2:]) & (power > WEAKEST_LINE * power.max(axis=0))
    return active


def _together(uu: np.ndarray) -> bool:
    """Whether two inputs cannot be separated at most frequencies at which both act."""
    power = np.real(np.einsum("fii->fi", uu))
    both = driven(power).all(axis=1)
    share = np.abs(np.linalg.det(uu[both])) / power[both].prod(axis=1)
    return bool(both.any() and np.median(share) < SINGULAR)


def peak_of(transfer: Transfer, output: int, column: int) -> tuple[float, float]:
    """Frequency [Hz] and size of the largest value of one element, among frequencies of coherence above one half."""
    size = np.abs(transfer.H[:, output, column])
    if transfer.coherence is not None:
        size = np.where(transfer.coherence[:, output] > 0.5, size, np.nan)
    if not np.isfinite(size).any():
        return float("nan"), float("nan")
    i = int(np.nanargmax(size))
    return float(transfer.frequency[i]), float(size[i])
