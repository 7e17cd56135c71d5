r"""Room of a journal in its sleeve: how far its centre can move in each direction until the gap closes.

.. math:: r(\phi) = \min_\theta \frac{s(\theta)}{\cos(\theta - \phi)}, \qquad \cos(\theta - \phi) > 0

s is the distance of the sleeve from its centre as `reynolds.film.closest_places` has it, the smallest in a turn of the
shaft. A foil is taken as it is without pressure. The film's thickness is as in Hamrock (2004).

Cites: hamrock_2004.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from reynolds import kernels
from reynolds.grid import fill
from rotorsim.effects import Effect, numeric_fields
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import make_films

TURNED = np.linspace(0, 2 * np.pi, 24, endpoint=False)
"""Angles [rad] of the shaft at which lobes that turn are looked at."""


def journal_room(machine: Machine, number: int, directions: np.ndarray, speed: float = 0.0) -> np.ndarray:
    """Room (n,) [m] of a journal in `directions` (n,) [rad] from x towards y; `number`: its film, speed [rad/s]."""
    model = make_films(machine)[number]
    layout, w, _ = model.build()
    constants = model.record()
    effects = [e for es in machine.effects.values() for e in es if e.port == "film"]
    effects = [e for e in effects if machine.film_number(e) in (None, number)]
    form = model.clearance + model.sleeve.height(model.grid.theta, model.clearance)
    rooms = []
    for turned in TURNED if effects else TURNED[:1]:
        if effects:
            constants.uneven = 1.0
            heights = [_height(effects, machine, model.grid.length, turned, speed, at) for at in model.grid.theta]
            line = form + np.array(heights)
            fill(w, layout.clearance, layout, np.repeat(line[:, None], layout.n_rows, axis=1), line)
        rooms.append([kernels.room(w, constants[0], layout, np.cos(at), np.sin(at)) for at in directions])
    return np.min(rooms, axis=0)


def _height(effects: list[Effect], machine: Machine, length: float, turned: float, speed: float, theta: float) -> float:
    """Addition of the effects to the gap [m] at an angle, at the end of the film where that is less."""
    height, slope = 0.0, 0.0
    for effect in effects:
        kernel = type(effect).kernel
        more = getattr(kernel, "py_func", kernel)(0.0, turned, speed, theta, _parameters(effect, machine))
        height, slope = height + more[0], slope + more[1]
    return height - abs(slope) * length / 2


def _parameters(effect: Effect, machine: Machine) -> Any:
    values = {name: getattr(effect, name) for name in numeric_fields(type(effect)) if name not in effect.extra}
    return SimpleNamespace(**values, **effect.derived(machine))
