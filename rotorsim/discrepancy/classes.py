"""Effects that no campaign of a rig tells apart: a diagnosis names the class and not a member.

Exact ones were derived from the equations: a bow of the shaft and a runout at 1X both add a constant vector that turns
with the shaft; delay and lag of a sensor differ at the second order in frequency times time; the flow through a choked
seat is its area times the pressure; of two sensors' gains only the ratio shows beside gains of the actuators. Others
are beyond any record's resolution.
"""

from __future__ import annotations

from collections.abc import Iterable

ALWAYS = (
    ("runout.first", "shaft_bow.bow"),
    ("sensor_delay.delay", "sensor_lag.time"),
    ("viscosity.heating", "viscosity.rise", "slip.mean_free_path"),
    ("sensor_gain.x", "sensor_gain.y"),
)
PER_INJECTOR = (("weak_injector.blocked", "unequal_pressure.deviation"),)
BESIDE = {
    "sensor_delay.delay": "a lag of the amplifiers or the actuators",
    "sensor_lag.time": "a lag of the amplifiers or the actuators",
    "sensor_gain.x": "the gain of actuator x against y",
    "sensor_gain.y": "the gain of actuator y against x",
    "runout.first": "an eccentric surface under the sensors",
    "viscosity.rise": "the gas temperature",
    "unbalance.me": "a skew of the disc",
}
"""What else would look the same, for which there is no effect in the catalogue."""


def class_of(key: str, known: Iterable[str]) -> tuple[str, ...]:
    """Keys, among those known, that cannot be told from `key`; itself included."""
    stem, _, injector = key.partition(" of ")
    known = set(known)
    for group in ALWAYS:
        if key in group:
            return tuple(k for k in group if k in known)
    for group in PER_INJECTOR:
        if stem in group:
            return tuple(k for g in group if (k := f"{g} of {injector}") in known)
    return (key,)
