"""Scene: a machine and all settings of a live rig, stored as a small JSON file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorsim.base import json_text as json
from rotorsim.base.errors import DataError
from rotorsim.base.file_kinds import instead
from rotorsim.base.files import make_folder, write_json
from rotorsim.machine import Machine

KIND, VERSION = "rotorsim scene", 1
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
        content: Any = json.loads(path.read_text(encoding="utf-8"))
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
