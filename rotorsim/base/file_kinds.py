"""Recognition of rotorsim's own file kinds, for the message of a reader that was given the wrong kind."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotorsim.base import json_text as json, toml_text as tomllib

LARGEST = 5_000_000
"""Largest size [byte] of a text whose kind is recognised."""
NETCDF = {
    "map": "an operating map of 'rotorsim map'",
    "modes": "a file of mode shapes of 'rotorsim modes'",
    "gap": "the gap of 'rotorsim diagnose'",
    "collected": "the collected records of a campaign",
}
"""Kinds of netCDF files in words, by the attribute `kind`, which records do not have."""
JSON = {
    "law": "a control law of 'rotorsim design'",
    "lpv": "a model of 'rotorsim identify'",
    "linear": "a model of 'rotorsim identify'",
    "rotorsim scene": "a scene of 'rotorsim live'",
}
"""Kinds of JSON files in words, by the key `kind`."""
RESULTS = (
    ({"status", "verdict"}, "the verdict of 'rotorsim diagnose'"),
    ({"fit_parameters", "forms"}, "the sealed truth of 'rotorsim hide'"),
    ({"law", "rows", "passed"}, "the table of 'rotorsim verify'"),
    ({"claims"}, "the numbers of a study"),
)
TABLES = (
    ({"shaft", "bearings"}, "a machine file"),
    ({"experiments"}, "a plan of a campaign"),
    ({"targets", "operating_points"}, "a file of targets"),
    ({"channels"}, "a mapping of measured data"),
    ({"vectors"}, "a mapping of measured data"),
)
"""Kinds in words of JSON files without the key `kind` and of TOML files, by keys that they have."""

READ_BY = {
    "a netCDF file": "data check",
    "a plan of a campaign": "campaign check",
    "a file of targets": "machine calibrate --targets",
    "a mapping of measured data": "data check --mapping",
    "a machine file": "machine check",
    "a control law of 'rotorsim design'": "verify",
    "a model of 'rotorsim identify'": "design",
    "a scene of 'rotorsim live'": "live",
}
"""Command that reads a kind of file; the one of netCDF files reads records."""


def own_kind(path: str | Path) -> str:
    """Kind of rotorsim file in words; empty for a record, a foreign file or an unreadable one."""
    try:
        with Path(path).open("rb") as file:
            start = file.read(LARGEST)
    except OSError:
        return ""
    suffix = Path(path).suffix.lower()
    if start.startswith(b"\x89HDF"):
        return "a netCDF file"
    if start.startswith(b"PK"):
        return {".fmu": "a functional mock-up unit", ".ssp": "a system of units"}.get(suffix, "")
    if b"<html" in start[:1000].lower():
        return "a report"
    try:
        text = start.decode("utf-8-sig")
        content = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except ValueError:
        return ""
    return _by_keys(content) if isinstance(content, Mapping) else ""


def _by_keys(content: Mapping[str, Any]) -> str:
    kind = content.get("kind")
    if isinstance(kind, str) and kind in JSON:
        return JSON[kind]
    return next((name for keys, name in (*RESULTS, *TABLES) if keys <= content.keys()), "")


def instead(path: str | Path, wanted: str, ours: str) -> str:
    """'is a plan ..., not a record (... reads it)' for a file of rotorsim of another kind than `ours`, else empty."""
    found = own_kind(path)
    if not found or found == ours:
        return ""
    which = "a record" if found == "a netCDF file" else "it"
    reader = f" ('rotorsim {READ_BY[found]}' reads {which})" if found in READ_BY else ""
    return f"is {found}, not {wanted}{reader}"
