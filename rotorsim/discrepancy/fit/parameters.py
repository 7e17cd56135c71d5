"""Fit parameters of a diagnosis: changes of a twin's numbers, constant or as smooth trends over the operating point.

A parameter's value adds to one number of the setting, alike at every operating point or as a smooth trend over
pressure or speed.

Keys of numbers: 'effect.table.parameter' adds to that parameter; 'effect.table.amplitude~phase.c' (or .s) adds to
amplitude times cosine (sine) of the phase, so that a fit is linear where the physics is; names of `twin.FACTORS` are
relative changes, 'bearing.i.kx' and '.cx' those of a bearing's compliance and loss (`twin.of_bearing`); DIRECTIONS
shift the data and not the plant.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.effects import Effect

STEPS = 10.0
"""Prior standard deviation of an effect's size in steps; one moves a response by a few tenths of a micrometre."""
REFERENCE_PRESSURE = 0.5e6
REFERENCE_SPEED = 2 * np.pi * 100
DIRECTIONS = ("offset_x", "offset_y", "mesh", "law")
"""Keys that shift the data and not the plant: the sensors' zeros [m], the solver's mesh and the injectors' law [1]."""


@dataclass(frozen=True)
class FitParameter:
    """Fit parameter: key, finite-difference step, prior standard deviation, limits of the change."""

    key: str
    step: float
    sd: float = 1e300
    low: float = -1e300
    high: float = 1e300
    trend: str = ""
    usual: float = 0.0
    """Prior standard deviation of an effect's size in the odds; `STEPS` steps where none is stated."""

    @property
    def prior_size(self) -> float:
        """Standard deviation of the size of an effect before any record, for the odds."""
        return self.usual or STEPS * self.step

    @property
    def name(self) -> str:
        """Unique name."""
        return f"{self.key} x {self.trend}" if self.trend else self.key

    def share(self, speed: float, pressure: float) -> float:
        """Factor of the parameter's value at an operating point [rad/s], [Pa]; 1 without a trend."""
        if self.trend == "pressure":
            return pressure / REFERENCE_PRESSURE - 1
        if self.trend == "speed":
            return (speed / REFERENCE_SPEED) ** 2 - 0.35
        return 1.0


Values = Mapping[FitParameter, float]


def contributions(
    values: Values, speed: float, pressure: float, known: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Sum of the changes by key at an operating point, on top of those `known` of a record."""
    out: dict[str, float] = dict(known or {})
    for parameter, value in values.items():
        out[parameter.key] = out.get(parameter.key, 0.0) + value * parameter.share(speed, pressure)
    return out


def setting(twin: Twin, sums: Mapping[str, float], fixed: Mapping[str, float] | None = None) -> dict[str, float]:
    """Absolute values for `Twin.run` from changes; `fixed` values are absolute and applied first."""
    out: dict[str, float] = dict(fixed or {})
    turned: dict[tuple[str, str, str], complex] = {}
    for key, change in sums.items():
        if key in DIRECTIONS:
            continue
        if "~" in key:
            path, part = key[:-2], key[-1]
            owner, _, pair = path.rpartition(".")
            amplitude, _, phase = pair.partition("~")
            index = (owner, amplitude, phase)
            turned[index] = turned.get(index, 0) + change * (1 if part == "c" else 1j)
        elif "." in key and not key.startswith("bearing."):
            name, table, parameter = key.split(".")
            out[key] = out.get(key, float(getattr(twin.effect(name, int(table)), parameter))) + change
        else:
            out[key] = out.get(key, 0.0) + change
    for (owner, amplitude, phase), vector in turned.items():
        name, table = owner.split(".")
        own = twin.effect(name, int(table))
        n = out.get(f"{owner}.{amplitude}_lobes", lobes(own, amplitude))
        total = wave(own, amplitude, phase, n) + vector
        out[f"{owner}.{amplitude}"] = float(abs(total))
        out[f"{owner}.{phase}"] = float(np.angle(total)) / n
    return out


def lobes(effect: Effect, amplitude: str) -> float:
    """Number of lobes if the phase of an amplitude is a lobe's position; 1 if it is the phase of a wave."""
    return float(getattr(effect, f"{amplitude}_lobes", 1.0))


def wave(effect: Effect, amplitude: str, phase: str, n: float = 1.0) -> complex:
    """Complex amplitude (cosine + i sine) of a wave from its amplitude and n times its phase."""
    return complex(getattr(effect, amplitude) * np.exp(1j * n * getattr(effect, phase)))


def within(parameters: Iterable[FitParameter], values: np.ndarray) -> np.ndarray:
    """Values (k,) clipped to the limits of the fit parameters."""
    pairs = [(k.low, k.high) for k in parameters]
    return np.clip(values, [p[0] for p in pairs], [p[1] for p in pairs])
