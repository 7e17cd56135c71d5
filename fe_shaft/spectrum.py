r"""All modes of a pencil in a region, each once, a double one twice, and their number proven.

Eigenpairs come from Krylov spaces and are refined as invariant subspaces. Inverse iteration runs from both sides, with
a Rayleigh-Ritz step for eigenvalues near one another: they are one subspace, whatever the distance. A mode that was met
twice lies in the span of the vectors that are known already.

Source: Saad (2011), chapters 4 to 7 (subspace iteration, two-sided projection, block Krylov spaces).

A small pencil's modes are all computed, others' are counted. What is missing among the known eigenvalues is counted by
the argument principle. With the known ones divided out of the determinant,

.. math:: N = \frac{1}{2\pi i} \int_\Gamma \frac{g'}{g}\,ds, \qquad g(s) = \frac{\det(J - s S)}{\prod_k (s - \lambda_k)}

is 0 where none is missing; else the same integrals of s g'/g and s^2 g'/g are the sums of the missing eigenvalues and
of their squares. g turns by what lies outside, in steps that see every root close to the border. A neighbouring
pencil's g must not be divided out: a root that came in over the border would stand next to its own former
place outside, and the two hide each other.

Source: Delves and Lyness (1967).

Cites: saad_2011, delves_lyness_1967, ostrowski_1959.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgeev

from fe_shaft.pencil import OSCILLATES, Modes, Pencil, Quotient, Region, Vector, nothing

SETTLED = 1e-11
"""Relative change of an eigenvalue after which its refinement ends."""
NEAR = 1e-3
"""Relative distance of eigenvalues that are refined as one subspace."""
ALIKE = 1e-3
"""Part of a vector outside the span of the vectors nearby below which it adds no mode."""
LOOSE = 1e10
"""Condition of left against right vectors above which they span no common subspace."""
SMALL = 130
"""Size up to which all eigenvalues are computed at once."""
QUOTIENTS = 8
"""Most Rayleigh quotients on the way to one mode."""
SHIFT_STAYS = 1e-4
"""Relative distance of the quotient from the shift up to which the factors stay."""
EVERYWHERE = Region(float("inf"), 0.0, 1.0)
"""Region of all modes."""
DEPTH, WIDTH = 14, 2
"""Steps of a block Krylov space and vectors of its block."""


def everything(pencil: Pencil) -> Modes:
    """All modes of a small pencil that are not below the real axis: none is missing."""
    S = pencil.times_S(_unit(pencil.size))
    real, imag, left, right, failed = dgeev(_state_matrix(pencil, S), overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the eigenvalues of a pencil do not converge")
    keep = np.flatnonzero(imag >= 0)
    behind = np.minimum(keep + 1, len(real) - 1)  # of a pair LAPACK keeps the real parts, then the imaginary ones
    values, turns = real[keep] + 1j * imag[keep], imag[keep] > 0
    right, left = (side[:, keep] + 1j * np.where(turns, side[:, behind], 0.0) for side in (right, left))
    left = left / np.diag(S)[:, None] if _diagonal(S) else np.linalg.solve(S.T, left)
    return Modes(values, right, _paired_nearby(pencil, values, right, left), 0.0)


def without_vectors(pencil: Pencil) -> Modes:
    """Eigenvalues of a small pencil that are not below the real axis, at a third of the cost: none is missing."""
    values = np.linalg.eigvals(_state_matrix(pencil, pencil.times_S(_unit(pencil.size)))).astype(complex)
    return replace(nothing(pencil.size), values=values[values.imag >= 0], missing=0.0)


def _state_matrix(pencil: Pencil, S: Vector) -> Vector:
    """S^-1 J (n, n)."""
    J = pencil.times_J(_unit(pencil.size))
    return J / np.diag(S)[:, None] if _diagonal(S) else np.linalg.solve(S, J)


@lru_cache(maxsize=8)
def _unit(size: int) -> Vector:
    """Unit matrix, which cannot be written into."""
    unit = np.eye(size)
    unit.flags.writeable = False
    return unit


def _diagonal(S: Vector) -> bool:
    return bool(np.count_nonzero(S) == len(S))


def around(pencil: Pencil, shift: complex) -> Modes:
    """Modes nearest to a shift [rad/s] in a block Krylov space of (J - shift S)^-1 S, with random left vectors."""
    factor, rng = pencil.factor(shift), np.random.default_rng(0)

    def inverse(block: Any) -> Any:
        return factor.solve(pencil.times_S(block))

    basis = np.linalg.qr(inverse(rng.standard_normal((pencil.size, WIDTH)) + 0j))[0]
    k = DEPTH * WIDTH
    H = np.zeros((k + WIDTH, k), complex)
    for j in range(0, k, WIDTH):
        new = inverse(basis[:, j:])
        for _ in range(2):  # twice is enough
            part = basis.conj().T @ new
            new = new - basis @ part
            H[: len(part), j : j + WIDTH] += part
        q, H[j + WIDTH : j + 2 * WIDTH, j : j + WIDTH] = np.linalg.qr(new)
        basis = np.hstack([basis, q])
    theta, y = np.linalg.eig(H[:k])
    values, open_ends = shift + 1 / theta, np.linalg.norm(H[k:] @ y, axis=0) / np.abs(theta)
    good = (open_ends < 1e-5) & (values.imag > -1e-9 * np.abs(values))
    right = basis[:, :k] @ y[:, good]
    left = rng.standard_normal(right.shape) + 1j * rng.standard_normal(right.shape)
    return Modes(values[good], right, left)


def unknown(known: Modes, new: Modes, region: Region) -> Modes:
    """The new modes in the region or near it that are not among the known ones."""
    grows = (np.abs(new.values.imag) <= OSCILLATES * np.abs(new.values)) & (new.values.real > 0)
    inside = np.flatnonzero(region.wider.holds(new.values) | grows)
    vectors = list(known.right.T)
    return new.take([k for k in inside if not _met(known.values, vectors, complex(new.values[k]), new.right[:, k])])


def _met(values: Any, vectors: Sequence[Vector], value: complex, vector: Vector) -> bool:
    """Whether a vector lies in the span of those with nearly the same eigenvalue."""
    near = [k for k, other in enumerate(values) if abs(value - other) < NEAR * abs(value)]
    if not near:
        return False
    span = np.column_stack([vectors[k] / np.linalg.norm(vectors[k]) for k in near])
    rest = vector - span @ np.linalg.lstsq(span, vector, rcond=None)[0]
    return bool(np.linalg.norm(rest) < ALIKE * np.linalg.norm(vector))


def predicted(pencil: Pencil, modes: Modes) -> Modes:
    """Two-sided Ritz values and vectors of a pencil in the subspaces of a neighbour's modes."""
    if not len(modes.values):
        return modes
    J, S = modes.left.conj().T @ pencil.times_J(modes.right), modes.left.conj().T @ pencil.times_S(modes.right)
    if len(modes.values) == 1:
        return Modes((J / S)[0], modes.right, modes.left / S.conj())
    values, turn = np.linalg.eig(np.linalg.solve(S, J))
    return Modes(values, modes.right @ turn, modes.left @ np.linalg.inv(S @ turn).conj().T)


