"""Summary of a .fmu file: kind, start point, machine file, stored reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fmu.description import ROWS
from rotorsim.base import json_text as json
from rotorsim.base.errors import DataError
from rotorsim.base.exchange.archive import read_archive

DAMAGED = (ElementTree.ParseError, KeyError, IndexError, ValueError, TypeError, AttributeError)
"""Exceptions from reading another program's file, or a damaged one."""


@contextmanager
def opened(path: Path) -> Iterator[Mapping[str, bytes]]:
    """The files of a unit by name; what it should have and has not raises DataError."""
    try:
        yield read_archive(path)
    except DAMAGED as error:
        raise DataError(
            f"{path}: is not an FMU of rotorsim, or is damaged ({error}); export one with 'rotorsim fmu export'"
        ) from error


def info(path: Path) -> dict[str, Any]:
    """Facts about a unit that this software exported; raises DataError for anything else."""
    if not path.is_file():
        raise DataError(f"{path}: is not there; give a .fmu file")
    with opened(path) as files:
        return _facts(files) | {"size": f"{path.stat().st_size / 1000:.0f} kB"}


def xml(content: bytes) -> ElementTree.Element:
    """Root of an XML file of a unit; raises ValueError for one that defines entities, which may stand for anything."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content or b"\0" in content:
        raise ValueError("an XML file with entities of its own, which no unit needs")
    return ElementTree.fromstring(content)


def _facts(files: Mapping[str, bytes]) -> dict[str, Any]:
    root = xml(files["modelDescription.xml"])
    data = json.loads(files["resources/model.json"])
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
        "reference": "yes" if any(n.endswith("/out.csv") for n in files) else "no",
    }


def machine_text(path: Path) -> str:
    """The machine file that a unit carries."""
    with opened(path) as files:
        return files["resources/machine.toml"].decode()


def holds(path: Path) -> str:
    """Kind of unit: 'plant', 'lpv' (an identified model) or 'law'."""
    with opened(path) as files:
        return next((kind for kind in ("lpv", "law") if f"resources/{kind}.json" in files), "plant")


def start(path: Path) -> tuple[float, float]:
    """Speed [rad/s] and gauge pressure [Pa] at which the unit starts."""
    with opened(path) as files:
        values = json.loads(files["resources/model.json"])["start"]
        return float(values["speed"]), float(values["pressure"])


def stored(path: Path, name: str) -> tuple[list[str], list[list[float]]]:
    """Header and rows of a table of the unit's reference; empty where it has none."""
    with opened(path) as files:
        inside = [n for n in files if n.endswith(f"/{name}")]
        lines = files[inside[0]].decode().splitlines() if inside else [""]
        return lines[0].split(",") if lines[0] else [], [[float(x) for x in line.split(",")] for line in lines[1:]]
