"""Sensitivities on disk: what a diagnosis has computed is not computed again, by itself or by the next one."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from reynolds.jit import cache_root
from rotorsim.discrepancy.comparison import Comparison, Point
from rotorsim.discrepancy.knobs import Knob


def key_of(comparison: Comparison, point: Point, knob: Knob) -> str:
    """Name of a column: plant with its kernels, inputs, place in parameter space, knob.

    Speed, pressure and angle are rounded to what a sensitivity that a search starts from needs to know of them, so that
    the same campaign, recorded again, finds its columns.
    """
    digest = hashlib.sha256()
    digest.update(comparison.twin.equipped[0].hash.encode())
    digest.update(str(comparison.twin.assembly.module.__name__).encode())
    for trial in comparison.trials:
        digest.update(np.round(trial.used[:, 2:], 9).tobytes())
        turned = np.round([np.cos(trial.angle), np.sin(trial.angle)], 1) + 0.0
        place = (round(trial.speed, 1), round(trial.pressure, -3), *turned.tolist())
        digest.update(repr((place, trial.start, trial.length, trial.blocks, trial.orders)).encode())
    digest.update(repr(sorted((k.name, v) for k, v in point.values.items())).encode())
    digest.update(repr(sorted(point.fixed.items())).encode())
    digest.update(repr((knob.key, knob.step)).encode())
    return digest.hexdigest()[:32]


def columns(
    comparison: Comparison, point: Point, knobs: Sequence[Knob], say: Callable[[], None] | None = None
) -> np.ndarray:
    """As `Comparison.jacobian`, but in metres (n, k), kept on disk column by column."""
    folder = cache_root() / "sensitivities"
    folder.mkdir(parents=True, exist_ok=True)
    here: np.ndarray | None = None
    out: list[np.ndarray] = []
    for knob in knobs:
        if knob.key in comparison.directions:
            out.append(comparison.directions[knob.key])
            continue
        path = folder / f"{key_of(comparison, point, knob)}.npy"
        plain = Knob(knob.key, knob.step, low=knob.low, high=knob.high)
        column = _read(path, len(comparison.measured))
        if column is None:
            here = comparison.predict(point) if here is None else here
            column = comparison.column(point, plain, here, say) * comparison.sigma
            _write(path, column)
        share = np.array([knob.share(t.speed, t.pressure) for t in comparison.trials])
        out.append(column * (share[comparison.layout.record] if knob.trend else 1.0))
    return np.column_stack(out) if out else np.zeros((len(comparison.measured), 0))


def _read(path: Path, n: int) -> np.ndarray | None:
    try:
        column = np.load(path, allow_pickle=False)
    except (OSError, ValueError):
        return None
    return np.asarray(column, float) if column.shape == (n,) else None


def _write(path: Path, column: np.ndarray) -> None:
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    with part.open("wb") as file:
        np.save(file, column)
    os.replace(part, path)
