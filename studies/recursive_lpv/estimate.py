r"""Recursive LPV estimate: a model with surfaces over speed and pressure that learns sample by sample, for online use.

The equations are those of `studies.recursive_lpv.kernel`. What guards them: without excitation nothing is
learned and no variance grows; no variance grows beyond its first value; every coefficient stays within its bounds; an
update that would make the model unstable at the present operating point is halved twice and then refused; NaN, outliers
and displacements that stand still are skipped, and nothing is learned until the filters have forgotten them.

The model learns in the third-order form of its six states.

.. math:: y''' = A_2 y'' + A_1 y' + A_0 y + B_0 u + B_1 u', \qquad
          A = \begin{bmatrix} 0 & I & 0\\ 0 & 0 & I\\ A_0 & A_1 & A_2 \end{bmatrix},\;
          B = \begin{bmatrix} 0\\ B_1\\ B_0 + A_2 B_1 \end{bmatrix}

Model 3 has it exactly, with B_1 = 0: its lags make the reference act on the third derivative first. B_1 stands for what
is behind the first lag, such as a second pole of the actuators.

Cites: garnier_2008.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.local.models import LinearModel
from identification.local.simulation import sampled
from identification.lpv_model import SAME, Basis, LpvModel, fit_surfaces, make_basis
from identification.records.checks import WAY_OUT, controller_of
from identification.records.sampling import sampling_time
from identification.records.schema import measured, require
from rotorsim.base.errors import ModelError, UnfitError
from studies.recursive_lpv import kernel

if TYPE_CHECKING:
    import xarray as xr


Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class Recursion:
    """Settings of `RecursiveLpv`. Coefficients are normalised: 1 is the size of those of the start.

    order: total degree of the polynomials over speed and pressure; harmonics: of the shaft angle, for imbalance and
    runout; corner: of the filters, in units of the start's mean natural frequency; spread: standard deviation of each
    coefficient of displacements, references, constant and harmonics before any data; drift: how far each of these
    wanders in a second, as a share of its spread, which is what it forgets by, 0 for none; reach: bound of each
    coefficient about the start, in units of its spread; least_input: RMS of the filtered references [V] below which
    nothing is learned; gate: second differences of a displacement beyond so many usual ones are outliers; standing: so
    many equal displacements in a row are a drop-out; least_decay: of every pole, in units of the natural frequency;
    period: between updates [s].

    Examples
    --------
    >>> Recursion(drift=(0.05, 0.05, 0.05, 0.05)).order
    2
    """

    order: int = 2
    harmonics: int = 2
    corner: float = 1.5
    spread: Four = (0.5, 0.5, 10.0, 10.0)
    drift: Four = (0.005, 0.005, 0.02, 0.02)
    reach: float = 6.0
    least_input: float = 0.05
    gate: float = 12.0
    standing: int = 5
    least_decay: float = 1e-3
    period: float = 1e-3

    def __post_init__(self) -> None:
        """Refuse numbers that make no estimate."""
        if self.order not in (0, 1, 2, 3) or self.harmonics not in range(11):
            raise UnfitError(
                f"recursion: order {self.order}, {self.harmonics} harmonics; choose 0 to 3, and 0 to 10 harmonics"
            )
        for name in ("corner", "reach", "gate", "standing", "period"):
            if not 0 < getattr(self, name) < np.inf:
                raise UnfitError(f"recursion.{name}: {getattr(self, name)}; give a number above zero")
        for name, least in (("spread", 1e-12), ("drift", 0.0)):
            values = np.asarray(getattr(self, name), float)
            if values.shape != (4,) or not np.all((values >= least) & (values < np.inf)):
                raise UnfitError(
                    f"recursion.{name}: {getattr(self, name)}; give four numbers, of displacements, references, "
                    "constant, harmonics"
                )
        for name in ("least_input", "least_decay"):
            if not 0 <= getattr(self, name) < np.inf:
                raise UnfitError(f"recursion.{name}: {getattr(self, name)}; give zero or more")


OWN = 11
"""Regressors without harmonics: y'', y', y, u and u' of both axes, and a constant."""
ABRUPT = 1e-6
"""Largest effect of a reference on the displacement's first derivative, as a share of that on the third."""
WORST = 1e10
"""Largest condition of displacements and their derivatives as coordinates of the state."""


