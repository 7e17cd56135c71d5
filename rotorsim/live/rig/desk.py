"""Scenes of a live rig, and its scenes and records as files of one folder, addressed by name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.files import make_folder, write_json
from rotorsim.base.input_files import instead, parse_json
from rotorsim.live.rig.controls import OFF
from rotorsim.live.rig.records import Replay
from rotorsim.live.rig.runner import Runner
from rotorsim.live.rig.tour import Stop, stops
from rotorsim.machine import Machine

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,59}")
"""Names of scenes and records."""
SCENE = ".scene.json"
"""Suffix of a scene's file."""
RECORD = ".nc"
"""Suffix of a record's file."""
STEADY = 5000
"""Samples after which a rotor that was put into its equilibrium turns steadily."""


class Desk:
    """File operations of a runner; every method may raise DataError or OSError with a sentence."""

    def __init__(self, runner: Runner, machine: Machine, folder: Path) -> None:
        self.runner, self.machine, self.folder = runner, machine, folder
        self.tour = _tour(runner, machine)

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


def _tour(runner: Runner, machine: Machine) -> tuple[Stop, ...]:
    """The tour that a rig can take, from where it stands at first."""
    return stops(machine, runner.rig.plant, abs(runner.rig.speed), runner.rig.pressure)


def _arrange(runner: Runner, values: dict[str, float | str]) -> None:
    """Set everything (what cannot be set is reported) and stand at the equilibrium; the controller comes last."""
    if "controller" in values:
        runner.apply("controller", OFF)
    runner.arrange({key: value for key, value in values.items() if key != "controller"})
    if runner.recorder is None:
        runner.stand()
    if "controller" in values:
        runner.apply("controller", values["controller"])


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