def refined(pencil: Pencil, seed: Modes) -> Modes:
    """Modes of a pencil that grow out of those of a neighbour."""
    return settled(pencil, predicted(pencil, seed))


def settled(pencil: Pencil, guess: Modes) -> Modes:
    """Eigenpairs by inverse iteration from guesses, near ones together; what does not settle is left out.

    Where the iteration ends below the real axis, the partner above is the mode.
    """
    groups, left_over = list[list[int]](), list(range(len(guess.values)))
    while left_over:
        first = guess.values[left_over[0]]
        groups.append([k for k in left_over if abs(guess.values[k] - first) < NEAR * abs(first)])
        left_over = [k for k in left_over if k not in groups[-1]]
    alone = [group[0] for group in groups if len(group) == 1]
    found, open_ones = tracked(pencil, guess.take(alone))
    known = joined(pencil, nothing(pencil.size), found.above)
    for group in [[alone[k]] for k in open_ones] + [group for group in groups if len(group) > 1]:
        together = iterated(pencil, guess.take(group))
        each = [[k] for k in group] if together is None and len(group) > 1 else []
        for one in [together, *(iterated(pencil, guess.take(k)) for k in each)]:
            known = known if one is None else joined(pencil, known, one.above)
    return known


def iterated(pencil: Pencil, guess: Modes) -> Modes | None:
    """Eigenpairs of an invariant subspace by inverse iteration with a Ritz step from both sides; None if it stays open.

    The shift is moved onto the mean of the eigenvalues where that is slow.
    """
    values = guess.values
    right, left = np.linalg.qr(guess.right)[0], np.linalg.qr(guess.left)[0]
    for _ in range(6):
        shift = complex(values.mean()) * (1 + 1e-9)
        factor, before = pencil.factor(shift), values
        for turn in range(6):
            pushed = pencil.times_S(right)
            new = factor.solve(pushed)
            left = np.linalg.qr(factor.adjoint(pencil.times_S(left, True)))[0]
            apart = np.linalg.norm(new - right @ (right.conj().T @ new)) / np.linalg.norm(new)
            inner = left.conj().T @ pushed
            if not np.isfinite(apart) or np.linalg.cond(inner) > LOOSE:
                return None
            theta, mix = np.linalg.eig(np.linalg.solve(inner, left.conj().T @ pencil.times_S(new)))
            order = np.argsort(-np.abs(theta), kind="stable")
            values, vectors = shift + 1 / theta[order], new @ mix[:, order]
            right = np.linalg.qr(vectors)[0]
            change = np.abs(np.sort_complex(values) - np.sort_complex(before)).max()
            if turn and change < SETTLED * np.abs(values).min() and apart < 1e-6:
                return _paired(pencil, values, vectors / np.linalg.norm(vectors, axis=0), left)
            if turn and apart > 0.03:
                break
            before = values
    return None


