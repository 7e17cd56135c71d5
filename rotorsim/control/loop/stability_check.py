"""Stability check of every design: the sampled loop with the model at the design's operating points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorsim.base.rounding import decays
from rotorsim.control.designs.plants import Model, point_text, sampled_plant
from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law
from rotorsim.control.loop.sampled_loop import closed_poles, law_system


def check_loop(law: Law, model: Model, points: Sequence[tuple[float, float]]) -> None:
    """Raise DesignError with the first operating point (rad/s, Pa) where the loop with the model is unstable.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.check_loop(law, lpv, [(300.0, 0.5e6)])
    """
    for speed, pressure in points:
        plant = sampled_plant(model, speed, pressure, law.Ts)
        poles = closed_poles(plant, law_system(law, speed, pressure))
        worst = poles[np.abs(poles).argmax()]
        if not decays(poles):
            hertz = abs(np.angle(worst)) / (2 * np.pi * law.Ts)
            raise DesignError(
                f"{law.name}: the loop with the model is unstable at {point_text(speed, pressure)} "
                f"(pole radius {abs(worst):.4f} at {hertz:.4g} Hz); lower the gains or soften the specification",
                speed=speed,
                pressure=pressure,
            )
