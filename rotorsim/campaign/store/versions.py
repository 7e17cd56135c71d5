"""Software versions that determine a record's bits; client, workers and store must agree in them."""

from __future__ import annotations

import hashlib
import platform
from functools import lru_cache
from pathlib import Path

from rotorsim.base.version import installed

PACKAGES = ("numpy", "scipy", "numba", "h5py", "h5netcdf", "distributed")
SOURCES = ("reynolds", "fe_shaft", "identification", "rotorsim")
NOT_PHYSICS = ("report", "commands", "bench", "verify", "study", "live", "discrepancy")


@lru_cache(maxsize=1)
def _versions() -> tuple[tuple[str, str], ...]:
    found = {"rotorsim": installed("rotorsim"), "sources": _sources()}
    found["python"] = ".".join(platform.python_version_tuple()[:2])
    return tuple((found | {name: installed(name) for name in PACKAGES}).items())


def versions() -> dict[str, str]:
    """Versions by name; 'sources' is a hash of the physics code, which distinguishes states of one version."""
    return dict(_versions())


def _sources() -> str:
    """Hash of everything a record is made by."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for name in SOURCES:
        for path in sorted((root / name).rglob("*.py")):
            if not set(path.relative_to(root).parts) & set(NOT_PHYSICS):
                digest.update(path.relative_to(root).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def mismatch(here: dict[str, str], there: dict[str, str], physics_only: bool = False) -> str:
    """Version differences such as 'numba 0.60 there, 0.61 here'; empty if all agree."""
    names = [name for name in here if not (physics_only and name == "distributed")]
    return "; ".join(
        f"{name} {there.get(name, 'missing')} there, {here[name]} here"
        for name in names
        if there.get(name) != here[name]
    )