def tracked(pencil: Pencil, guess: Modes) -> tuple[Modes, list[int]]:
    """The eigenpairs that guesses lead to by inverse iteration from both sides, and the guesses without an end.

    A shift follows Rayleigh's quotient until that moves by less than `SHIFT_STAYS`: with it the order of convergence is
    three (Ostrowski 1959). The guesses share the walks through a film's pattern.
    """
    right, left, values = guess.right + 0j, guess.left + 0j, guess.values + 0j
    done, waiting = np.zeros(len(values), bool), np.arange(len(values))
    for _ in range(QUOTIENTS if len(values) else 0):
        shifts = values[waiting]
        factor = pencil.factor(shifts * (1 + 1e-13))
        for _ in range(QUOTIENTS):
            x = factor.solve(pencil.times_S(right[:, waiting]))
            y = factor.adjoint(pencil.times_S(left[:, waiting], True))
            x, y = x / np.linalg.norm(x, axis=0), y / np.linalg.norm(y, axis=0)
            size = np.sum(y.conj() * pencil.times_S(x), axis=0)
            found = np.sum(y.conj() * pencil.times_J(x), axis=0) / size
            done[waiting] |= np.abs(found - values[waiting]) < SETTLED * np.abs(found)
            right[:, waiting], left[:, waiting], values[waiting] = x, y / size.conj(), found
            moved_on = ~(np.abs(found - shifts) < SHIFT_STAYS * np.abs(found))
            if (done[waiting] | moved_on).all():
                break
        waiting = waiting[moved_on & ~done[waiting] & np.isfinite(found)]
        if not len(waiting):
            break
    return Modes(values, right, left).take(done), np.flatnonzero(~done).tolist()


def _paired(pencil: Pencil, values: Vector, right: Vector, left: Vector) -> Modes | None:
    """The modes with left vectors out of a left subspace that make left^H S right = I."""
    overlap = left.conj().T @ pencil.times_S(right)
    if np.linalg.cond(overlap) > LOOSE:
        return None
    return Modes(values, right, left @ np.linalg.inv(overlap).conj().T)


def joined(pencil: Pencil, known: Modes, new: Modes) -> Modes:
    """Known modes, then new ones that are not among them; left and right vectors of near eigenvalues are paired."""
    values, right, left = list(known.values), list(known.right.T), list(known.left.T)
    for value, x, y in zip(new.values, new.right.T, new.left.T, strict=True):
        if _met(values, right, value, x):
            continue
        values.append(value)
        right.append(x)
        left.append(y)
    if not values:
        return known
    V, Y, s = np.column_stack(right), np.column_stack(left), np.array(values)
    return Modes(s, V, _paired_nearby(pencil, s, V, Y))


