r"""Secants of a stage: each correction with the frozen factors teaches the next ones what the factors are wrong in.

Broyden's update of the frozen Jacobian B after a step s, with a vector v to the left,

.. math:: B_+ = B + \frac{f(x + s)\,v^T}{v^T s}, \qquad B s = -f(x),

is applied to the correction z that the frozen factors give as a product over the steps of the stage,

.. math:: z \leftarrow z + s_{j+1} \frac{v_j^T z}{v_j^T s_j} \quad (j < n - 1), \qquad
          s_n = z \Big/ \Big(1 - \frac{v_{n-1}^T z}{v_{n-1}^T s_{n-1}}\Big),

so that nothing but the steps is stored (Kelley 1995, section 7.3). v is the step weighted so that the product is one of
pressures. Where a narrow gap travels round the film the frozen factors hold for a stage or two, and secants halve the
corrections.

Cites: broyden_1965, kelley_1995.
"""

from __future__ import annotations

from reynolds.grid import SECANTS
from reynolds.jit import inlined
from reynolds.lanes import add_columns, dot

LEAST, MOST = -1.0, 0.8
"""Bounds of the last secant's part in a correction, which it makes half to five times as long."""


@inlined
def share(w, L, j):
    """Part of step j in the correction in r."""
    return dot(w, L.secant + (SECANTS + j) * L.length + L.first, L.r + L.first, L.span) / w[L.secant_small + j]


@inlined
def learn(w, L, n):
    """Improve the n-th correction of a stage, in r and w[small], by the ones before it, and keep it."""
    known, o, x = n % SECANTS, L.secant_small + SECANTS, L.small + L.n_inj
    cells = L.n_theta * L.stride
    for j in range(known - 1):
        w[L.lanes] = share(w, L, j)
        add_columns(w, L.r, L.secant + (j + 1) * L.length, L.length, L.lanes, 1, L.first, cells)
        for a in range(2):
            w[x + a] += w[L.lanes] * w[o + 2 * (j + 1) + a]
    longer = 1.0
    if known > 0:
        part = share(w, L, known - 1)
        longer = 1.0 / (1.0 - min(max(part, LEAST), MOST))
    step, weighted = L.secant + known * L.length, L.secant + (SECANTS + known) * L.length
    for k in range(L.first, L.first + cells):
        r = longer * w[L.r + k]
        w[L.r + k] = r
        w[step + k] = r
        w[weighted + k] = r * w[L.two_p + k] * w[L.two_p + k]
    for a in range(2):
        w[x + a] *= longer
        w[o + 2 * known + a] = w[x + a]
    w[L.secant_small + known] = dot(w, weighted + L.first, step + L.first, L.span)
