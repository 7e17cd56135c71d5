r"""Fit of a structure to a measured frequency response, weighted line by line, and its result.

.. math:: \min_\theta \sum_{f, i, j} \frac{|G_{ij}(f) - \hat G_{ij}(f; \theta)|^2}{\mathrm{var}\, G_{ij}(f)}

by the steps of the output-error fit, with exact derivatives. A response of sampled signals is held against the model
behind its zero-order hold. The covariance is that of least squares, by the scatter that is left, times 1 + 2 sum rho_k
of the correlations rho_k of what is left k lines apart, for a window makes errors of neighbours alike. Source: Pintelon
and Schoukens, System Identification: A Frequency Domain Approach (2012), chapters 8 and 9.

The response of a state-space model and its derivatives by the parameters are

.. math:: G = C R B + D, \qquad R = (s I - A)^{-1}, \qquad dG = C R\,(dA\, R B + dB) + dC\, R B + dD

with s = j omega of a continuous model, exp(j omega Ts) of a sampled one.

Cites: ljung_1999, pintelon_2012.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from identification.local.confidence import without_nuisance
from identification.local.greybox import RATED, STRUCTURES, response_starts
from identification.local.least_squares import Box, GreyBox, solve
from identification.local.models import LinearModel
from identification.local.result import insignificant, mode_lines, model_name, parameter_lines
from identification.local.structures import (
    Matrices,
    Structure,
    bound_remarks,
    box,
    prepared,
    properties,
    refuse_indistinguishable,
    sizes,
    valued,
)
from identification.records.frequency_response import FrequencyResponse
from rotorsim.base.errors import ModelError, UnfitError
from rotorsim.base.rounding import unstable_poles


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
        """Human-readable text of the result."""
        name = model_name(self.kind, self.model)
        fits, misfits = (", ".join(f"{v:.{d}f}" for v in row) for row, d in ((100 * self.fit, 2), (self.misfit, 2)))
        lines = [f"{name}, frequency response, {self.lines} lines, {self.iterations} iterations, {self.seconds:.2f} s"]
        lines.append(f"fit      {fits} %   residual over its standard deviation {misfits}")
        lines += mode_lines(self.wn, self.wn_sd, self.zeta, self.zeta_sd)
        lines += parameter_lines(self.parameters, self.units)
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])


def response_with_derivatives(matrices: Matrices, slopes: Matrices, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G (f, p, m) and its derivatives (f, p, m, q) at s (f,).

    matrices : A (n, n), B (n, m), C (p, n), D (p, m); slopes : their derivatives (q, ...).
    """
    A, B, C, D = matrices
    dA, dB, dC, dD = slopes
    R = np.linalg.inv(s[:, None, None] * np.eye(len(A)) - A)
    left, right = C @ R, R @ B
    dG = np.einsum("fin,qnm,fmj->fijq", left, dA, right) + np.einsum("fin,qnj->fijq", left, dB)
    if dC.any() or dD.any():
        dG = dG + np.einsum("qin,fnj->fijq", dC, right) + np.moveaxis(dD, 0, -1)
    return left @ B + D, dG


KINDS = ("1", "3")
NEIGHBOURS = 5
"""Errors of lines up to so far apart are taken as related."""
MISSED = 2.0
"""Misfit above which there is a warning."""
PER_PARAMETER = 2
"""Least numbers, real and imaginary part each one, for each parameter."""