def _paired_nearby(pencil: Pencil, s: Vector, right: Vector, left: Vector) -> Vector:
    """Left vectors with left^H S right = I among near eigenvalues; those of distant ones are orthogonal as they are."""
    pushed = pencil.times_S(right)
    close = np.abs(s[:, None] - s) < NEAR * np.abs(s[:, None])
    near = np.flatnonzero((close | close.T).sum(axis=0) > 1)
    paired = left / np.sum(left.conj() * pushed, axis=0).conj()
    if near.size:
        among = np.where(close[np.ix_(near, near)], left[:, near].conj().T @ pushed[:, near], 0.0)
        paired[:, near] = left[:, near] @ np.linalg.pinv(among).conj().T
    return paired


FARTHEST = 1e4
"""Multiple of the region's reach up to which growth without oscillation is searched in a large pencil."""
NEARLY = 1.01
"""Ratio of the ends of an interval that holds a real root, from which its vector is computed."""
ANGLES = (112.0, 80.0, 119.0, 100.0, 60.0)
"""Angles [deg] in the complex plane of shifts about a modulus at which a mode is missing."""
MODULUS_WITHIN = 1.2
"""Ratio of the ends of an interval that holds the modulus of a missing mode, within which shifts find it."""
SMALL_STEP = 1e-6
"""Relative step of the derivative of the determinant."""
SURE = 0.3
"""Difference of the logarithm's change from what its derivatives state below which a step is certain."""
BENT = 4.0
"""Change of its derivative times a step below which the step is certain: a root within the step makes it 4 or more."""
SPLITS = 400
"""Steps a side of the region after which the count is given up."""
FIRST_ENDS = np.array([0.0, 0.6, 1.2, 2.0, 3.5])
"""Logarithms of the reach over the modulus between which the first steps along the limit of damping lie."""


def modes_in(pencil: Pencil, region: Region, hints: Sequence[float] = (), seed: Modes | None = None) -> Modes:
    """All modes of a pencil in the region, their number proven.

    Parameters
    ----------
    pencil : Pencil
    region : Region
    hints : sequence of float
        Frequencies [rad/s] around which modes are expected.
    seed : Modes, optional
        Those of a neighbouring pencil, from which these are refined before others are looked for.

    Returns
    -------
    Modes
        Those of the region and some around it that were met; `missing` is 0 where the count proves it complete. A
        pencil that was asked before, in a region that covers this one, answers as it did.
    """
    before = next((modes for other, modes in pencil.complete.items() if other.covers(region)), None)
    if before is not None:
        return before
    small = pencil.size <= SMALL
    known = everything(pencil) if small else _down_to(pencil, region) or _found(pencil, region, hints, seed)
    known = known.take(np.argsort(np.abs(known.values), kind="stable"))
    if known.proven:
        pencil.complete[EVERYWHERE if small else region] = known
    return known


def _down_to(pencil: Pencil, region: Region) -> Modes | None:
    """Modes known above a higher floor alone, where a count below that proves that none is missing; None else."""
    for other, modes in pencil.complete.items():
        if replace(other, floor=region.floor).covers(region):
            below = replace(region, reach=other.floor)
            if missing_in(below, modes.quotient or Quotient(pencil, modes.values)) == 0:
                return modes
    return None


def _found(pencil: Pencil, region: Region, hints: Sequence[float], seed: Modes | None) -> Modes:
    """Modes grown out of the seed, then modes around shifts until the count proves that none is missing.

    The shifts lie where modes are expected, then at the mean of those that are missing, then about the lowest of them.
    """
    if seed is None:
        known = _sought(pencil, region, nothing(pencil.size), _expected(region, hints))
    else:
        known = refined(pencil, seed)
    known = counted(pencil, known, region, seed)
    while not known.proven:
        for find in (mean_missing, _about_missing):
            more = _sought(pencil, region, known, find(known, region))
            if len(more.values) > len(known.values):
                break
        else:
            break
        known = counted(pencil, more, region, known)
    return _with_growth(pencil, region, known)


