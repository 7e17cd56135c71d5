"""Identification result: model, parameters with standard deviations, fits, residual tests, remarks of the fit."""

from dataclasses import dataclass, field, replace

import numpy as np

from identification.local.bias import Bias, Interval
from identification.local.confidence import ResidualTests
from identification.local.greybox import DELAYED, RATED, dead_times
from identification.local.models import LinearModel

SIGNIFICANT = 2.0
"""Standard deviations from zero at which a parameter counts as significant."""


@dataclass(frozen=True, eq=False)
class Identification:
    """Result of `identify`.

    kind '1', '2', '2-rate', '3', '3-delay' (Model 3 with dead times), 'actuator', 'blackbox' or the name of your own
    structure; parameters by name as (value, sd) in SI, sd NaN at a bound; covariance (q, q) of `theta`; fit, ceiling
    and noise_free_fit (2,) as shares of one; wn [rad/s], zeta (2,), of your own structure (k,), and their standard
    deviations; gain (2, 2) [m/V]; delay (2,) [s]; speed [rad/s], pressure [Pa]; seconds it took; units of the
    parameters of your own structure; bias of modes and gains where one is stated.
    """

    kind: str
    method: str
    model: LinearModel
    parameters: dict[str, tuple[float, float]]
    theta: np.ndarray
    covariance: np.ndarray
    fit: np.ndarray
    ceiling: np.ndarray
    noise_free_fit: np.ndarray | None
    wn: np.ndarray
    zeta: np.ndarray
    wn_sd: np.ndarray
    zeta_sd: np.ndarray
    static_gain: np.ndarray
    static_gain_sd: np.ndarray
    delay: np.ndarray
    delay_sd: np.ndarray
    residuals: ResidualTests
    rms_residual: np.ndarray
    speed: float
    pressure: float
    iterations: int
    converged: bool
    seconds: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    information: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    units: tuple[str, ...] = ()
    bias: Bias | None = None

    @property
    def insignificant(self) -> tuple[str, ...]:
        """Parameters within two standard deviations of zero."""
        return insignificant(self.parameters)

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Frequencies [Hz], damping ratios and static gains [um/V] with standard deviation, bias and 90 % interval.

        The bias is that which the record shows (see `identification.local.bias`); None for black-box
        models, structures of your own, actuators and records of a closed loop, for which none is stated.
        """
        values = np.concatenate([self.wn, self.zeta, self.static_gain.ravel()])
        sds = np.concatenate([self.wn_sd, self.zeta_sd, self.static_gain_sd.ravel()])
        count, rows = len(self.wn), []
        for k in range(count):
            rows += [(f"f_{k + 1}", k, 0.5 / np.pi, "Hz"), (f"zeta_{k + 1}", count + k, 1.0, "")]
        rows += [(f"gain_{'xy'[i]}{'xy'[j]}", 2 * (count + i) + j, 1e6, "um/V") for i, j in np.ndindex(2, 2)]
        found = []
        for name, k, by, unit in rows:
            bias = None if self.bias is None else float(self.bias.expected[k] * by)
            bias_sd = None if self.bias is None else float(self.bias.sd[k] * by)
            found.append(Interval(name, float(values[k] * by), float(sds[k] * by), bias, bias_sd, unit))
        return tuple(found)

    def report(self) -> str:
        """Human-readable text of the result."""
        lines = [f"{self.model_name}, {self.method}, {self.iterations} iterations, {self.seconds:.2f} s"]
        lines.append(f"fit      {_percent(self.fit)}   noise ceiling {_percent(self.ceiling)}")
        if self.noise_free_fit is not None:
            lines.append(f"noise-free fit {_percent(self.noise_free_fit)}")
        if self.bias is None:
            lines += mode_lines(self.wn, self.wn_sd, self.zeta, self.zeta_sd)
            if len(self.wn):
                lines.append("no bias stated: standard deviations know nothing of what the model's form lacks")
        else:
            lines += [
                f"{one.name:8s} {one.value: #.5g} +- {one.sd:.2g}, bias {one.bias:.2g} +- {one.bias_sd:.2g}"
                + f" {one.unit}".rstrip()
                + f"; 90 %: {one.low:#.5g} to {one.high:#.5g}"
                for one in self.intervals
            ]
        lines += parameter_lines(self.parameters, self.units)
        white = "white" if self.residuals.white else f"not white ({_percent(self.residuals.outside)} outside the band)"
        lines.append(f"residuals {white}, {self.residuals.verdict}")
        return "\n".join([*lines, *(f"note: {text}" for text in self.notes), *(f"warning: {t}" for t in self.warnings)])

    @property
    def dead_time(self) -> np.ndarray:
        """Dead time (2,) [s] of each axis of Model 3, part of `delay`; zero without."""
        return dead_times(self.kind, self.theta)

    @property
    def model_name(self) -> str:
        """Displayed name."""
        return model_name(self.kind, self.model)


def model_name(kind: str, model: LinearModel) -> str:
    """Displayed name of a model of a kind."""
    if kind == DELAYED:
        return "Model 3 with dead times"
    if kind == RATED:
        return "Model 2 with rates"
    return f"Model {kind}" if kind.isdigit() else f"{kind}, order {model.order}"


def insignificant(parameters: dict[str, tuple[float, float]]) -> tuple[str, ...]:
    """Parameters (value, sd) within SIGNIFICANT standard deviations of zero."""
    return tuple(name for name, (value, sd) in parameters.items() if abs(value) < SIGNIFICANT * sd)


def mode_lines(wn: np.ndarray, wn_sd: np.ndarray, zeta: np.ndarray, zeta_sd: np.ndarray) -> list[str]:
    """A line for each mode."""
    return [
        f"mode {k + 1}   {w / 2 / np.pi:.3f} +- {wn_sd[k] / 2 / np.pi:.3f} Hz, zeta {z:.5f} +- {zeta_sd[k]:.5f}"
        for k, (w, z) in enumerate(zip(wn, zeta, strict=True))
    ]


def parameter_lines(parameters: dict[str, tuple[float, float]], units: tuple[str, ...] = ()) -> list[str]:
    """A line for each parameter."""
    named = zip(parameters.items(), units or ("",) * len(parameters), strict=True)
    return [
        f"{name:8s} {value: .6g} {'at its bound' if np.isnan(sd) else f'+- {sd:.2g}'} {unit}".rstrip()
        for (name, (value, sd)), unit in named
    ]


def noted(found: Identification, text: str) -> Identification:
    """The same result with one more note."""
    return replace(found, notes=(*found.notes, text))


def _percent(values: np.ndarray) -> str:
    return ", ".join(f"{100 * value:.2f}" for value in values) + " %"
