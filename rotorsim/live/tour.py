"""Five scenes that show what a rotor on an active gas bearing does."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from rotorsim.machine import Machine

RPM = pi / 30
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
        "The same hit, once without and once with the proportional law: switch it off and on and hit again. "
        "The ring-down beside the eigenvalue of the open loop tells how much damping the injectors add.",
        CALM | {"speed": 3000 * RPM, "pressure": 0.5e6, "controller": "P"},
        3000 * RPM,
        hit=0,
    ),
)


def stops(machine: Machine) -> tuple[Stop, ...]:
    """The tour as far as a machine can take it: a rotor without film or injectors has no such scenes."""
    return TOUR if machine.film is not None and machine.injectors else ()
