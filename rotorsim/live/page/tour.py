"""Demonstration scenes: five of the shipped rig, some for every other machine."""

from __future__ import annotations

from dataclasses import dataclass

from rotorsim.base.constants import RPM
from rotorsim.machine import Machine, load_machine

CALM: dict[str, float | str] = {
    "drive": "speed", "sense": "forward", "controller": "off", "reference_x": 0.0, "reference_y": 0.0,
    "noise": "on", "pace": "1x", "acceleration": 2000 * RPM,
}  # fmt: skip


@dataclass(frozen=True)
class Stop:
    """A scene of the tour: two sentences, what is set, the speed [rad/s] of the equilibrium it begins with, a hit's
    axis."""

    title: str
    text: str
    values: dict[str, float | str]
    begin: float
    hit: int | None = None


FASTEST = 30_000 * RPM
RUN = 8.0
"""Seconds of a run through the critical speed."""
HIT = (
    "The disc is hit along x. Its free vibration dies away, and the frequency and damping read from it are shown with "
    "the eigenvalue of the linear model."
)
CRITICAL = (
    "The shaft runs through {} rpm, where the lowest mode vibrates with the shaft's turns: the orbit opens, "
    "and the 1X line of the spectrum grows and falls again."
)
COASTING = "The drive is off and the shaft slows down by its own losses."
TOUR = (
    Stop(
        "Lift-off",
        "The shaft stands still and only the injected air carries it. "
        "Turn the pressure down and the film thins until the contact lamp lights; turn it up and the rotor lifts off.",
        CALM | {"speed": 0.0, "pressure": 0.4e6},
        0.0,
    ),
    Stop(
        "Critical speed",
        "The shaft runs up slowly through its first critical speeds and the orbit opens and turns its phase. "
        "The 1X line of the spectrum grows to its peak near 6 krpm and falls again beyond it.",
        CALM | {"speed": 9000 * RPM, "pressure": 0.3e6, "acceleration": 250 * RPM},
        3000 * RPM,
    ),
    Stop(
        "Cross-coupling",
        "At speed the film turns a push along x into a movement along y as well: the journal rides up the wedge. "
        "Change reference x and watch both traces; turn the sense and the other axis answers with the other sign.",
        CALM | {"speed": 5000 * RPM, "pressure": 0.6e6, "reference_x": 2.5},
        5000 * RPM,
        hit=0,
    ),
    Stop(
        "Whirl onset",
        "Above 15 krpm the film feeds the whirl faster than it damps it: a line at just under half the speed grows. "
        "More pressure moves the onset up, and the eigenvalue below zero agrees with what grows.",
        CALM | {"speed": 16_000 * RPM, "pressure": 0.3e6},
        14_000 * RPM,
        hit=1,
    ),
    Stop(
        "Controller on",
        "Near the first critical speed the orbit is 11 um wide; with the H-infinity law it is about half as wide. "
        "Switch the law off and on, and hit: what it adds is damping, a ratio of 0.18 in place of 0.06.",
        CALM | {"speed": 6000 * RPM, "pressure": 0.3e6, "controller": "hinf"},
        6000 * RPM,
    ),
)


def stops(machine: Machine, lowest: float, critical: float) -> tuple[Stop, ...]:
    """Scenes of the tour for a machine.

    Parameters
    ----------
    machine : Machine
        The shipped rig has its own tour, whatever its grid.
    lowest : float
        Speed [rad/s] from which the film carries the rotor.
    critical : float
        Lowest natural frequency [rad/s] at that speed; 0 where it is not known.
    """
    if is_shipped(machine):
        return TOUR
    calm = {key: value for key, value in CALM.items() if not key.startswith("reference")}
    slow = max(0.3 * critical, lowest)
    found = [Stop("A hit", HIT, calm | {"speed": min(slow, FASTEST)}, min(slow, FASTEST), hit=0)]
    if lowest < 0.7 * critical < 1.3 * critical < FASTEST:
        to, over = 1.3 * critical, f"{round(critical / RPM, -1):.0f}"
        ramp = calm | {"speed": to, "acceleration": max(0.6 * critical / RUN, RPM)}
        found.append(Stop("Critical speed", CRITICAL.format(over), ramp, 0.7 * critical))
        found.append(Stop("Coasting", COASTING, calm | {"speed": to, "drive": "coast"}, to))
    return tuple(found)


def is_shipped(machine: Machine) -> bool:
    """True if a machine is the shipped rig apart from its numerics."""
    rig = load_machine("dtu_gas_bearing")
    numerics = {"grid": rig.grid, "solver": rig.solver, "shaft.max_element_length": rig.shaft.max_element_length}
    return machine.with_(numerics) == rig
