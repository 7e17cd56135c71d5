"""Loop overview: worst pole, damping, margins and sensitivities over the model's operating range."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification import LinearModel
from rotorsim.control.designs.plants import Model, point_text, sampled_plant
from rotorsim.control.law import Law
from rotorsim.control.loop.sampled_loop import law_system, loop_of, smallest_damping, sweep

FINE = (40, 15)
COARSE = (5, 4)


def fine_axes(law: Law, model: Model, size: tuple[int, int] = FINE) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and pressures of the range in which a law is to work: the model's, from the law's slowest speed up."""
    if isinstance(model, LinearModel):
        return np.array([np.nan_to_num(model.speed)]), np.array([np.nan_to_num(model.pressure)])
    (w0, p0), (w1, p1) = model.low, model.high
    first = max(float(w0), float(law.speeds[0])) if law.scheduled else float(w0)
    return np.linspace(first, w1, size[0] if w1 > w0 else 1), np.linspace(p0, p1, size[1] if p1 > p0 else 1)


def overview(law: Law, model: Model) -> dict[str, Any]:
    """Plain numbers; what holds at the law's own operating point holds at the middle of the range otherwise.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "disk_margin" in rs.control.overview(law, lpv)
    True
    """
    speeds, pressures = fine_axes(law, model)
    found = sweep(law, model, speeds, pressures)
    w, p = law.about.get("spec", {}).get("speed"), law.about.get("spec", {}).get("pressure")
    w = float(np.mean(speeds)) if w is None else float(w)
    p = float(np.mean(pressures)) if p is None else float(p)
    plant = sampled_plant(model, w, p, law.Ts)
    loop = loop_of(plant, law_system(law, w, p), law.Ts)
    overview: dict[str, Any] = {"design": law.name, "order": law.order, "scheduled": law.scheduled}
    if law.gamma is not None:
        overview["gamma"] = law.gamma
    overview |= {key: value for key, value in law.about.items() if isinstance(value, (int, float)) and key != "spec"}
    own = smallest_damping(np.linalg.eigvals(plant.A), law.Ts)
    overview |= {
        "operating_point": point_text(w, p),
        "smallest_damping_open": own,
        "smallest_damping_closed": float(found.damping.min()),
        "unstable_points": f"{found.unstable} of {found.radius.size}",
        "largest_pole_radius": float(found.radius.max()),
        "peak_sensitivity": loop.peak,
        "disk_margin": loop.disk_margin,
        "gain_margin": loop.gain_margin,
        "phase_margin_deg": loop.phase_margin,
    }
    return overview
