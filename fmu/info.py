"""What a .fmu file is, in a few lines."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from rotorsim.errors import DataError


def info(path: Path) -> dict[str, Any]:
    """Facts about a unit that this software exported; raises DataError for anything else."""
    if not path.is_file():
        raise DataError(f"{path}: is not there; give a .fmu file")
    try:
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
            names = archive.namelist()
            data = json.loads(archive.read("resources/model.json"))
    except (zipfile.BadZipFile, KeyError, ValueError, ElementTree.ParseError) as error:
        raise DataError(f"{path}: is no FMU of rotorsim; export one with 'rotorsim fmu export'") from error
    listed = root.find("ModelVariables")
    assert listed is not None
    causalities = [v.get("causality", "local") for v in listed]
    return {
        "FMI version": root.get("fmiVersion"),
        "model": root.get("description"),
        "software": data["software"],
        "machine hash": data.get("machine_hash", "none: no plant"),
        "model hash": data["model_hash"],
        "targets": ", ".join(data["targets"]),
        "processor": data["cpu"],
        "inputs": causalities.count("input"),
        "outputs": causalities.count("output"),
        "parameters": causalities.count("parameter"),
        "size": f"{path.stat().st_size / 1000:.0f} kB",
        "reference": "yes" if any(n.endswith("/out.csv") for n in names) else "no",
    }


def machine_text(path: Path) -> str:
    """The machine file that a unit carries."""
    with zipfile.ZipFile(path) as archive:
        return archive.read("resources/machine.toml").decode()


def holds(path: Path) -> str:
    """What the unit holds: 'plant', 'lpv' (an identified model) or 'law'."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    return next((kind for kind in ("lpv", "law") if f"resources/{kind}.json" in names), "plant")


def start(path: Path) -> tuple[float, float]:
    """Speed [rad/s] and gauge pressure [Pa] at which the unit starts."""
    with zipfile.ZipFile(path) as archive:
        values = json.loads(archive.read("resources/model.json"))["start"]
    return float(values["speed"]), float(values["pressure"])


def stored(path: Path, name: str) -> tuple[list[str], list[list[float]]]:
    """Header and rows of a table of the unit's reference; empty where it has none."""
    with zipfile.ZipFile(path) as archive:
        inside = [n for n in archive.namelist() if n.endswith(f"/{name}")]
        if not inside:
            return [], []
        lines = archive.read(inside[0]).decode().splitlines()
    return lines[0].split(","), [[float(x) for x in line.split(",")] for line in lines[1:]]
