"""The study's table over the grid: identified beside linearised physics, one row per operating point."""

from __future__ import annotations

import numpy as np

from rotorsim.study.identification_vs_physics import Study

HEADS = ("rpm", "MPa", "f1", "f1 phys", "f2", "f2 phys", "zeta1", "z1 phys", "zeta2", "z2 phys", "Gxx", "Gxx phys",
         "Gyy", "Gyy phys", "lag x", "film x", "lag y", "film y", "fit x", "fit y", "ceil x", "ceil y")  # fmt: skip


def rows(study: Study) -> list[list[float]]:
    """Numbers under HEADS: Hz, um/V, ms, per cent."""
    found = []
    for r, p in zip(study.results, study.physics, strict=True):
        pairs = zip(np.r_[r.wn, r.zeta], np.r_[p.wn, p.zeta], strict=True)
        scales = (1 / (2 * np.pi), 1 / (2 * np.pi), 1.0, 1.0)
        row = [r.speed * 30 / np.pi, r.pressure * 1e-6]
        for scale, pair in zip(scales, pairs, strict=True):
            row += [v * scale for v in pair]
        for i in range(2):
            row += [r.static_gain[i, i] * 1e6, p.static_gain[i, i] * 1e6]
        for i in range(2):
            row += [r.delay[i] * 1e3, p.delay[i] * 1e3]
        found.append([float(v) for v in [*row, *(100 * r.fit), *(100 * r.ceiling)]])
    return found


def summary(study: Study) -> dict[str, float]:
    """Largest and mean errors of Model 3 against the physics: frequencies [%], zeta [%], static gains [%]."""
    wn, zeta, gain = (
        np.array([[getattr(r, key) / getattr(p, key) - 1]
                  for r, p in zip(study.results, study.physics, strict=True)]).squeeze(1)
        for key in ("wn", "zeta", "static_gain")
    )  # fmt: skip
    direct = gain[:, [0, 1], [0, 1]]
    found = {}
    for name, values in (("frequency", wn), ("zeta", zeta), ("direct_gain", direct)):
        found[f"{name}_error_largest_percent"] = float(100 * np.abs(values).max())
        found[f"{name}_error_mean_percent"] = float(100 * values.mean())
    return found