def without_dead_times(model: LinearModel) -> LinearModel:
    """Model 3 with dead times in six states, its lags longer by them; any other model as it is."""
    A, B = model.A, model.B
    if A.shape != (8, 8) or B.shape[1] != 2 or np.any(A[6:, :6]) or not np.array_equal(B[6:], np.eye(2)):
        return model
    P, R = np.diag(-A[4:6, 4:6]), np.diag(-A[6:, 6:])
    if not (np.all(P > 0) and np.all(R > 0) and np.allclose(A[4:6, 6:], 2 * np.diag(P * R))):
        return model
    lag = np.diag(1 / (1 / P + 2 / R))
    short, into = A[:6, :6].copy(), np.zeros((6, 2))
    short[4:, 4:], into[4:] = -lag, lag
    return replace(model, A=short, B=into, C=model.C[:, :6])


def coefficients_of(model: LinearModel, omega: float, scale: float) -> np.ndarray:
    """A_2, A_1, A_0, B_0 and B_1 (2, 10) of a model, in units of time 1/omega and of displacement `scale` [m].

    Raises ModelError if the model is sampled, has not six states (or eight, of Model 3 with dead times, which join its
    lags), two references and two displacements, or its displacements and their first two derivatives are no coordinates
    of its state, or its reference acts on the first.
    """
    model = without_dead_times(model)
    if model.Ts or model.A.shape != (6, 6) or model.B.shape[1] != 2 or model.C.shape[0] != 2 or np.any(model.D):
        raise ModelError(
            f"recursive.start: {model.order} states, Ts = {model.Ts:g} s; give a continuous model of six states, two "
            "references in, two displacements out, D = 0, such as Model 3"
        )
    A, B, C = model.A / omega, model.B / omega, model.C / scale
    seen = np.vstack([C, C @ A, C @ A @ A])
    size = np.maximum(np.linalg.norm(seen, axis=0), 1e-300)
    if not np.linalg.cond(seen / size) < WORST:
        raise ModelError("recursive.start: a state of the model does not show in the displacements; take Model 3")
    if np.linalg.norm(C @ B) > ABRUPT * np.linalg.norm(C @ A @ A @ B):
        raise ModelError("recursive.start: a step of the reference moves the rotor at a jump; take Model 3")
    rows = np.linalg.solve((seen / size).T, (C @ A @ A @ A / size).T).T
    first = C @ A @ B
    return np.hstack([rows[:, 4:], rows[:, 2:4], rows[:, :2], C @ A @ A @ B - rows[:, 4:] @ first, first])


def model_of(
    rows: np.ndarray, omega: float, scale: float, speed: float, pressure: float, extrapolated: bool
) -> LinearModel:
    """Model of `coefficients_of` at an operating point [rad/s], [Pa]."""
    A, B, C = np.zeros((6, 6)), np.zeros((6, 2)), np.zeros((2, 6))
    A[:4, 2:], C[:, :2] = np.eye(4), np.eye(2)
    A[4:] = np.hstack([rows[:, 4:6] * omega**3, rows[:, 2:4] * omega**2, rows[:, :2] * omega])
    B[2:4] = rows[:, 8:10] * omega**2 * scale
    B[4:] = rows[:, 6:8] * omega**3 * scale + A[4:, 4:] @ B[2:4]
    return LinearModel(A, B, C, np.zeros((2, 2)), speed=speed, pressure=pressure, extrapolated=extrapolated)


OUTCOMES = ("updated", "between", "settling", "skipped", "idle", "refused")
"""Outcomes of a sample by the numbers of `kernel`: learned from, between two updates, filters settle,
missing or an outlier, no excitation, update refused for stability."""
WARM = 200
"""Errors weighed before the first update."""
FORGOTTEN = 20.0
"""Time constants after which filters have settled."""
SLOW, FAST, MOST_OUTLIERS = 0.5, 0.1, 0.02
"""Times [s] over which means and mean squares run, and after which outliers in a row count as signal."""
FASTEST = 0.5
"""Most radians of the natural frequency per sample."""


