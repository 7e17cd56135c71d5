r"""Critical speeds, and the onset speed of instability.

A critical speed Omega equals the natural frequency \|lambda(Omega)\| of a mode.

Every mode is followed over the speed, with damping and with the bearings' tables at the speed itself, and each crossing
with the line \|lambda\| = Omega, upwards or downwards, is solved with the matrices there. Modes with a damping ratio
above 1/sqrt(2) have no peak over the speed and are left out. Up to which speed to follow, where no limit is given, is
read from the undamped rotor: with constant bearings its critical speeds are the real eigenvalues of K q = Omega^2 (M -
i G) q.

The undamped map shows synchronous forward critical speeds over the bearings' stiffness. With isotropic undamped
bearings forward whirl at the speed has x + i y = u exp(i Omega t), beta - i alpha = theta exp(i Omega t), and in the
plane (x, beta) alone K q = Omega^2 (M + G_f) q with G_f = -I_p of a disc's rotation: symmetric. That none is missing
below the last one is counted by the inertia of M - mu K, mu = 1 / omega^2, since K is positive definite (Sylvester).
The modes on the softest springs make both diagonal; stiffer springs change K by a matrix of their number's rank.

For the stability all modes are computed at every speed; a motion that grows without oscillation has a damping ratio of
-1, a logarithmic decrement of minus infinity and a frequency of 0. The onset lies where the least damping ratio crosses
zero between two of the given speeds, of the tables' speeds, or of those in between: a step is halved as long as the
slopes of the damping ratios at its ends leave it open whether damping is lost and comes back inside. It is then found
by Brent's method.

Source: API 684; Friswell et al. (2010), section 6.8.

Cites: api_684, friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig, eigh

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor
from fe_shaft.crossings import NEARBY, Crossing, ModesAt, crossings, first_loss
from fe_shaft.follower import follow
from fe_shaft.modal import dataset
from fe_shaft.pencil import Region, SecondOrder
from fe_shaft.shaft import HOLD, ShaftError, grid
from rotorsim.base.rounding import EPS

if TYPE_CHECKING:
    import xarray as xr

_DAMPED = 0.5**0.5
_FLOOR, _ABOVE = 1e-4, 1.02
"""Lowest frequency that is followed, and highest, over the highest speed."""
_BEYOND = 1e-6
"""Relative distance above the highest critical speed up to which they are counted."""
_MORE = 8
"""Vectors of a subspace iteration besides those that are asked for."""
_RITZ = 1e-10
"""Change of each inverse square of a frequency over itself, besides rounding of the largest, after which it ends."""
_ITERATIONS = 100
"""Most steps of it; `missing` is NaN where it has not come to an end."""


@dataclass(frozen=True, eq=False)
class CriticalSpeedResult:
    """Critical speeds, ascending.

    Attributes
    ----------
    wn : ndarray (n_critical,)
        Speeds that equal the undamped natural frequency of a mode [rad/s].
    wd : ndarray (n_critical,)
        The damped natural frequency of that mode there [rad/s].
    damping_ratio : ndarray (n_critical,)
        Its damping ratio there [1].
    whirl : ndarray (n_critical,) of str
        Its whirl; unbalance drives forward whirl, and any whirl of an unsymmetric rotor.
    upward : ndarray (n_critical,) of bool
        Whether its natural frequency rises above the speed there.
    searched : tuple (float, float)
        Lowest and highest speed at which critical speeds were looked for [rad/s].
    proven : bool
        Whether the number of modes is proven at every speed on the way and none was lost.
    """

    wn: NDArray[np.float64]
    wd: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    whirl: NDArray[np.str_]
    upward: NDArray[np.bool_]
    searched: tuple[float, float]
    proven: bool

    def dataset(self) -> xr.Dataset:
        """Labelled data over critical."""
        over = ("critical",)
        return dataset(
            {
                "wn": (over, self.wn, "rad/s", "critical speed"),
                "wd": (over, self.wd, "rad/s", "damped natural frequency at the critical speed"),
                "damping_ratio": (over, self.damping_ratio, "1", "damping ratio at the critical speed"),
                "whirl": (over, self.whirl, "", "sense of whirl"),
                "upward": (over, self.upward, "1", "natural frequency rises above the speed"),
            },
            {},
        )


def run_critical_speed(rotor: AssembledRotor, limit: float | None = None, count: int = 6) -> CriticalSpeedResult:
    """The `count` lowest critical speeds of `rotor`, up to `limit` [rad/s] where one is given.

    Bearings whose tables may not be continued bound the speeds that are searched.

    Raises
    ------
    ShaftError
        If `count` or `limit` is not positive, the limit lies below all tables, or no speed lies in every table.

    Examples
    --------
    >>> rotor.run_critical_speed(count=2).wn.round().tolist()
    [210.0, 210.0]
    """
    if count < 1 or (limit is not None and not limit > 0):
        raise ShaftError(f"critical speed: count = {count}, limit = {limit}; both must be positive.")
    low, high = _tabled(rotor)
    if limit is not None and limit <= low:
        raise ShaftError(
            f"critical speed: limit = {limit:g} rad/s, but the bearings' tables begin at {low:g} rad/s; raise "
            "the limit, extend the tables or set extrapolate='hold'."
        )
    found: list[Crossing] = []
    searched, proven = (low, low), True
    tops = [high if limit is None else min(high, limit)]
    if limit is None:  # one after the other until there are enough
        guesses = _guesses(rotor)
        chosen = (guesses[min(k, len(guesses)) - 1] for k in (count, 2 * count, len(guesses)) if len(guesses))
        tops = sorted({float(min(high, 1.2 * guess)) for guess in chosen})
    for top in tops:
        if top <= low:
            continue
        found, proven = _up_to(rotor, low, top)
        searched = (low, top)
        if len(found) >= count:
            break
    return _result(rotor, found[:count], searched, proven)


def _tabled(rotor: AssembledRotor) -> tuple[float, float]:
    """Lowest and highest speed [rad/s] that the bearings' tables allow."""
    ends = [(*axis[[0, -1]].tolist(), b.n) for b in rotor.bearing_elements if b.extrapolate != HOLD for axis in b.axes]
    low, _, late = max(ends, default=(0.0, 0.0, 0))
    _, high, early = min(ends, key=lambda end: end[1], default=(0.0, np.inf, 0))
    if low > high:
        raise ShaftError(
            f"critical speed: no speed lies in all tables: the bearing at node {late} has one from {low:g} rad/s, that "
            f"at node {early} one up to {high:g} rad/s; extend one of them or set extrapolate='hold'."
        )
    return low, high


