r"""Clock of the recorder of displacements against that of the inputs and the angle: offset and drift of a record.

.. math:: Y_b(f) = S(f)\,e^{-2 \pi i f (\tau + \delta\,t_b)}

Y_b are the measured lines of block b, about t_b from the middle of the window, S those of the machine. The offset tau
is calibrated where a record states how far its clock may be off (attribute `clock`, a standard deviation): at every
point of a fit it has the value that fits that record best, so that records to fit, held out and untouched each have
their own. The drift delta follows from the measured blocks alone. Assumes: the drift within a block is small against
the period of its lines.

Cites: bendat_2010.
"""

from __future__ import annotations

from math import inf

import numpy as np

from rotorsim.base.errors import DataError

LARGEST = 0.02
"""Largest offset [s] that may be stated."""
REACH, STEPS, ROUNDS = 3.0, 241, 4
"""An offset is sought within so many standard deviations, at so many places, and refined so many times."""
LARGEST_DRIFT = 1e-3


def stated_clock(value: object, name: str) -> float:
    """Standard deviation [s] of a record's clock offset; raises DataError for one that is not a short time."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        found = inf
    if not 0 <= found <= LARGEST:
        raise DataError(
            f"{name}: the clock is {value!r}; give the standard deviation of its offset, up to {LARGEST} seconds"
        )
    return found


def delayed(lines: np.ndarray, frequencies: np.ndarray, offset: float) -> np.ndarray:
    """Lines (..., k) of a signal that comes `offset` [s] later."""
    return np.asarray(lines * np.exp(-2j * np.pi * frequencies * offset))


def clock_offset(
    measured: np.ndarray, simulated: np.ndarray, frequencies: np.ndarray, sd: float, sigma: np.ndarray | None
) -> tuple[float, float]:
    """Offset [s] of measured lines (2, k) after simulated ones that fits best, and its standard deviation.

    `sigma` (2, k) is the floor of a real part; without one the stated `sd` [s] only limits the search.
    """
    weight = 1.0 if sigma is None else sigma**-2
    cross = np.conj(simulated) * measured * weight
    prior = 0.0 if sigma is None else sd**-2
    omega = 2 * np.pi * frequencies

    def cost(tau: np.ndarray) -> np.ndarray:
        """Sum of squares, less what does not depend on the offset, at offsets (m,)."""
        return np.asarray(prior * tau**2 - 2 * (np.exp(1j * np.outer(tau, omega)) @ cross.sum(axis=0)).real)

    tried = np.linspace(-REACH * sd, REACH * sd, STEPS)
    tau = float(tried[np.argmin(cost(tried))])
    width = float(tried[1] - tried[0])
    for _ in range(ROUNDS):
        near = tau + width * np.array([-1.0, 0.0, 1.0])
        a, b, c = cost(near)
        bend = a - 2 * b + c
        tau += float(np.clip(0.5 * width * (a - c) / bend, -width, width)) if bend > 0 else 0.0
        width /= 8
    curvature = prior + float(np.sum(omega**2 * np.abs(simulated) ** 2 * weight))
    return tau, curvature**-0.5 if curvature > 0 else sd


def drift_of(blocks: np.ndarray, frequencies: np.ndarray, length: float) -> float:
    """Drift [1] of the clock from block to block (blocks, 2, lines), each `length` [s]; 0 where there is one block."""
    if len(blocks) < 2:
        return 0.0
    cross = np.sum(np.conj(blocks[:-1]) * blocks[1:], axis=(0, 1))
    omega = 2 * np.pi * frequencies
    tried = np.linspace(-LARGEST_DRIFT, LARGEST_DRIFT, STEPS) * length
    best = float(tried[np.argmax((np.exp(1j * np.outer(tried, omega)) @ cross).real)])
    for _ in range(ROUNDS):
        turned = np.exp(1j * omega * best) * cross
        bend = float(np.sum(omega**2 * turned.real))
        best -= float(np.sum(omega * turned.imag)) / bend if bend > 0 else 0.0
    return best / length


def without_drift(blocks: np.ndarray, frequencies: np.ndarray, length: float, drift: float) -> np.ndarray:
    """Blocks (blocks, 2, lines) as a clock without drift would show them, right in the middle of the window."""
    middle = (np.arange(len(blocks)) - 0.5 * (len(blocks) - 1)) * length
    return np.asarray(blocks * np.exp(2j * np.pi * drift * middle[:, None] * frequencies)[:, None, :])
