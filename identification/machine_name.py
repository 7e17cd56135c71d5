"""Name and fingerprint of the machine that a record was made on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rotorsim.base import toml_text as tomllib

if TYPE_CHECKING:
    import xarray as xr


def machine_of(record: xr.Dataset) -> str:
    """Name and fingerprint of a record's machine, a space between; empty for a record that states none."""
    try:
        name = str(tomllib.loads(str(record.attrs.get("machine", ""))).get("name", ""))
    except tomllib.TOMLDecodeError:
        name = ""
    mark = str(record.attrs.get("machine_hash", ""))
    return f"{name} {mark}" if name and mark else ""


def common(machines: Iterable[str]) -> str:
    """The machine of several records, empty where they differ."""
    found = set(machines)
    return found.pop() if len(found) == 1 else ""