def _sought(pencil: Pencil, region: Region, known: Modes, shifts: Sequence[complex]) -> Modes:
    """Known modes and those around shifts."""
    for shift in shifts:
        known = joined(pencil, known, settled(pencil, unknown(known, around(pencil, shift), region)))
    return known


def counted(pencil: Pencil, known: Modes, region: Region, near: Modes | None = None) -> Modes:
    """The modes with the number of those of the region that are missing among them.

    The border is walked in the steps of `near`, modes of the same or a neighbouring pencil that were counted.
    """
    counted_before = None if near is None else near.quotient
    g = Quotient(pencil, known.values, *([counted_before.steps] if counted_before else []))
    return replace(known, missing=missing_in(region, g), quotient=g)


def _with_growth(pencil: Pencil, region: Region, known: Modes) -> Modes:
    """The modes with a motion beyond the region that grows without oscillation, where the determinant's sign shows one.

    On the positive real axis the determinant over the known roots is real; between the reach and `FARTHEST` of it an
    odd number of real roots changes its sign.
    """
    g = known.quotient or Quotient(pencil, known.values)

    def positive(s: float) -> bool:
        return bool(np.cos(g.log(np.array([complex(s)])).imag.item()) > 0)

    low, high = region.reach, FARTHEST * region.reach
    if positive(low) == positive(high):
        return known
    while high > NEARLY * low:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if positive(middle) == positive(low) else (low, middle)
    more = settled(pencil, unknown(known, around(pencil, complex(np.sqrt(low * high))), region))
    found = joined(pencil, known, more)
    return replace(found, missing=known.missing, quotient=Quotient(pencil, found.values))


def _expected(region: Region, hints: Sequence[float]) -> list[complex]:
    """Shifts [rad/s] around the hints and evenly over the reach."""
    near = [h for h in hints if region.floor < h < region.reach]
    even = [region.reach * (k + 0.5) / 3 for k in range(3)]
    return [1j * f for f in [*near, *(f for f in even if all(abs(f - h) > 0.1 * region.reach for h in near))]]


def mean_missing(known: Modes, region: Region) -> list[complex]:
    """The mean of the missing modes as the moments of the determinant's turn have it, where it lies in the region.

    The sums of the missing eigenvalues and of their squares are real: each counts with its partner.
    """
    assert known.quotient is not None
    number, first, second = _moments(region, replace(known.quotient, steps={}))  # on steps that were not joined
    mean = first / number + 1j * np.sqrt(np.maximum((first / number) ** 2 - second / number, 0.0))
    return [complex(mean)] if region.wider.holds(mean) else []


def _about_missing(known: Modes, region: Region) -> list[complex]:
    """Shifts [rad/s] of the lowest modulus about which a mode is missing, by counts in parts of the region."""
    low, high = region.floor, region.reach
    assert known.quotient is not None
    while high > MODULUS_WITHIN * low:
        middle = float(np.sqrt(low * high))
        if missing_in(replace(region, floor=low, reach=middle), known.quotient) == 0:
            low = middle
        else:
            high = middle
    return [np.sqrt(low * high) * np.exp(1j * np.deg2rad(angle)) for angle in ANGLES]


def missing_in(region: Region, g: Quotient) -> float:
    """Number of eigenvalues of the region that are not among the known ones, NaN where it stays open.

    A region of every damping ratio is the whole disc.
    """
    turned = _moments(region, g)[0] / np.pi
    return abs(float(np.round(turned))) if abs(turned - np.round(turned)) < 0.05 else float("nan")


def _sides(region: Region) -> list[Side]:
    """Upper half of the border, from the real axis to the real axis: the other half is its mirror image."""
    end = np.pi - np.arccos(region.zeta)
    tilt, depth = np.exp(1j * end), np.log(region.reach / region.floor)
    arc, ends = np.linspace(0.0, 1.0, 3), FIRST_ENDS
    if region.zeta >= 1:
        return [(lambda t: region.reach * np.exp(1j * end * t), 1j * end, arc)]
    return [
        (lambda t: region.reach * np.exp(1j * end * t), 1j * end, arc),
        (lambda t: region.reach * np.exp(-depth * t) * tilt, -depth, np.append(ends[depth > ends] / depth, 1.0)),
        (lambda t: region.floor * np.exp(1j * end * (1 - t)), -1j * end, arc[::2]),
    ]


