"""Stand-ins for what `compose` writes for a machine: sizes and the calls of its effects."""

from __future__ import annotations

from reynolds.grid import Grid, make_layout
from reynolds.jit import inlined
from rotorsim.plant.rotor import make_rotor_layout

FILM = make_layout(Grid(0.02, 0.04, 8, 4), 0, [], [])
ROTOR = make_rotor_layout(4, FILM.size, 0, 0, True, 0)


@inlined
def add_forces(w, P, t, angle, speed, acceleration):
    """Add the modal forces of all force effects at a time."""


@inlined
def contact_forces(x, y, vx, vy, surface_speed, P):
    """Sum of all contact effects: force on the journal and its negative derivative."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