@dataclass(frozen=True, eq=False)
class Track:
    """Modes of a recursive estimate along a record: time (n,) [s], speed (n,) [rad/s], pressure (n,) [Pa], wn (n, 2)
    [rad/s], ascending, and zeta (n, 2) of the two least damped; NaN where fewer oscillate."""

    time: np.ndarray
    speed: np.ndarray
    pressure: np.ndarray
    wn: np.ndarray
    zeta: np.ndarray


class RecursiveLpv:
    """Model of third order in both displacements whose coefficients are polynomials of speed and pressure.

    Parameters
    ----------
    start : LinearModel or LpvModel
        Where it begins: six states, continuous, stable, such as Model 3 at standstill. Its frequencies may be off by
        a fifth.
    Ts : float
        Sampling time [s].
    speeds, pressures : tuple
        Lowest and highest speed [rad/s] and pressure [Pa, gauge] to come; the same twice for one that stays.
    settings : Recursion or None

    Raises
    ------
    ModelError, UnfitError
        If the start is unstable or of another form, the sampling too slow for it, or a range empty.

    Examples
    --------
    >>> import rotorsim as rs
    >>> start = rs.identify(record, model=3).model
    >>> online = RecursiveLpv(start, 2e-4, speeds=(0.0, 600.0), pressures=(0.4e6, 0.6e6))
    >>> online.update([0.5, -0.5], [1e-6, 2e-6], 300.0, 0.5e6)
    'settling'
    >>> online.at(300.0, 0.5e6).wn.shape
    (2,)
    """

    def __init__(
        self, start: LinearModel | LpvModel, Ts: float, speeds: Any, pressures: Any, settings: Recursion | None = None
    ) -> None:
        self.settings, self.Ts = settings or Recursion(), float(Ts)
        self.basis, points = _basis(speeds, pressures, self.settings.order)
        local = [start.at(*q) if isinstance(start, LpvModel) else start for q in points]
        self._omega, self._scale = _units(local, self.Ts)
        values = np.array([coefficients_of(one, self._omega, self._scale).ravel() for one in local])
        surfaces = fit_surfaces(self.basis, points, values)
        self._begin(surfaces, np.array([points[0], points[-1]]))

    def _begin(self, surfaces: np.ndarray, ends: np.ndarray) -> None:
        """Coefficients, their variances and bounds, filters and running numbers before the first sample."""
        chosen, t, waves = self.settings, len(self.basis.exponents), 2 * self.settings.harmonics
        theta = np.zeros((2, OWN + waves, t))
        theta[:, : OWN - 1] = surfaces.reshape(2, OWN - 1, t)
        self._theta = np.ascontiguousarray(theta.reshape(2, -1).T)
        every = max(1, round(chosen.period / self.Ts))
        group = np.repeat([0] * 6 + [1] * 4 + [2] + [3] * waves, t)
        sd, drift = (np.array(values)[group] for values in (chosen.spread, chosen.drift))
        self._walk = np.stack([(drift * sd) ** 2 * every * self.Ts, sd**2])
        self._P = np.diag(sd**2)
        room = chosen.reach * sd[:, None]
        self._box = np.stack([self._theta - room, self._theta + room])
        step = self.Ts * self._omega
        self._F, self._inputs = _filters(chosen.corner, step)
        settle = int(np.ceil(FORGOTTEN / (chosen.corner * step)))
        self._rule = np.array([
            self.Ts, step, chosen.corner, chosen.gate, chosen.least_input, chosen.least_decay,
            self.Ts / SLOW, self.Ts / FAST,
        ])  # fmt: skip
        outliers = max(round(MOST_OUTLIERS / self.Ts), 1)
        self._limit = np.array([every, settle, chosen.standing, outliers, WARM])
        self._f, self._x, self._past = np.zeros((6 + waves, 4)), np.zeros(6), np.zeros((3, 2))
        self._waves, self._real = np.zeros((3, waves)), np.zeros(kernel.NUMBERS)
        self._count, self._tally = np.zeros(5, np.int64), np.zeros(len(OUTCOMES), np.int64)
        self._real[kernel.SPEED : kernel.SPEED + 2] = ends[0]
        self._real[kernel.LOWEST : kernel.HIGHEST], self._real[kernel.HIGHEST :] = np.inf, -np.inf
        self._count[kernel.COOLING] = settle
        self._exponents = np.ascontiguousarray(self.basis.exponents, np.int64)

    def update(self, u: Any, y: Any, speed: float, pressure: float) -> str:
        """Take one sample in.

        Parameters
        ----------
        u : (2,) [V]
            References that act from this sample on.
        y : (2,) [m]
            Measured displacements of this sample.
        speed, pressure : float
            Of this sample [rad/s], [Pa, gauge].

        Returns
        -------
        str
            One of `OUTCOMES`.
        """
        return OUTCOMES[int(self.take([u], [y], [speed], [pressure])[0])]

    def take(self, u: Any, y: Any, speed: Any, pressure: Any) -> np.ndarray:
        """Take u (n, 2) [V], y (n, 2) [m], speed (n,) [rad/s], pressure (n,) [Pa] in; numbers of `OUTCOMES` (n,)."""
        u, y, speed, pressure = (np.ascontiguousarray(values, float) for values in (u, y, speed, pressure))
        if not u.shape == y.shape == (*speed.shape, 2) == (*pressure.shape, 2) or speed.ndim != 1:
            raise UnfitError(
                f"recursive: u {u.shape}, y {y.shape}, speed {speed.shape}, pressure {pressure.shape}; give (n, 2), "
                "(n, 2), (n,), (n,), for one sample two of u and y"
            )
        status = np.empty(len(u), np.int64)
        kernel.advance(
            u, y / self._scale, speed, pressure, self._F, self._inputs, self._exponents,
            self.basis.middle, self.basis.half, self._rule, self._limit, self._walk, self._box, self._f, self._x,
            self._theta, self._P, self._past, self._waves, self._real, self._count, status,
        )  # fmt: skip
        self._tally += np.bincount(status, minlength=len(OUTCOMES))
        return status

    def run(self, record: xr.Dataset, every: float = 0.1) -> Track:
        """Take a record in; the modes at its operating point every so many seconds.

        Raises
        ------
        SchemaError, UnfitError
            If the record lacks references, displacements, speed or pressure, has another sampling time, or names a
            controller. Samples of NaN are skipped.

        Examples
        --------
        >>> import rotorsim as rs
        >>> online = RecursiveLpv(model, 2e-4, (0.0, 600.0), (0.4e6, 0.6e6))  # doctest: +SKIP
        >>> online.run(runup).wn.shape  # doctest: +SKIP
        (100, 2)
        """
        require(record, "reference", use="a recursive estimate")
        if name := controller_of(record):
            raise UnfitError(f"record: made in closed loop ({name}), where the estimate is biased; {WAY_OUT}")
        names = ("disc", "speed", "pressure")
        y, speed, pressure = (measured(record, name) for name in names)
        for name, values in zip(names, (y, speed, pressure), strict=True):
            if values is None:
                raise UnfitError(f"record: no {name}; a recursive estimate needs it at every sample: map or add it")
        assert y is not None and speed is not None and pressure is not None
        if abs(sampling_time(record) / self.Ts - 1) > 1e-6:
            raise UnfitError(
                f"record: sampled every {sampling_time(record):g} s and not every {self.Ts:g} s; resample it"
            )
        u, block, found = np.asarray(record["reference"].values, float), max(round(every / self.Ts), 1), []
        for first in range(0, len(u), block):
            at = slice(first, first + block)
            self.take(u[at], y[at], speed[at], pressure[at])
            found.append(self._modes())
        last = np.minimum(np.arange(0, len(u), block) + block, len(u)) - 1
        points, modes = np.array([one[0] for one in found]), np.array([one[1] for one in found])
        time = np.asarray(record["time"].values, float)[last]
        return Track(time, points[:, 0], points[:, 1], modes[:, 0], modes[:, 1])

    def _modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Present operating point (2,) and wn, zeta (2, 2) there."""
        point = self._real[kernel.SPEED : kernel.SPEED + 2].copy()
        model = self.at(*point)
        least = np.sort(np.argsort(model.zeta)[:2])
        two = len(least) == 2
        return point, np.array([model.wn[least], model.zeta[least]]) if two else np.full((2, 2), np.nan)

    def at(self, speed: float, pressure: float) -> LinearModel:
        """Frozen model at `speed` [rad/s] and `pressure` [Pa, gauge]; `extrapolated` beyond what was learned from."""
        psi = self.basis.at(np.array([[speed, pressure]]))[0]
        rows = (self._theta.T.reshape(2, -1, len(psi)) @ psi)[:, : OWN - 1]
        low, high = self._real[kernel.LOWEST : kernel.HIGHEST], self._real[kernel.HIGHEST :]
        beyond = bool(np.any((speed, pressure) < low - SAME) or np.any((speed, pressure) > high + SAME))
        return model_of(rows, self._omega, self._scale, speed, pressure, beyond)

    @property
    def counts(self) -> dict[str, int]:
        """Number of samples by their outcome."""
        return {name: int(count) for name, count in zip(OUTCOMES, self._tally, strict=True)}

    @property
    def variances(self) -> np.ndarray:
        """Variance (n,) of each coefficient, as a share of that before any data: what is still unknown."""
        return np.asarray(np.diag(self._P) / self._walk[1])


def _basis(speeds: Any, pressures: Any, order: int) -> tuple[Basis, np.ndarray]:
    """Polynomials over the ranges, and a grid of points (k, 2) in them."""
    lines = []
    for name, pair in (("speeds", speeds), ("pressures", pressures)):
        ends = np.asarray(pair, float).ravel()
        if ends.shape != (2,) or not np.all(np.isfinite(ends)) or ends[0] > ends[1]:
            raise UnfitError(f"recursive.{name}: {pair}; give the lowest and the highest to come")
        lines.append(np.linspace(ends[0], ends[1], order + 2) if ends[1] > ends[0] else ends[:1])
    points = np.array([(speed, pressure) for speed in lines[0] for pressure in lines[1]])
    return make_basis(points, order), points


def _units(local: list[LinearModel], Ts: float) -> tuple[float, float]:
    """Units of frequency [rad/s] and displacement [m] from models of the range, which must be fit to start from."""
    for one in local:
        coefficients_of(one, 1.0, 1.0)
        if not one.stable or len(one.wn) < 2:
            raise UnfitError("recursive.start: the model is unstable or has not two modes that oscillate; take another")
    omega = float(np.mean([one.wn[:2] for one in local]))
    if not (np.isfinite(Ts) and 0 < omega * Ts < FASTEST):
        raise UnfitError(
            f"recursive.Ts: {Ts:g} s for modes at {omega / 2 / np.pi:.4g} Hz; sample at {2 * np.pi / FASTEST:.3g} "
            "times their frequency or faster"
        )
    return omega, float(np.mean([np.abs(np.diag(one.static_gain)) for one in local]))


def _filters(corner: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """F (4, 4) of 1/(s + corner)^4 sampled every `step`; its inputs (4, 4): straight ones early and late, held ones."""
    A, B = np.diag(np.ones(3), 1), np.eye(4)[:, 3:]
    A[3] = -(corner ** np.array([4, 3, 2, 1])) * (1, 4, 6, 4)
    straight, held = (sampled(A, B, step, hold) for hold in ("first", "zero"))
    return np.ascontiguousarray(straight[:, :4]), np.stack([straight[:, 4], straight[:, 5], held[:, 4], np.zeros(4)])
