"""Result of a fit to a frequency response: model, parameters with standard deviations, fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.local.models import LinearModel
from identification.local.result import insignificant, mode_lines, model_name, parameter_lines


@dataclass(frozen=True, eq=False)
class ResponseFit:
    """Result of `fit_frequency_response`.

    kind '1', '3' or the name of your own structure; parameters by name as (value, sd) in SI, sd NaN at a bound;
    covariance (q, q) of `theta`; wn [rad/s], zeta (k,) and static gain (2, 2) [m/V] with standard deviations; fit (2,)
    of each output, as a share of one; misfit (2,), RMS of what is left over its standard deviation, about 1 where the
    structure explains the response and NaN where no variance is known; number of lines.
    """

    kind: str
    model: LinearModel
    parameters: dict[str, tuple[float, float]]
    theta: np.ndarray
    covariance: np.ndarray
    wn: np.ndarray
    zeta: np.ndarray
    wn_sd: np.ndarray
    zeta_sd: np.ndarray
    static_gain: np.ndarray
    static_gain_sd: np.ndarray
    fit: np.ndarray
    misfit: np.ndarray
    lines: int
    speed: float
    pressure: float
    iterations: int
    converged: bool
    seconds: float
    warnings: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    @property
    def insignificant(self) -> tuple[str, ...]:
        """Parameters within two standard deviations of zero."""
        return insignificant(self.parameters)

    def report(self) -> str:
        """The findings as a text that a person can read."""
        name = model_name(self.kind, self.model)
        fits, misfits = (", ".join(f"{v:.{d}f}" for v in row) for row, d in ((100 * self.fit, 2), (self.misfit, 2)))
        lines = [f"{name}, frequency response, {self.lines} lines, {self.iterations} iterations, {self.seconds:.2f} s"]
        lines.append(f"fit      {fits} %   residual over its standard deviation {misfits}")
        lines += mode_lines(self.wn, self.wn_sd, self.zeta, self.zeta_sd)
        lines += parameter_lines(self.parameters, self.units)
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])
