"""Table of the study over the operating grid, and errors against the linearised physics."""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import TO_MPA, TO_RPM, TO_UM
from rotorsim.study.identification_vs_physics import Study

HEADS = ("rpm", "MPa", "f1", "f1 phys", "f2", "f2 phys", "zeta1", "z1 phys", "zeta2", "z2 phys", "Gxx", "Gxx phys",
         "Gyy", "Gyy phys", "Gxy", "Gxy phys", "Gyx", "Gyx phys", "delay x", "film x", "delay y", "film y", "fit x",
         "fit y", "ceil x", "ceil y")  # fmt: skip
GAINS = ((0, 0), (1, 1), (0, 1), (1, 0))


def rows(study: Study, kind: str = "3") -> list[list[float]]:
    """Numbers under HEADS of a model over the grid: Hz, um/V, ms, per cent."""
    found = []
    for point, p in zip(study.points, study.physics, strict=True):
        r = point.found[kind]
        row = [r.speed * TO_RPM, r.pressure * TO_MPA]
        row += [v / (2 * np.pi) for pair in zip(r.wn, p.wn, strict=True) for v in pair]
        row += [v for pair in zip(r.zeta, p.zeta, strict=True) for v in pair]
        row += [v * TO_UM for at in GAINS for v in (r.static_gain[at], p.static_gain[at])]
        row += [v * 1e3 for pair in zip(r.delay, p.delay, strict=True) for v in pair]
        found.append([float(v) for v in [*row, *(100 * r.fit), *(100 * r.ceiling)]])
    return found


def errors(study: Study, kind: str) -> dict[str, np.ndarray]:
    """Relative errors (k, 2) of a model against the physics: wn, zeta, gain (the direct ones)."""
    found = [point.found[kind] for point in study.points]
    out = {key: np.array([getattr(r, key) / getattr(p, key) - 1 for r, p in zip(found, study.physics, strict=True)])
           for key in ("wn", "zeta")}  # fmt: skip
    gains = [np.diag(r.static_gain) / np.diag(p.static_gain) - 1 for r, p in zip(found, study.physics, strict=True)]
    return {**out, "gain": np.array(gains)}


def summary(study: Study) -> dict[str, dict[str, float]]:
    """Largest and mean errors [%] of Models 2 and 3 against the physics."""
    names = {"wn": "frequency", "zeta": "zeta", "gain": "direct gain"}
    return {
        f"Model {kind}": {
            f"{name}, {word}": float(100 * value)
            for key, name in names.items()
            for word, value in (("largest", np.abs(found[key]).max()), ("mean", found[key].mean()))
        }
        for kind in ("2", "3")
        for found in [errors(study, kind)]
    }
