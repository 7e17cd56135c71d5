r"""Direct solver for the ring of theta lines (block cyclic tridiagonal, diagonal couplings).

Line i has a tridiagonal block D_i in z and diagonal couplings W_i, E_i to its neighbours. The ring is cut at line 0;
the lines to either side are eliminated by two chains that meet half-way,

.. math:: D_i \leftarrow D_i - W_i D_{i-1}^{-1} E_{i-1},

and the cut is closed by a spike: x_i = x'_i - S_i x_0, with x' the solution for x_0 = 0. Only D_i^{-1} and S_i are
stored, as dense blocks column by column, so that a solve is three small matrix-vector products a line. Source: Golub
& Van Loan (2013), sections 4.5 and 4.8 (block elimination, bordering).
"""

from __future__ import annotations

from reynolds.jit import inlined
from reynolds.lanes import add_columns, multiply


@inlined
def invert_block(w, block, n):
    """Invert in place by Gauss-Jordan, column by column; the blocks are diagonally dominant, so no pivoting."""
    for c in range(n):
        pivot = 1.0 / w[block + c * n + c]
        w[block + c * n + c] = 1.0
        for b in range(n):
            if b != c:
                factor = w[block + b * n + c] * pivot
                w[block + b * n + c] = 0.0
                for a in range(n):
                    w[block + b * n + a] -= w[block + c * n + a] * factor
                w[block + b * n + c] = factor
        for a in range(n):
            w[block + c * n + a] *= -pivot
        w[block + c * n + c] = pivot


@inlined
def load_block(w, L, i, k):
    """Write the tridiagonal block of the line starting at cell k into inverse block i."""
    n = L.n_rows
    block = L.inverse + i * n * n
    for e in range(n * n):
        w[block + e] = 0.0
    for a in range(n):
        w[block + a * n + a] = w[L.diag + k + a]
        if a > 0:
            w[block + (a - 1) * n + a] = w[L.down + k + a]
        if a < n - 1:
            w[block + (a + 1) * n + a] = w[L.up + k + a]


@inlined
def eliminate(w, L, i, other, to_other, from_other):
    """D_i -= T_i D_other^-1 F_other, T and F diagonal (array offsets)."""
    n = L.n_rows
    k, ko = L.first + i * L.stride, L.first + other * L.stride
    block, inverse = L.inverse + i * n * n, L.inverse + other * n * n
    for b in range(n):
        for a in range(n):
            w[block + b * n + a] -= w[to_other + k + a] * w[inverse + b * n + a] * w[from_other + ko + b]


@inlined
def factor(w, L):
    """Eliminate both chains of the Jacobian in diag, west, east, down, up; `close_ring` completes the factorisation."""
    n, s, half = L.n_rows, L.stride, L.n_theta // 2
    for order in range(L.n_theta):
        # 0, then 1, N-1, 2, N-2, ... and the middle last
        step = (order + 1) // 2
        ahead = order % 2 == 1
        i = step if ahead or step == 0 else L.n_theta - step
        load_block(w, L, i, L.first + i * s)
        for side in range(2):
            inner = (side == 0 and ahead and step > 1) or (side == 1 and not ahead and step > 1)
            if inner or (i == half and order > 1):
                other = i - 1 if side == 0 else i + 1
                to_other = L.west if side == 0 else L.east
                from_other = L.east if side == 0 else L.west
                eliminate(w, L, i, other, to_other, from_other)
        if i > 0:
            invert_block(w, L.inverse + i * n * n, n)


@inlined
def spike_rhs(w, L, c):
    """Couplings of the open chain to unknown c of line 0, into r."""
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[L.r + k] = 0.0
    first_line, last_line = L.first + L.stride, L.first + (L.n_theta - 1) * L.stride
    w[L.r + first_line + c] = w[L.west + first_line + c]
    w[L.r + last_line + c] = w[L.east + last_line + c]


@inlined
def keep_spike(w, L, c):
    """Store the spike column just solved in r, and complete the closing block with the last one."""
    n, s = L.n_rows, L.stride
    first_line, last_line = L.first + s, L.first + (L.n_theta - 1) * s
    column = L.spike + c * L.length
    for k in range(L.length):
        w[column + k] = w[L.r + k]
    for i in range(L.n_theta):
        for e in range(n if i > 0 else 0, s):
            w[column + L.first + i * s + e] = 0.0
    for a in range(n):
        w[L.closure + c * n + a] = w[L.inverse + c * n + a] - (
            w[L.east + L.first + a] * w[L.r + first_line + a] + w[L.west + L.first + a] * w[L.r + last_line + a]
        )
    if c == n - 1:
        invert_block(w, L.closure, n)


@inlined
def open_solve(w, L, r):
    """Solve the open chain of lines 1 .. n_theta - 1 in place for the right-hand side at r."""
    n, s, half = L.n_rows, L.stride, L.n_theta // 2
    o = L.lanes
    u = o + s
    for step in range(1, half):
        a, b = L.first + step * s, L.first + (L.n_theta - step) * s
        multiply(w, L.inverse + step * n * n, r + a, o, n, False)
        multiply(w, L.inverse + (L.n_theta - step) * n * n, r + b, u, n, False)
        for e in range(n):
            w[r + a + e] = w[o + e]
            w[r + b + e] = w[u + e]
            w[r + a + s + e] -= w[L.west + a + s + e] * w[o + e]
        for e in range(n):
            w[r + b - s + e] -= w[L.east + b - s + e] * w[u + e]
    middle = r + L.first + half * s
    multiply(w, L.inverse + half * n * n, middle, o, n, False)
    for e in range(n):
        w[middle + e] = w[o + e]
    for back in range(1, half):
        step = half - back
        a, b = L.first + step * s, L.first + (L.n_theta - step) * s
        for e in range(n):
            w[o + e] = w[L.east + a + e] * w[r + a + s + e]
            w[u + e] = w[L.west + b + e] * w[r + b - s + e]
        multiply(w, L.inverse + step * n * n, o, r + a, n, True)
        multiply(w, L.inverse + (L.n_theta - step) * n * n, u, r + b, n, True)


@inlined
def close_ring(w, L, r):
    """Turn the open chain's solution at offset r into the ring's; edge values become 0."""
    n, s, last = L.n_rows, L.stride, L.n_theta - 1
    first, tail, zero = L.first + s, L.first + last * s, L.first
    o = L.lanes
    for i in range(L.n_theta):
        for e in range(n, s):
            w[r + L.first + i * s + e] = 0.0
    for a in range(n):
        w[o + a] = w[r + zero + a] - w[L.east + zero + a] * w[r + first + a] - w[L.west + zero + a] * w[r + tail + a]
        w[o + s + a] = 0.0
    multiply(w, L.closure, o, o + s, n, True)
    for a in range(n):
        w[r + zero + a] = -w[o + s + a]
    add_columns(w, r, L.spike, L.length, o + s, n, first, last * s)