def _wrapped(change: Vector) -> Vector:
    """Changes of a logarithm with imaginary parts between -pi and pi."""
    return np.asarray(change.real + 1j * ((change.imag + np.pi) % (2 * np.pi) - np.pi))


Side = tuple[Callable[[Any], Any], complex, Vector]


def _moments(region: Region, g: Quotient) -> Vector:
    """Change of the phase of a determinant along half the border, and of its moments with s and s^2; NaN where open.

    A side is a path over 0 <= t <= 1, its rate in ds/dt = rate s and its first steps. Steps are halved until modulus
    and phase change as the derivatives at both ends state: a root close to the path bends them. A neighbour's steps,
    those joined of which it needed no two, are the first ones where it has been counted.
    """
    sides = _sides(region)
    rates, total, steps, kept = np.array([rate for _, rate, _ in sides]), np.zeros(3), 0, list[Vector]()
    first = [(n, a, b) for n, (_, _, ends) in enumerate(sides) for a, b in pairwise(ends.tolist())]
    open_steps, far = g.steps.get(region, first), [FARTHEST * region.reach]  # which `_with_growth` asks for
    while open_steps:
        steps += len(open_steps)
        s = np.array([sides[n][0](t) for n, *ends in open_steps for t in ends], complex)
        logs = g.log(np.concatenate([s, s * (1 + SMALL_STEP), far]))[: 2 * len(s)].reshape(2, -1, 2)
        ends, far = np.array(open_steps), []
        rate, width = rates[ends[:, 0].astype(int)], ends[:, 2] - ends[:, 1]
        slopes = rate[:, None] * _wrapped(logs[1] - logs[0]) / SMALL_STEP
        sure, change = _certain(width, logs[0], slopes)
        if steps > SPLITS * len(sides) or not np.isfinite(change).all():
            return np.full(3, np.nan)
        begin, end = slopes.T * width
        simpson = np.array([begin, 6 * change - begin - end, end]) / 6  # of the cubic through both ends
        path = s[::2] * np.exp(rate * width * np.array([[0.0], [0.5], [1.0]]))
        total += (simpson * path ** np.arange(3)[:, None, None]).sum(axis=1).imag[:, sure].sum(axis=1)
        kept.append(np.hstack([ends, logs[0], slopes])[sure])
        halves = [(n, a, 0.5 * (a + b), b) for (n, a, b), one in zip(open_steps, sure.tolist(), strict=True) if not one]
        open_steps = [half for n, a, middle, b in halves for half in ((n, a, middle), (n, middle, b))]
    g.steps[region] = _joined_steps(np.vstack(kept))
    return total


def _certain(width: Vector, logs: Vector, slopes: Vector) -> tuple[Vector, Vector]:
    """Which steps (k,) of a width are certain by logarithms and slopes (k, 2) at their ends, and the change in each."""
    mean = 0.5 * width * slopes.sum(axis=1)
    off = _wrapped(logs[:, 1] - logs[:, 0] - mean)
    return (np.abs(off) < SURE) & (width * np.abs(slopes[:, 1] - slopes[:, 0]) < BENT), mean + off


def _joined_steps(kept: Vector) -> list[tuple[int, float, float]]:
    """Steps in turn, two of them as one where that is certain too."""
    kept = kept[np.lexsort(kept[:, 1::-1].real.T)]
    pairs = [kept[k : len(kept) - 1 + k : 2] for k in range(2)]
    one, two = (pair[: len(pairs[1])] for pair in pairs)
    sure, _ = _certain((two[:, 2] - one[:, 1]).real, *(np.stack([one[:, k], two[:, k + 1]], axis=1) for k in (3, 5)))
    left_out = 2 * np.flatnonzero(sure & (one[:, 0] == two[:, 0]))
    ends = kept[:, :3].real.copy()
    ends[left_out, 2] = ends[left_out + 1, 2]
    return [(int(n), a, b) for n, a, b in np.delete(ends, left_out + 1, axis=0).tolist()]