def _up_to(rotor: AssembledRotor, low: float, high: float) -> tuple[list[Crossing], bool]:
    """Crossings between two speeds [rad/s], ascending, and whether the modes are proven at every node."""

    def family(speed: float) -> SecondOrder:
        return SecondOrder(*modal.free_matrices(rotor, speed))

    kinks = [float(v) for b in rotor.bearing_elements for axis in b.axes for v in axis if low < v < high]
    region = Region(_ABOVE * high, _FLOOR * high, _DAMPED)
    followed = follow(family, sorted({low, high, *kinks}), region)
    every, uncertain = crossings(family, followed, (1.0,))
    return every, not uncertain and all(node.modes.proven for node in followed.nodes)


def _result(
    rotor: AssembledRotor, found: list[Crossing], searched: tuple[float, float], proven: bool
) -> CriticalSpeedResult:
    values, senses = np.zeros(len(found), complex), []
    for k, one in enumerate(found):
        vector = one.modes.right[: len(rotor.free)]
        M, D, K = modal.free_matrices(rotor, one.at)
        values[k] = modal.damped_by_work(M, D, K, one.modes.values, vector)[0]
        senses.append(str(modal.named(rotor, one.at, one.modes.values, vector).whirl[0]))
    return CriticalSpeedResult(
        np.array([one.at for one in found]), values.imag, -values.real / np.abs(values), np.array(senses, dtype=str),
        np.array([one.upward for one in found], bool), searched, proven,
    )  # fmt: skip


