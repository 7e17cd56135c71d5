"""Index of the data vector: record, channel, frequency and line group of every number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.window import TURNING

BANDS = ((0.0, 90.0), (90.0, 150.0), (150.0, 1e9))
"""Bands [Hz] of excited lines: below, about and above the first natural frequencies of a rig of this size."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Record, channel 0 or 1, frequency [Hz] (0: slow part) and group of every number (n,); `groups` names them."""

    record: np.ndarray
    channel: np.ndarray
    frequency: np.ndarray
    group: np.ndarray
    drift: np.ndarray
    groups: tuple[str, ...]

    def of(self, record: int, channel: int, group: str) -> np.ndarray:
        """Which numbers (n,) are one group's."""
        return (self.record == record) & (self.channel == channel) & (self.group == self.groups.index(group))


EXCITED = ("low band", "resonance", "high band")
NAMES = ("slow", "1X", "2X", "3X", "orders", *EXCITED, "between")


def make_layout(trials: list[Trial]) -> Layout:
    """Layout of the concatenated data vectors of the trials."""
    parts = [_of_trial(t, i) for i, t in enumerate(trials)]
    joined = [np.concatenate([p[k] for p in parts]) for k in range(5)]
    return Layout(joined[0], joined[1], joined[2], joined[3], joined[4], NAMES)


def _of_trial(trial: Trial, number: int) -> tuple[np.ndarray, ...]:
    if trial.orders:
        return _of_vectors(trial, number)
    f = trial.frequencies[1:]
    group = np.full(len(f), NAMES.index("between"))
    for band, name in zip(BANDS, EXCITED, strict=True):
        group[trial.excited[1:] & (f >= band[0]) & (f < band[1])] = NAMES.index(name)
    turns = abs(trial.speed) / (2 * np.pi)
    if abs(trial.speed) > TURNING:
        resolution = f[0]
        order = np.round(f / turns)
        near = (np.abs(f - order * turns) < 0.51 * resolution) & (order >= 1)
        group[near] = NAMES.index("orders")
        for k in (1, 2, 3):
            group[near & (order == k)] = NAMES.index(f"{k}X")
    group = np.concatenate([[0, 0], group, group])
    frequency = np.concatenate([[0.0, 0.0], f, f])
    drift = np.zeros(len(group), bool)
    drift[1] = True
    n = len(group)
    channel = np.repeat([0, 1], n)
    return (np.full(2 * n, number), channel, np.tile(frequency, 2), np.tile(group, 2), np.tile(drift, 2))


def _of_vectors(trial: Trial, number: int) -> tuple[np.ndarray, ...]:
    """Groups of a run-up's vectors are the orders."""
    rows = (trial.spectra.shape[2] - 1) // len(trial.orders)
    names = [NAMES.index(f"{n}X" if n < 4 else "orders") for n in trial.orders]
    group, f = np.repeat(names, rows), trial.frequencies[1:]
    group, frequency = np.concatenate([[0, 0], group, group]), np.concatenate([[0.0, 0.0], f, f])
    drift = np.zeros(len(group), bool)
    drift[1] = True
    channel = np.repeat([0, 1], len(group))
    return (np.full(2 * len(group), number), channel, np.tile(frequency, 2), np.tile(group, 2), np.tile(drift, 2))
