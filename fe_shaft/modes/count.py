r"""Number of eigenvalues in a region that are not known, by the argument principle.

With the known ones divided out of the determinant,

.. math:: N = \frac{1}{2\pi i} \int_\Gamma \frac{g'}{g}\,ds, \qquad g(s) = \frac{\det(J - s S)}{\prod_k (s - \lambda_k)}

is 0 where none is missing, and g is so smooth that few points on the border tell its turns. It turns by what lies
outside; a neighbouring pencil, of which none is missing, has nearly the same outside: over the neighbour's g there is
hardly a turn left, and still fewer points tell it.

Source: Delves and Lyness (1967).

Cites: delves_lyness_1967.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe_shaft.modes.pencil import Quotient, Region

SMALL_STEP = 1e-6
"""Relative step of the derivative of the determinant."""
SURE = 0.3
"""Difference of the determinant's logarithm from what its derivative states below which a step is certain."""
BENT = 1.0
"""Curvature of the logarithm over half a step below which it is certain."""
SPLITS = 400
"""Steps after which the count along one side of the region is given up."""


def missing_in(region: Region, g: Quotient, like: Quotient | None = None) -> float:
    """Number of eigenvalues of the region that are not among the known ones, NaN where it stays open.

    Half of the border, from the real axis to the real axis: the other half is its mirror image. A region of every
    damping ratio is the whole disc. `like` is a neighbour's, to which none is missing.
    """
    end = np.pi - np.arccos(region.zeta)
    tilt, depth = np.exp(1j * end), np.log(region.reach / region.floor)
    sides = [
        (lambda t: region.reach * np.exp(1j * end * t), 1j * end, 2),
        (lambda t: region.reach * np.exp(-depth * t) * tilt, -depth, int(np.ceil(depth / 5))),
        (lambda t: region.floor * np.exp(1j * end * (1 - t)), -1j * end, 1),
    ]
    if region.zeta >= 1:
        sides = sides[:1]

    def log(s: complex) -> complex:
        return g.log(s) if like is None else g.log(s) - like.log(s)

    number = sum(_turned(log, *side) for side in sides) / np.pi
    return abs(float(np.round(number))) if abs(number - np.round(number)) < 0.05 else float("nan")


def _wrapped(change: complex) -> complex:
    """A change of a logarithm with its imaginary part between -pi and pi."""
    return complex(change.real, (change.imag + np.pi) % (2 * np.pi) - np.pi)


def _turned(log: Callable[[complex], complex], path: Callable[[float], complex], rate: complex, count: int) -> float:
    """Change of the phase of a logarithm along a path over 0 <= t <= 1 with ds/dt = rate s; NaN where it stays open.

    Steps are halved until modulus and phase change as the derivative in their middle states: a root close to the path
    bends them.
    """
    total, steps = 0.0, 0
    left_over = [(k / count, (k + 1) / count) for k in range(count)]
    while left_over:
        a, b = left_over.pop()
        m, steps = 0.5 * (a + b), steps + 1
        s = path(m)
        here = log(s)
        half = 0.5 * (b - a) * rate * _wrapped(log(s * (1 + SMALL_STEP)) - here) / SMALL_STEP
        off = _wrapped(here - log(path(a)) - half), _wrapped(log(path(b)) - here - half)
        if abs(off[0] + off[1]) < SURE and max(map(abs, off)) < BENT:
            total += (2 * half + off[0] + off[1]).imag
        elif steps > SPLITS or not np.isfinite(here):
            return float("nan")
        else:
            left_over += [(a, m), (m, b)]
    return total