def _guesses(rotor: AssembledRotor) -> NDArray[np.float64]:
    """Undamped critical speeds [rad/s], of each bearing as stiff as it is at most in its tables."""
    block = np.ix_(rotor.free, rotor.free)
    speeds = {0.0} | {float(v) for b in rotor.bearing_elements for axis in b.axes for v in axis}
    low, high = _tabled(rotor)
    stiffest = max(sorted(v for v in speeds if low <= v <= high), key=lambda v: float(np.trace(rotor.K(v))))
    M = rotor.parts.M[block] - 1j * rotor.parts.G[block]
    unit = 1 / np.sqrt(np.diag(rotor.parts.M)[rotor.free])
    mass, spring = eig(M * unit * unit[:, None], rotor.K(stiffest)[block] * unit * unit[:, None], right=False,
                       homogeneous_eigvals=True)  # fmt: skip
    moving = np.abs(spring) > len(M) * EPS * np.abs(spring).max()  # else the motion of a rigid body
    inverse = mass[moving] / spring[moving]
    real = inverse.real > 1e-12 * np.abs(inverse).max(initial=0.0)
    real &= np.abs(inverse.imag) < 0.3 * np.abs(inverse)
    return np.sort(1 / np.sqrt(inverse[real].real))


@dataclass(frozen=True, eq=False)
class UcsResult:
    """Undamped critical speeds `wn` (n_modes, n_stiffness) [rad/s] over `stiffness` (n_stiffness,) [N/m].

    NaN where a disc is so flat that a mode has no forward critical speed. `missing` (n_stiffness,) is the number of
    critical speeds up to the highest one that are not among them, counted independently: 0; NaN where nobody counted
    or the search did not come to an end.
    """

    stiffness: NDArray[np.float64]
    wn: NDArray[np.float64]
    missing: NDArray[np.float64] = field(default_factory=lambda: np.array(np.nan))

    def dataset(self) -> xr.Dataset:
        """Labelled data over mode and stiffness."""
        return dataset(
            {
                "wn": (("mode", "stiffness"), self.wn, "rad/s", "undamped critical speed"),
                "missing": (
                    ("stiffness",),
                    np.broadcast_to(self.missing, self.stiffness.shape),
                    "1",
                    "critical speeds up to the highest that are not found",
                ),
            },
            {"stiffness": (("stiffness",), self.stiffness, "N/m", "stiffness of every bearing")},
        )


def run_ucs(
    rotor: AssembledRotor, stiffness_range: tuple[float, float] = (1e6, 1e11), num: int = 30, num_modes: int = 4,
    synchronous: bool = True,
) -> UcsResult:  # fmt: skip
    """Undamped critical speeds with every bearing as stiff as k [N/m], at `num` values from the range, evenly in log k.

    Without `synchronous` the shaft stands: its natural frequencies at rest.

    Raises
    ------
    ShaftError
        If the range is not two positive ascending numbers, the rotor has no bearing to vary, or it has
        bearings at one node alone.

    Examples
    --------
    >>> rotor.run_ucs((1e6, 1e8), num=5, num_modes=2).wn.shape
    (2, 5)
    """
    low, high = stiffness_range
    if not 0 < low < high or num < 1 or num_modes < 1:
        raise ShaftError(
            f"ucs: stiffness from {low:g} to {high:g} N/m, {num} values, {num_modes} modes; "
            "give a positive ascending range and counts of at least 1."
        )
    if not rotor.bearing_elements:
        raise ShaftError("ucs: the rotor has no bearing whose stiffness could vary; add one.")
    held = {bearing.n for bearing in rotor.bearing_elements} | set(rotor.pinned)
    if len(held) < 2 and not rotor.clamped:
        raise ShaftError(
            "ucs: bearings at one node alone leave the shaft free to tilt; support it at two nodes at least.",
            argument="bearings",
        )
    stiffness = np.geomspace(low, high, num)
    M, K, plane = _forward_plane(rotor, synchronous)
    unit = np.zeros(rotor.ndof)
    for bearing in rotor.bearing_elements:
        unit[rotor.layout.place(bearing.n)] += 1.0
    springs = _springs(M, K, unit[plane], stiffness)
    wn, ended = springs.lowest(num_modes)
    missing = springs.count_up_to(np.nanmax(wn, axis=1, initial=0.0)) - np.isfinite(wn).sum(axis=1)
    return UcsResult(stiffness, wn.T, np.where(ended, missing, np.nan))