@dataclass(frozen=True, eq=False)
class ResponseProblem:
    """Sum of squares of a response less the model's; weight (f, p, m) is 0 where nothing was measured."""

    model: GreyBox
    omega: np.ndarray
    G: np.ndarray
    weight: np.ndarray
    continuous: bool
    box: Box = None

    def states(self, theta: np.ndarray) -> int:
        """None: a response has no initial state."""
        return 0

    def response(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The model's response (f, p, m) and its derivatives (f, p, m, q)."""
        structure = self.model.structure
        if self.continuous:
            return response_with_derivatives(structure.matrices(theta), structure.derivatives(theta), 1j * self.omega)
        matrices, (dF, dH) = self.model.sampled(theta), self.model.derivatives(theta)
        n = len(matrices[0])
        dA, dB, dC, dD = (np.moveaxis(d, -1, 0) for d in (dF[:, :n], dF[:, n:], dH[:, :n], dH[:, n:]))
        slopes: Matrices = (dA, dB, dC, dD)
        return response_with_derivatives(matrices, slopes, np.exp(1j * self.omega * self.model.Ts))

    def residual(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Weighted residual (f, 2 p m), real parts before imaginary ones, and its negative derivative (f, 2 p m, q)."""
        G, dG = self.response(theta)
        lines = len(self.omega)
        e = (self.weight * (self.G - G)).reshape(lines, -1)
        J = (self.weight[..., None] * dG).reshape(lines, e.shape[1], -1)
        return np.hstack([e.real, e.imag]), np.concatenate([J.real, J.imag], axis=1)

    def normal_equations(
        self, theta: np.ndarray, x0: np.ndarray, V: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """J'J, J'r and r'r of `residual`."""
        e, J = self.residual(theta)
        flat, cost = J.reshape(-1, J.shape[2]), float(np.sum(e**2))
        return flat.T @ flat, flat.T @ e.ravel(), cost if np.isfinite(cost) else np.inf

    def usable(self, theta: np.ndarray) -> bool:
        """Whether the parameters make sense and the model is stable."""
        if not self.model.admissible(theta):
            return False
        A = self.model.structure.matrices(theta)[0]
        return bool(np.all(np.isfinite(A))) and not unstable_poles(A)


def fit_frequency_response(
    response: FrequencyResponse,
    model: int | str | Structure = 3,
    start: Any = None,
    band: tuple[float, float] = (0.0, np.inf),
    speed: float = float("nan"),
    pressure: float = float("nan"),
) -> ResponseFit:
    """Fit Model 1, Model 3 or your own structure to a measured frequency response.

    Parameters
    ----------
    response : FrequencyResponse
        Of `frequency_response`, `periodic_response` or made by hand; its variance weights the lines, without it all
        weigh alike. Elements that are NaN are left out.
    model : 1, 3 or Structure
    start : sequence of float or None
        Start of the parameters, in place of values found in the response or a structure's own.
    band : tuple
        Lowest and highest frequency [Hz] that take part.
    speed, pressure : float
        Operating point [rad/s], [Pa, gauge] for the model that is made.

    Returns
    -------
    ResponseFit

    Raises
    ------
    UnfitError
        For too few lines, no stable start, or parameters that the response does not show apart, with their names.
    ModelError
        For a structure whose function fails or returns what are no matrices.

    Examples
    --------
    >>> import rotorsim as rs
    >>> u, y = record["reference"].values, record["disc_measured"].values
    >>> measured = rs.identification.frequency_response(u, y, 2e-4)
    >>> rs.identification.fit_frequency_response(measured, model=3).wn.shape
    (2,)
    """
    began = perf_counter()
    if not isinstance(model, Structure) and str(model) not in KINDS:
        pinned = ", which is found from pins to disc: such a response has none" if str(model) in ("2", RATED) else ""
        raise UnfitError(
            f"fit_frequency_response: model {model!r}{pinned}; choose 1, 3 or a Structure of your own",
            argument="model",
            value=model,
        )
    structure = model if isinstance(model, Structure) else STRUCTURES[str(model)]
    kind = structure.name if isinstance(model, Structure) else str(model)
    used = in_band(response, band, len(structure.parameters))
    problem, theta, steps, converged = _best(structure, used, start)
    units = structure.units if isinstance(model, Structure) else ()
    structure, covariance = problem.model.structure, _covariance(problem, theta)
    found = properties(lambda values: LinearModel(*structure.matrices(values)), theta, covariance)
    fit, misfit = _goodness(problem, used, theta)
    unfinished = () if converged else (f"the fit did not converge in {steps} iterations",)
    return ResponseFit(
        kind, LinearModel(*structure.matrices(theta), speed=speed, pressure=pressure),
        valued(structure, theta, covariance), theta, covariance, *found, fit, misfit,
        len(used.omega), speed, pressure, steps, converged, perf_counter() - began,
        (*unfinished, *_missed(misfit), *bound_remarks(structure, theta)), units,
    )  # fmt: skip


def _missed(misfit: np.ndarray) -> tuple[str, ...]:
    """A sentence where more is left than the response's variance explains."""
    if not np.nanmax(misfit, initial=0.0) > MISSED:
        return ()
    return (
        f"what is left is {np.max(misfit):.1f} times its standard deviation: the structure misses something, which the "
        "stated intervals do not hold, or the start was too far off",
    )


def in_band(response: FrequencyResponse, band: tuple[float, float], q: int) -> FrequencyResponse:
    """The lines [Hz] of a band where something was measured; raises UnfitError for too few of them."""
    f = response.omega / (2 * np.pi)
    if response.G.ndim != 3 or response.G.shape != (len(f), 2, 2):
        raise UnfitError(f"fit_frequency_response: G {response.G.shape}; give (f, 2, 2), two outputs by two inputs")
    known = np.isfinite(response.G)
    if response.variance is not None:
        known &= np.isfinite(response.variance) & (response.variance >= 0)
    kept = (f >= band[0]) & (f <= band[1]) & known.any(axis=(1, 2))
    count, need = 2 * int(known[kept].sum()), PER_PARAMETER * q
    if count < need or not known[kept].any(axis=(0, 1)).all():
        raise UnfitError(
            f"fit_frequency_response: {int(kept.sum())} lines between {band[0]:g} and {band[1]:g} Hz hold {count} "
            f"numbers of both inputs, {q} parameters need {need} or more; widen the band or measure more lines"
        )
    if not np.all(known[kept].any(axis=(0, 2))):
        raise UnfitError("fit_frequency_response: an output was not measured; give G of both")
    variance = None if response.variance is None else np.where(known, response.variance, np.nan)[kept]
    return replace(response, omega=response.omega[kept], G=np.where(known, response.G, np.nan)[kept],
                   coherence=response.coherence[kept], power=response.power[kept], variance=variance)  # fmt: skip


def weights(response: FrequencyResponse) -> np.ndarray:
    """Weights (f, p, m): one over the standard deviation of real and imaginary part, alike without variances."""
    known = np.isfinite(response.G)
    if response.variance is None:
        size = np.sqrt(np.nanmean(np.abs(response.G) ** 2, axis=(0, 2)))
        return np.where(known, 1 / np.maximum(size, 1e-300)[:, None], 0.0)
    floor = 1e-12 * np.nanmax(np.abs(response.G)) ** 2
    return np.where(known, 1 / np.sqrt(np.maximum(np.nan_to_num(response.variance), floor) / 2), 0.0)


def response_problem(structure: Structure, response: FrequencyResponse) -> ResponseProblem:
    """Problem that is minimised over the parameters of a structure."""
    grey = GreyBox(structure, response.Ts or 1.0)
    G = np.where(np.isfinite(response.G), response.G, 0.0)
    return ResponseProblem(grey, response.omega, G, weights(response), not response.Ts, box(structure))


def _best(
    structure: Structure, response: FrequencyResponse, start: Any
) -> tuple[ResponseProblem, np.ndarray, int, bool]:
    """Problem, parameters of the lowest cost that a start leads to, steps, whether the iteration ended."""
    kind = next((kind for kind in KINDS if STRUCTURES[kind] is structure), None)
    if start is not None or kind is None:
        ready = [prepared(structure, start)]
    else:
        ready = []
        for theta in response_starts(kind, response):
            try:
                ready.append(prepared(structure, theta))
            except (ModelError, UnfitError):
                continue
    found = []
    for made, first in ready:
        problem = response_problem(made, response)
        found.append((problem, solve(problem, first)))
    if not found:
        raise UnfitError("fit_frequency_response: no stable start found in the response; give start=")
    problem, best = min(found, key=lambda pair: pair[1].cost)
    return problem, best.theta, best.iterations, best.converged


def _covariance(problem: ResponseProblem, theta: np.ndarray) -> np.ndarray:
    """Covariance (q, q), zero for parameters at a bound; refuses those that the response does not show apart."""
    structure = problem.model.structure
    e, J = problem.residual(theta)
    free = ~np.any(structure.at_bounds(theta), axis=0)
    refuse_indistinguishable(structure, without_nuisance(J, sizes(structure, theta))[:, free], free)
    flat = J[..., free].reshape(e.size, int(free.sum()))
    left = max(2 * int(np.count_nonzero(problem.weight)) - flat.shape[1], 1)
    length = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    inverse = np.linalg.pinv((flat / length).T @ (flat / length), hermitian=True) / np.outer(length, length)
    covariance = np.zeros((len(theta), len(theta)))
    covariance[np.ix_(free, free)] = inverse * (float(np.sum(e**2)) / left * related(e))
    return covariance


def related(e: np.ndarray) -> float:
    """Factor by which related residuals (f, 2 p m) of neighbouring lines widen a variance, at least 1."""
    whole = max(float(np.sum(e**2)), 1e-300)
    return max(1.0, 1 + 2 * sum(float(np.sum(e[k:] * e[:-k])) / whole for k in range(1, min(NEIGHBOURS + 1, len(e)))))


def _goodness(
    problem: ResponseProblem, response: FrequencyResponse, theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Fit (2,) and misfit (2,)."""
    known, G = problem.weight > 0, problem.response(theta)[0]
    left = np.where(known, problem.G - G, 0)
    fit = 1 - np.linalg.norm(left, axis=(0, 2)) / np.linalg.norm(problem.G, axis=(0, 2))
    if response.variance is None:
        return fit, np.full(2, np.nan)
    squares = np.sum(np.abs(problem.weight * left) ** 2, axis=(0, 2)) / 2
    return fit, np.sqrt(squares / known.sum(axis=(0, 2)))
