"""What the study's figures show: quantities over the grid, identified, of the surfaces and of the physics."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.study.identification_vs_physics import Study

DERIVED = (
    ("f1 [Hz]", "wn", (0,), 1 / (2 * np.pi)), ("f2 [Hz]", "wn", (1,), 1 / (2 * np.pi)),
    ("zeta 1", "zeta", (0,), 1.0), ("zeta 2", "zeta", (1,), 1.0),
    ("Gxx [um/V]", "static_gain", (0, 0), 1e6), ("Gyy [um/V]", "static_gain", (1, 1), 1e6),
    ("Gxy [um/V]", "static_gain", (0, 1), 1e6), ("Gyx [um/V]", "static_gain", (1, 0), 1e6),
    ("lag x [ms]", "delay", (0,), 1e3), ("lag y [ms]", "delay", (1,), 1e3),
)  # fmt: skip
UNITS = {"K": "1/s^2", "D": "1/s", "B": "m/(s^2 V)"}


def figures(study: Study) -> list[tuple[str, str, Any]]:
    """Title, sentence and figure of each."""
    from rotorsim.report.identification_plots import over_speed

    points, panels = study.points, []
    for title, key, index, scale in DERIVED:
        dots = np.array([np.asarray(getattr(r, key))[index] for r in study.results]) * scale
        crosses = np.array([np.asarray(getattr(p, key))[index] for p in study.physics]) * scale
        panels.append((title, dots, crosses, _surface(study, key, index, scale)))
    elements: list[Any] = []
    for i, name in enumerate(study.lpv.parameters[:12]):
        dots = np.array([r.theta[i] for r in study.results])
        crosses = np.array([p.KDB[i] for p in study.physics])
        elements.append((f"{name} [{UNITS[name[0]]}]", dots, crosses, _element(study, i)))
    says = "Dots: Model 3 from records; lines: second-order surfaces; crosses: linearised physics."
    return [
        (
            "Frequencies, damping, gains, lags",
            says + " The physics' lag is the film's alone.",
            over_speed(points, panels),
        ),
        ("K, D, B", says + " Crosses: least squares on the linearised plant's response.", over_speed(points, elements)),
    ]


def _surface(study: Study, key: str, index: tuple[int, ...], scale: float) -> Any:
    return lambda speed, pressure: float(study.lpv.derived(speed, pressure)[key][index] * scale)


def _element(study: Study, i: int) -> Any:
    return lambda speed, pressure: float(study.lpv.theta(speed, pressure)[i])
