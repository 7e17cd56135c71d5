"""Stubs for the sizes and effect calls that `compose` generates for a machine."""

from __future__ import annotations

from reynolds.grid import Grid, make_layout
from reynolds.jit import inlined
from rotorsim.effects import PORTS
from rotorsim.plant.kernels.modal_rotor import make_rotor_layout
from rotorsim.plant.kernels.rig_layout import make_rig_layout

FILM = make_layout(Grid(0.02, 0.04, 8, 4), 0, [], [])
ROTOR = make_rotor_layout(4, FILM, 0, 1, 0)
RIG = make_rig_layout(ROTOR.size, 1, 0, 0, 0, 1, dict.fromkeys(PORTS, 0), 0, 0)


@inlined
def film_constants(P, f):
    """Record of the constants of film f."""
    return P.film_0


@inlined
def add_forces(w, P, t, angle, speed, acceleration):
    """Add the modal forces of all force effects at a time."""


@inlined
def steady_forces(w, P, speed):
    """Add the modal forces of force effects that are steady."""


@inlined
def first_forces(w, P, speed):
    """Add those of the others at angle 0 to the acceleration at the start."""


@inlined
def motion_tangent(w, P, speed):
    """Add what steady motion-dependent forces have at rest, linearised."""


@inlined
def contact_forces(f, clearance, reach, nx, ny, curvature, vx, vy, surface_speed, P):
    """Sum of all contact effects of film f at a place: force on the journal and its negative derivative."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@inlined
def form_motion(w, adt):
    """Compliance of the shaft where forces depend on its motion."""


@inlined
def guess_motion(w, tau):
    """Guess the motion there after tau."""


@inlined
def add_motion(w, P, t, angle, speed, adt):
    """Add the modal forces of the motion guessed."""


@inlined
def missed_motion(w, P, t, angle, speed, adt):
    """Largest displacement [m] by which the forces of the motion found differ from those used."""
    return 0.0


@inlined
def motion_torque(w, P, t, angle, speed, adt):
    """Torque [N m] about its axis that motion-dependent forces exert on the shaft, at the motion found."""
    return 0.0


@inlined
def correct_motion(w, P, t, angle, speed, adt):
    """Better guesses from the motion found."""


@inlined
def film_shape(f, t, angle, speed, theta, P):
    """Increase of the gap of film f at theta [m], and per length along the shaft [1]."""
    return 0.0, 0.0


@inlined
def gas_state(f, t, speed, path, P):
    """Factor on the viscosity of film f, and its mean free path [m] at ambient pressure, `path` without effects."""
    return 1.0, path


@inlined
def warm(f, w, P, rate, power, flow):
    """Move the temperatures of film f on."""


@inlined
def warmed_film(f, w, P):
    """What the gap of film f has more [m] by its temperatures, and the factor on its viscosity."""
    return 0.0, 1.0


@inlined
def inject(f, t, k, opening, supply, P):
    """Opening and supply pressure of injector k of film f."""
    return opening, supply


@inlined
def plenum_factor(f, k, P):
    """Factor on the volume of plenum k of film f."""
    return 1.0


@inlined
def supply_line(w, P, h, supply, flow):
    """Pressure behind the supply line at start and end of a sample."""
    return supply, supply


@inlined
def stroke(w, P, k, volt, h):
    """Stroke [m] of stack k at `volt`, after a substep h."""
    return P.sensitivity * volt


@inlined
def sense(w, P):
    """Make readings of the true values."""


@inlined
def shaft_torque(t, angle, speed, P):
    """Torque [N m] on the shaft besides the drive's."""
    return 0.0


@inlined
def foundation(t, P):
    """Displacement [m], velocity [m/s] and acceleration [m/s^2] of the foundation along x and y."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@inlined
def build_supports(w, P):
    """Resonances under the film's sleeve into the modal matrices."""


@inlined
def rotating_damping(P):
    """Damping time [s] of the turning shaft."""
    return 0.0
