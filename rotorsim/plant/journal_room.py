r"""Room of a journal in its sleeve: how far its centre can move in each direction until the gap closes.

.. math:: r(\phi) = \min_\theta \frac{s(\theta)}{\cos(\theta - \phi)}, \qquad \cos(\theta - \phi) > 0

s is the distance of the sleeve from its centre as in `reynolds.film.closest_places`, the smallest in a turn of the
shaft. A foil is taken as it is without pressure. The film's thickness is as in Hamrock (2004).

Cites: hamrock_2004.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from rotorsim.effects import Effect, numeric_fields
from rotorsim.machine.schema import Machine

FINE = 720
"""Angles round the sleeve."""
TURNED = np.linspace(0, 2 * np.pi, 24, endpoint=False)
"""Angles [rad] of the shaft at which lobes that turn are looked at."""
EDGED = 1e-9
"""Angle [rad] at which both sides of an edge are looked at."""
AHEAD = 0.05
"""Least cos(theta - phi) that counts: what is across its way does not stop the journal."""


def journal_room(machine: Machine, number: int, directions: np.ndarray, speed: float = 0.0) -> np.ndarray:
    """Room (n,) [m] of a journal in `directions` (n,) [rad] from x towards y; `number`: its film, speed [rad/s]."""
    film = machine.films[number]
    edges = film.sleeve.edges(film.length)
    theta = np.concatenate([np.arange(FINE) * 2 * np.pi / FINE, edges - EDGED, edges + EDGED])
    closing = np.cos(theta - np.asarray(directions, float)[:, None])
    ahead = closing > AHEAD
    reach = sleeve_distance(machine, number, theta, speed) / np.where(ahead, closing, 1.0)
    return np.asarray(np.where(ahead, reach, np.inf).min(axis=1))


def sleeve_distance(machine: Machine, number: int, theta: np.ndarray, speed: float) -> np.ndarray:
    """Least distance (n,) [m] of the sleeve from its centre at angles theta (n,) [rad], over z and a turn."""
    film = machine.films[number]
    distance = film.clearance + film.sleeve.height(theta, film.clearance)
    for row in film.sleeve.recesses(film.length):
        distance = distance + np.where(row.inside(theta, 0 * theta, film.length), row.depth, 0.0)
    about = [e for es in machine.effects.values() for e in es if e.port == "film"]
    about = [e for e in about if machine.film_number(e) in (None, number)]
    heights = np.array([[_height(about, machine, film.length, turned, speed, at) for at in theta] for turned in TURNED])
    return np.asarray(distance + heights.min(axis=0)) if about else distance


def _height(effects: list[Effect], machine: Machine, length: float, turned: float, speed: float, theta: float) -> float:
    """What effects add to the gap [m] at an angle, at the end of the film where that is less."""
    height, slope = 0.0, 0.0
    for effect in effects:
        kernel = type(effect).kernel
        more = getattr(kernel, "py_func", kernel)(0.0, turned, speed, theta, _parameters(effect, machine))
        height, slope = height + more[0], slope + more[1]
    return height - abs(slope) * length / 2


def _parameters(effect: Effect, machine: Machine) -> Any:
    values = {name: getattr(effect, name) for name in numeric_fields(type(effect)) if name not in effect.extra}
    return SimpleNamespace(**values, **effect.derived(machine))