def _forward_plane(
    rotor: AssembledRotor, synchronous: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Mass with the gyroscopic part and stiffness of the shaft in the plane x, beta, and its degrees of freedom."""
    axes, free = rotor.layout.axes, rotor.free
    inside = free[free < rotor.ndof - 2 * len(rotor.layout.pedestals)]
    plane = inside[np.isin(axes[inside], (0, 3))]
    # in forward whirl y = -i x and alpha = i beta; G couples the plane to y, alpha
    partner = np.where(axes[plane] == 0, plane + 1, plane - 1)
    turned = np.where(axes[plane] == 0, -1.0, 1.0)
    M = rotor.parts.M[np.ix_(plane, plane)]
    if synchronous:
        G = rotor.parts.G[np.ix_(plane, partner)] * turned
        M = M + (G + G.T) / 2
    return M, rotor.parts.K[np.ix_(plane, plane)], plane


@dataclass(frozen=True, eq=False)
class _Springs:
    """A rotor in the plane x, beta on springs of several stiffnesses, in its modes on the softest ones.

    `inverse` (n,) are 1 / omega^2 there, the largest first, `held` (n, springs) the springs' places in the modes, in
    which K is I, and `stiffer` (stiffness, 1, 1) [N/m] is what the others have more: K = I + stiffer held held'.
    """

    inverse: NDArray[np.float64]
    held: NDArray[np.float64]
    stiffer: NDArray[np.float64]

    def lowest(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """The lowest real frequencies (stiffness, count) [rad/s] and whether their search, a subspace iteration, ended.

        Their number `real` is that of the positive `inverse`, whatever the springs (Sylvester), NaN beyond. r springs
        lower the k-th `inverse` at most to the (k + r)-th, and the subspace has room for the negative ones below minus
        that, which they do not multiply.
        """
        C, CT, d = self.held, self.held.T, self.stiffer
        n, total = len(C), int((self.inverse > len(C) * EPS * max(self.inverse[0], 0.0)).sum())
        real, last = min(count, total), min(count, total) + C.shape[1]
        flat = int((self.inverse < (-self.inverse[last - 1] if last <= total else 0.0)).sum())
        size = min(n, real + flat + _MORE)
        eased = d * np.linalg.inv(np.eye(C.shape[1]) + d * (CT @ C))
        start, springs = np.eye(n, size), C.shape[1]
        if 2 * springs <= _MORE and size < n:  # what the high modes have of every mode on springs, to second order
            first = size - 2 * springs
            start[:, first:] = np.hstack([C, self.inverse[:, None] * C])
            start[:first, first:] = 0.0
        Y, top = np.broadcast_to(start, (len(d), n, size)), np.zeros((len(d), real))
        ended: NDArray[np.bool_] = np.zeros(len(d), bool)
        for _ in range(_ITERATIONS):
            Q = np.linalg.qr(Y)[0]
            moved = CT @ Q
            lower = np.linalg.cholesky(np.eye(size) + d * (moved.mT @ moved))
            turn = np.linalg.inv(lower).mT
            found, mix = np.linalg.eigh(turn.mT @ (Q.mT @ (self.inverse[:, None] * Q)) @ turn)
            before, top = top, found[:, ::-1][:, :real]
            rounding = n * EPS * np.abs(found).max(axis=1, keepdims=True)
            ended = np.all((top > 0) & (np.abs(top - before) <= _RITZ * top + rounding), axis=1)
            if ended.all():
                break
            Y = self.inverse[:, None] * (Q @ (turn @ mix))
            Y = Y - C @ (eased @ (CT @ Y))
        wn = np.full((len(d), count), np.nan)
        wn[:, :real] = 1 / np.sqrt(np.where(top > 0, top, np.nan))
        return wn, ended

    def count_up_to(self, highest: NDArray[np.float64]) -> NDArray[np.float64]:
        """Number (stiffness,) of real frequencies up to the `highest` (stiffness,) [rad/s].

        The inertia of M - mu K is that of its first part, which is diagonal, and of what the springs make of it.
        """
        with np.errstate(divide="ignore"):
            least = 1 / (highest * (1 + _BEYOND)) ** 2
        above = self.inverse - least[:, None]
        moved = (self.held.T / above[:, None]) @ self.held
        soft = np.eye(self.held.shape[1]) - least[:, None, None] * self.stiffer * moved
        springs = (np.linalg.eigvalsh(np.where(np.isfinite(soft), soft, 0.0)) > 0).sum(axis=1) - soft.shape[1]
        return np.where(highest > 0, (above > 0).sum(axis=1) + springs, 0.0)


def _springs(
    M: NDArray[np.float64], K: NDArray[np.float64], unit: NDArray[np.float64], stiffness: NDArray[np.float64]
) -> _Springs:
    """The modes on springs of the first, softest `stiffness` at the degrees of freedom with a `unit`.

    K with springs is positive definite, M need not be.
    """
    inverse, modes = eigh(M, (K + K.T) / 2 + np.diag(stiffness[0] * unit))
    order = np.argsort(-inverse)
    held = (modes[:, order].T * np.sqrt(unit))[:, unit > 0]
    return _Springs(inverse[order], held, (stiffness - stiffness[0])[:, None, None])


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Least stable motion over speed.

    Attributes
    ----------
    speeds, log_dec, wn : ndarray (n_speeds,)
        Speed [rad/s], least logarithmic decrement [1] and natural frequency of its mode [rad/s].
    whirl : ndarray (n_speeds,) of str
        Its whirl; empty for a motion that does not oscillate.
    onset : float
        Lowest speed at which a mode becomes unstable [rad/s]; the first speed if it is unstable there already, NaN if
        all speeds are stable.
    onset_frequency : float
        Whirl frequency there [rad/s].
    """

    speeds: NDArray[np.float64]
    log_dec: NDArray[np.float64]
    wn: NDArray[np.float64]
    whirl: NDArray[np.str_]
    onset: float
    onset_frequency: float

    def dataset(self) -> xr.Dataset:
        """Labelled data over speed."""
        over = ("speed",)
        return dataset(
            {
                "log_dec": (over, self.log_dec, "1", "least logarithmic decrement"),
                "wn": (over, self.wn, "rad/s", "natural frequency of the least stable mode"),
                "whirl": (over, self.whirl, "", "sense of whirl"),
            },
            {"speed": (over, self.speeds, "rad/s", "speed of the shaft")},
            onset=self.onset,
            onset_frequency=self.onset_frequency,
        )


def run_stability(rotor: AssembledRotor, speeds: ArrayLike) -> StabilityResult:
    """Stability of `rotor` at `speeds` (n_speeds,) [rad/s], ascending, and the onset of instability between them.

    Examples
    --------
    >>> rotor.run_stability([0.0, 100.0, 200.0]).onset  # stable at all of them
    nan
    """
    speeds = grid("stability: speeds [rad/s]", speeds)
    kinks = {float(v) for b in rotor.bearing_elements for axis in b.axes for v in axis if speeds[0] < v < speeds[-1]}
    runs = {v: modal.run_modal(rotor, v) for v in sorted({*speeds.tolist(), *kinks})}
    places = [_place(rotor, run) for run in runs.values()]
    loss, _ = first_loss(lambda v: _place(rotor, modal.run_modal(rotor, v)), places, rtol=1e-9)
    zeta, wn, whirl = zip(*(_worst(runs[v]) for v in speeds.tolist()), strict=True)
    with np.errstate(divide="ignore"):
        log_dec = 2 * np.pi * np.array(zeta) / np.sqrt(1 - np.array(zeta) ** 2)
    return StabilityResult(speeds, log_dec, np.array(wn), np.array(whirl), *(loss or (np.nan, np.nan)))


def _worst(run: modal.ModalResult) -> tuple[float, float, str]:
    """Damping ratio, frequency and whirl of the mode with the least damping ratio; (-1, 0) of one that diverges."""
    if run.divergence > 0:
        return -1.0, 0.0, ""
    mode = int(run.damping_ratio.argmin())
    return float(run.damping_ratio[mode]), float(run.wn[mode]), str(run.whirl[mode])


def _place(rotor: AssembledRotor, run: modal.ModalResult) -> ModesAt:
    """The damping ratios at a speed, with their slopes out of a step towards another one."""

    def slopes(towards: float) -> NDArray[np.float64]:
        step = NEARBY * (towards - run.speed)
        near = modal.run_modal(rotor, run.speed + step)
        same = np.abs(near.eigenvalues[:, None] - run.eigenvalues).argmin(axis=0)
        return np.asarray((near.damping_ratio[same] - run.damping_ratio) / step)

    return ModesAt(run.speed, _worst(run)[:2], run.damping_ratio, slopes)
