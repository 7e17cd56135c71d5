"""Closed loop of plant and law as one compiled kernel, bit-identical to `experiments.controlled`.

The kernel is a small generated module, as the plant's own is, so that numba keeps its machine code on disk.
"""

from __future__ import annotations

from types import ModuleType

from rotorsim.base.cache import key_of, sources_hash
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.compose import load_module
from rotorsim.plant.kernels.columns import READ

TEXT = '''from reynolds.jit import kernel
from rotorsim.control.runtime.kernels import clip, step
from {plant} import run


@kernel
def run_loop(w, ix, P, rows, out, n, row, line, lw, table, axes, L, S, command, limit, frozen, channel, held):
    """Advance by one sample for each row; references are added to the law's and limited. Returns samples done.

    From sample `frozen` on the law sees channel `channel` as it was (a sensor that hangs).
    """
    for i in range(rows.shape[0]):
        for k in range(6):
            row[0, k] = rows[i, k]
        row[0, 2] = clip(rows[i, 2] + command[0], limit)
        row[0, 3] = clip(rows[i, 3] + command[1], limit)
        rows[i, 2] = row[0, 2]
        rows[i, 3] = row[0, 3]
        if run(w, ix, P, row, line, n) < 1:
            return i
        for k in range(out.shape[1]):
            out[i, k] = line[0, k]
        if i <= frozen:
            held[0] = line[0, {read}]
            held[1] = line[0, {read} + 1]
        x = held[0] if channel == 0 else line[0, {read}]
        y = held[1] if channel == 1 else line[0, {read} + 1]
        if L.pn > 0:
            lw[L.applied] = 1.0
            lw[L.applied + 1] = rows[i, 2]
            lw[L.applied + 2] = rows[i, 3]
        step(lw, table, axes, L, S, x, y, line[0, {read} + 3], line[0, {read} + 4], command)
    return rows.shape[0]
'''


def loop_module(assembly: Assembly) -> ModuleType:
    """The module with `run_loop` for a machine."""
    text = TEXT.format(plant=assembly.module.__name__, read=READ)
    key = key_of(text, sources_hash("rotorsim/control/runtime"))
    return load_module(f"rotorsim_loop_{key[:16]}", lambda: text)
