"""LU factorisation with row exchanges of small dense matrices in a flat workspace."""

from __future__ import annotations

from reynolds.jit import inlined


@inlined
def factor_matrix(w, A, pivots, n):
    """LU factors of the n x n matrix at offset A in its place; the rows exchanged go to offset `pivots`."""
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(w[A + c * n + r]) > abs(w[A + c * n + best]):
                best = r
        w[pivots + c] = best
        if best != c:
            for k in range(n):
                w[A + k * n + c], w[A + k * n + best] = w[A + k * n + best], w[A + k * n + c]
        for r in range(c + 1, n):
            w[A + c * n + r] /= w[A + c * n + c]
        for k in range(c + 1, n):
            for r in range(c + 1, n):
                w[A + k * n + r] -= w[A + c * n + r] * w[A + k * n + c]


@inlined
def solve_matrix(w, A, pivots, b, n):
    """Solve in place for the right-hand side at offset b, with the factors of `factor_matrix`."""
    for c in range(n):
        best = int(w[pivots + c])
        w[b + c], w[b + best] = w[b + best], w[b + c]
    for c in range(n):
        for r in range(c + 1, n):
            w[b + r] -= w[A + c * n + r] * w[b + c]
    for back in range(n):
        c = n - 1 - back
        w[b + c] /= w[A + c * n + c]
        for r in range(c):
            w[b + r] -= w[A + c * n + r] * w[b + c]
