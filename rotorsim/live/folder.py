"""Folder of a live rig: its scenes and records as files of one folder, addressed by name, and its tour of scenes.

The tour has five scenes of the shipped rig and some for every other machine, with numbers computed from the machine.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fe_shaft.modal import half_axes
from rotorsim.analysis.modes_over_speed import least_damped, modes_over_speed
from rotorsim.analysis.shaft_motion import synchronous_stiffness, unbalances_of, whirl
from rotorsim.analysis.whirl_onset import LeastDamped, stability_limit
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import make_folder, write_json
from rotorsim.base.input_files import instead, parse_json
from rotorsim.base.rounding import DAMPED
from rotorsim.base.units import RPM
from rotorsim.live.records import Replay
from rotorsim.live.rig import Rig
from rotorsim.live.runner import Runner
from rotorsim.live.settings import OFF, operating
from rotorsim.machine import Machine, load_machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,59}")
"""Names of scenes and records."""
SCENE = ".scene.json"
"""Suffix of a scene's file."""
RECORD = ".nc"
"""Suffix of a record's file."""
STEADY = 5000
"""Samples after which a rotor that was put into its equilibrium turns steadily."""


class RigFolder:
    """File operations of a runner; every method may raise DataError or OSError with a sentence."""

    def __init__(self, runner: Runner, machine: Machine, folder: Path) -> None:
        self.runner, self.machine, self.folder = runner, machine, folder
        rig = runner.rig
        self.tour = stops(machine, rig.plant, abs(rig.speed), rig.pressure)

    def scenes(self) -> list[str]:
        """Names of the scenes, newest first."""
        return self._names(SCENE)

    def records(self) -> list[str]:
        """Names of the records, newest first."""
        return self._names(RECORD)

    def save_scene(self, name: str) -> Path:
        """Write what is set now."""
        path = self._path(name, SCENE)
        Scene(self.machine.text, self.runner.rig.settings.everything()).save(path)
        return path

    def load_scene(self, name: str) -> None:
        """Set the values of a scene."""
        self.apply(load_scene(self._path(name, SCENE)))

    def apply(self, scene: Scene) -> None:
        """Set the values of a scene of this machine, and stand at its equilibrium."""
        other = Machine.from_text(scene.machine)
        if other.hash != self.machine.hash:
            raise DataError(f"the scene belongs to another machine ({other.name}); open it with rotorsim live FILE")
        self.arrange(scene.values)

    def arrange(self, values: dict[str, float | str]) -> None:
        """Set everything and stand at the equilibrium."""
        self.runner.order(lambda: _arrange(self.runner, values))

    def visit(self, stop: Stop) -> None:
        """Set a scene of the tour, from the equilibrium where it begins."""
        self.runner.play(None)
        self.runner.order(lambda: _arrange(self.runner, stop.values | {"speed": stop.begin}))
        self.runner.set("speed", stop.values["speed"])
        if stop.hit is not None:
            axis = stop.hit
            self.runner.order(lambda: self.runner.rig.strike(axis, STEADY))

    def record(self) -> Path:
        """Begin a record under the next free name."""
        number = 1
        while (path := self.folder / f"record-{number}{RECORD}").exists():
            number += 1
        self.runner.record(path)
        return path

    def replay(self, name: str) -> None:
        """Play a record in place of the plant."""
        self.runner.play(Replay(self._path(name, RECORD)))

    def _path(self, name: str, suffix: str) -> Path:
        if not NAME.fullmatch(name):
            raise DataError(f"{name[:60]!r}: cannot name a file; use letters, digits, spaces, - and _")
        return self.folder / f"{name}{suffix}"

    def _names(self, suffix: str) -> list[str]:
        if not self.folder.is_dir():
            return []
        found = [p for p in self.folder.iterdir() if p.name.endswith(suffix) and not p.name.startswith(".")]
        found.sort(key=lambda p: p.stat().st_mtime, reverse=True)
        return [p.name.removesuffix(suffix) for p in found]


def _arrange(runner: Runner, values: dict[str, float | str]) -> None:
    """Set everything (what cannot be set is reported) and stand at the equilibrium; the controller comes last."""
    if "controller" in values:
        runner.apply("controller", OFF)
    runner.arrange({key: value for key, value in values.items() if key != "controller"})
    if runner.recorder is None:
        runner.stand()
    if "controller" in values:
        runner.apply("controller", values["controller"])


def open_folder(
    machine: Machine, laws: Mapping[str, Any], seed: int, out: Path, values: Mapping[str, Any] | None,
    record: Replay | None,
) -> RigFolder:  # fmt: skip
    """The folder of a rig with the settings of a scene, or replaying a record."""
    rig_folder = RigFolder(Runner(Rig(machine, laws, seed)), machine, out)
    if values is not None:
        rig_folder.arrange(dict(values))
    if record is not None:
        rig_folder.runner.play(record)
    return rig_folder


KIND = "rotorsim scene"
"""Kind that a scene's file states."""
VERSION = 1
"""Version of a scene's file."""
MOST = 2_000_000
"""Largest scene file [bytes]."""


@dataclass(frozen=True)
class Scene:
    """Machine text and values by key (SI; switches as text)."""

    machine: str
    values: dict[str, float | str]

    def save(self, path: Path) -> None:
        """Write the file in one piece."""
        make_folder(path.parent)
        content = {"kind": KIND, "version": VERSION, "machine": self.machine, "values": self.values}
        write_json(path, content)


def load_scene(path: Path) -> Scene:
    """Read a scene; raises DataError with one sentence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.live.Scene(machine.text, {"pressure": 0.5e6}).save(Path("scene.json"))
    >>> rs.live.load_scene(Path("scene.json")).values["pressure"]
    500000.0
    """
    if not path.is_file():
        raise DataError(f"{path}: is not a file; give a scene that was saved on a live rig")
    if path.stat().st_size > MOST:
        raise DataError(f"{path}: is larger than {MOST / 1e6:g} MB; that is not a scene")
    try:
        content: Any = parse_json(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise DataError(f"{path}: is not a scene, because it is not JSON; save one on a live rig") from error
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise DataError(f"{path}: {instead(path, 'a scene', '') or 'is not a scene'}; save one on a live rig")
    if content.get("version") != VERSION:
        raise DataError(
            f"{path}: is a scene of version {str(content.get('version'))[:20]}, this is version {VERSION}; save it anew"
        )
    machine, values = content.get("machine"), content.get("values")
    if not isinstance(machine, str) or not isinstance(values, dict):
        raise DataError(f"{path}: lacks its machine or its values; save it anew")
    Machine.from_text(machine)
    return Scene(machine, {str(key): value for key, value in values.items()})


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
    """Scenes of the tour for a machine; every number in a text is computed from its plant at the scene's point.

    `lowest` [rad/s] is the speed from which the film carries the rotor, `pressure` [Pa, gauge] is set at first. The
    shipped rig has its own tour, whatever its grid.
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
        motion = whirl(plant, [synchronous_stiffness(model)], np.array([model.speed]), unbalances, z)[0, 0]
        sizes[model.speed] = 0.0 if grows else float(half_axes(*motion)[0])

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
