"""Summary of a .fmu file: kind, start point, machine file, stored reference."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fmu.description import ROWS
from rotorsim.base.errors import DataError

DAMAGED = (
    zipfile.BadZipFile, zlib.error, ElementTree.ParseError, KeyError, IndexError, ValueError, TypeError, AttributeError,
)  # fmt: skip
"""Exceptions from reading another program's file, or a damaged one."""


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive of a unit; what it should have and has not raises DataError."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except DAMAGED as error:
        raise DataError(
            f"{path}: is not an FMU of rotorsim, or is damaged ({error}); export one with 'rotorsim fmu export'"
        ) from error


def info(path: Path) -> dict[str, Any]:
    """Facts about a unit that this software exported; raises DataError for anything else."""
    if not path.is_file():
        raise DataError(f"{path}: is not there; give a .fmu file")
    with opened(path) as archive:
        return _facts(archive) | {"size": f"{path.stat().st_size / 1000:.0f} kB"}


def _facts(archive: zipfile.ZipFile) -> dict[str, Any]:
    root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    data = json.loads(archive.read("resources/model.json"))
    listed = root.find("ModelVariables")
    if listed is None:
        raise KeyError("it has no ModelVariables")
    causalities = [v.get("causality", "local") for v in listed]
    return {
        "FMI version": root.get("fmiVersion"),
        "name": root.get("modelName"),
        "model": root.get("description", "").removesuffix(ROWS).strip(),
        "software": data["software"],
        "machine hash": data.get("machine_hash", "none: no plant"),
        "model hash": data["model_hash"],
        "targets": ", ".join(data["targets"]),
        "processor": data["cpu"],
        "inputs": causalities.count("input"),
        "outputs": causalities.count("output"),
        "parameters": causalities.count("parameter"),
        "reference": "yes" if any(n.endswith("/out.csv") for n in archive.namelist()) else "no",
    }


def machine_text(path: Path) -> str:
    """The machine file that a unit carries."""
    with opened(path) as archive:
        return archive.read("resources/machine.toml").decode()


def holds(path: Path) -> str:
    """Kind of unit: 'plant', 'lpv' (an identified model) or 'law'."""
    with opened(path) as archive:
        names = archive.namelist()
    return next((kind for kind in ("lpv", "law") if f"resources/{kind}.json" in names), "plant")


def start(path: Path) -> tuple[float, float]:
    """Speed [rad/s] and gauge pressure [Pa] at which the unit starts."""
    with opened(path) as archive:
        values = json.loads(archive.read("resources/model.json"))["start"]
        return float(values["speed"]), float(values["pressure"])


def stored(path: Path, name: str) -> tuple[list[str], list[list[float]]]:
    """Header and rows of a table of the unit's reference; empty where it has none."""
    with opened(path) as archive:
        inside = [n for n in archive.namelist() if n.endswith(f"/{name}")]
        lines = archive.read(inside[0]).decode().splitlines() if inside else [""]
        return lines[0].split(",") if lines[0] else [], [[float(x) for x in line.split(",")] for line in lines[1:]]
