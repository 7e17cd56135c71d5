"""Files of a live rig: scenes and records in one folder, addressed by name."""

from __future__ import annotations

import re
from pathlib import Path

from rotorsim.base.errors import DataError
from rotorsim.live.page.scene import Scene, load_scene
from rotorsim.live.page.tour import Stop, stops
from rotorsim.live.replay import Replay
from rotorsim.live.rig.operating import OFF
from rotorsim.live.runner import Runner
from rotorsim.machine import Machine

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,59}")
SCENE, RECORD = ".scene.json", ".nc"
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
