"""Demonstration scenes: five of the shipped rig, some for every other machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rotorsim.analysis.modes_over_speed import least_damped, modes_over_speed
from rotorsim.analysis.unbalance_response import half_axis, unbalances_of, whirl
from rotorsim.analysis.whirl_onset import LeastDamped, stability_limit
from rotorsim.base.constants import RPM
from rotorsim.base.errors import RotorsimError
from rotorsim.base.rounding import DAMPED
from rotorsim.live.rig.controls import operating
from rotorsim.machine import Machine, load_machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

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


RUN = 8.0
"""Seconds of a run through the critical speed."""
NODES = 16
"""Speeds at which the response is first computed."""
CLOSER = 4
"""Divisions by three of the interval about the largest response."""
PAST = 1.07
"""Speed at which the whirl is shown, over that of its onset."""
LIFT_OFF = (
    "The shaft stands still and only the injected air carries it. "
    "Turn the pressure down and the film thins until the contact lamp lights; turn it up and the rotor lifts off."
)
HIT = (
    "The disc is hit along x. Its free vibration dies away, and the frequency and damping read from it are shown with "
    "the eigenvalue of the linear model."
)
CRITICAL = (
    "The shaft runs up to {stop:.0f} rpm. The linear model has its largest response to unbalance at {peak:.0f} rpm: "
    "the orbit opens there and turns its phase, and the 1X line of the spectrum grows and falls again."
)
CROSS_COUPLING = (
    "At speed the film turns a push along x into a movement along y as well: the journal rides up the wedge. "
    "Change reference x and watch both traces; turn the sense and the other axis answers with the other sign."
)
WHIRL = (
    "From {onset:.0f} rpm on the film feeds the whirl faster than it damps it: a line at {ratio:.2f} times the speed "
    "grows. More pressure moves the onset up, and the eigenvalue below zero agrees with what grows."
)
CONTROLLER = (
    "At {speed:.0f} rpm, near the first critical speeds, the lowest modes have damping ratios of {zetas}. Switch the "
    "law off and on, and hit: the orbit shrinks, and the reading of the hit shows the damping that the law adds."
)
COASTING = "The drive is off and the shaft slows down by its own losses."


def stops(machine: Machine, plant: Plant, lowest: float, pressure: float) -> tuple[Stop, ...]:
    """Scenes of the tour for a machine; every number in a text is computed from it at the scene's point.

    Parameters
    ----------
    machine : Machine
        The shipped rig has its own tour, whatever its grid.
    plant : Plant
        Of the machine, from which the numbers come.
    lowest : float
        Speed [rad/s] from which the film carries the rotor.
    pressure : float
        Supply pressure [Pa, gauge] that is set at first.
    """
    return tuple(_rig_tour(plant) if is_shipped(machine) else _machine_tour(machine, plant, lowest, pressure))


def _rig_tour(plant: Plant) -> Iterator[Stop]:
    low, mid = CALM | {"pressure": 0.3e6}, CALM | {"pressure": 0.6e6, "reference_x": 2.5}
    yield Stop("Lift-off", LIFT_OFF, CALM | {"speed": 0.0, "pressure": 0.4e6}, 0.0)
    stop, begin = 9000 * RPM, 3000 * RPM
    text = CRITICAL.format(stop=stop / RPM, peak=_peak(plant, 0.3e6, begin, stop) / RPM)
    yield Stop("Critical speed", text, low | {"speed": stop, "acceleration": 250 * RPM}, begin)
    yield Stop("Cross-coupling", CROSS_COUPLING, mid | {"speed": 5000 * RPM}, 5000 * RPM, hit=0)
    onset, ratio = _onset(plant, 0.3e6, operating(plant.machine)["speed"].high)
    if np.isfinite(onset) and ratio > 0:
        text = WHIRL.format(onset=onset / RPM, ratio=ratio)
        yield Stop("Whirl onset", text, low | {"speed": PAST * onset}, 0.95 * onset, hit=1)
    model = plant.linearise(6000 * RPM, 0.3e6)
    zetas = " and ".join(f"{model.zeta[model.mode_of_axis(k)]:.2f}" for k in range(2))
    text = CONTROLLER.format(speed=6000, zetas=zetas)
    yield Stop("Controller on", text, low | {"speed": 6000 * RPM, "controller": "hinf"}, 6000 * RPM)


def _machine_tour(machine: Machine, plant: Plant, lowest: float, pressure: float) -> Iterator[Stop]:
    calm = {key: value for key, value in CALM.items() if not key.startswith("reference")}
    controls = operating(machine)
    calm |= {"pressure": pressure} if "pressure" in controls else {}
    fastest = controls["speed"].high
    peak = _peak(plant, pressure, max(lowest, fastest / NODES), fastest)
    slow = min(max(0.3 * peak if np.isfinite(peak) else 0.0, lowest), fastest)
    yield Stop("A hit", HIT, calm | {"speed": slow}, slow, hit=0)
    if lowest < 0.7 * peak < 1.3 * peak < fastest:
        to = 1.3 * peak
        ramp = calm | {"speed": to, "acceleration": max(0.6 * peak / RUN, RPM)}
        yield Stop("Critical speed", CRITICAL.format(stop=to / RPM, peak=peak / RPM), ramp, 0.7 * peak)
        yield Stop("Coasting", COASTING, calm | {"speed": to, "drive": "coast"}, to)


def _peak(plant: Plant, pressure: float, low: float, high: float) -> float:
    """Speed [rad/s] between two where the response to unbalance has its largest peak; NaN where it has none inside.

    Looked for at equal steps, at every critical speed, which a sharp peak needs, and closer by; where a mode grows
    there is no response.
    """
    unbalances, z = unbalances_of(plant.machine, high), (plant.assembly.mesh.probe,)
    nodes, least = np.linspace(low, high, NODES), LeastDamped.up_to(plant, pressure, high)
    sizes: dict[float, float] = {}

    def look(model: LinearPlant, damping: float) -> None:
        grows = damping < -DAMPED
        sizes[model.speed] = 0.0 if grows else float(half_axis(whirl(plant, model, model.speed, unbalances, z))[0])

    def look_at(speed: float) -> None:
        sizes[speed] = 0.0
        try:
            model = plant.linearise(speed, pressure)
        except RotorsimError:
            return
        look(model, least.among(model)[0])

    try:
        found = modes_over_speed(plant, nodes, pressure, orders=(1,))
    except RotorsimError:
        return float("nan")
    for node in (found.node(speed) for speed in nodes.tolist()):
        sizes[node.at] = 0.0
        if isinstance(node.pencil, LinearPlant):
            look(node.pencil, least_damped(node.modes, found.region)[0])
    for one in found.crossings:
        if low < one.at < high:
            look_at(one.at)
    for _ in range(CLOSER):
        known = sorted(sizes)
        k = known.index(max(sizes, key=lambda speed: sizes[speed]))
        if k in (0, len(known) - 1):
            return float("nan")
        for speed in ((2 * known[k] + known[k - 1]) / 3, (2 * known[k] + known[k + 1]) / 3):
            look_at(speed)
    return max(sizes, key=lambda speed: sizes[speed])


def _onset(plant: Plant, pressure: float, highest: float) -> tuple[float, float]:
    """Onset of whirl [rad/s] and its frequency over the speed; NaN where there is none."""
    onset, frequency, _ = stability_limit(plant, pressure, highest, accuracy=1e-4)
    return onset, frequency / onset


def is_shipped(machine: Machine) -> bool:
    """True if a machine is the shipped rig apart from its numerics."""
    rig = load_machine("dtu_gas_bearing")
    numerics = {"grid": rig.grid, "solver": rig.solver, "shaft.max_element_length": rig.shaft.max_element_length}
    return machine.with_(numerics) == rig
