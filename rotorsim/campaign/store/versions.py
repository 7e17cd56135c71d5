"""Software versions that determine a record's bits; client, workers and store must agree in them."""

from __future__ import annotations

import platform
from functools import lru_cache

from rotorsim.base.cache import RUNS, sources_hash
from rotorsim.base.version import installed

PACKAGES = ("numpy", "scipy", "numba", "h5py", "h5netcdf", "distributed")
KNOWN_CHANGES = ("rotorsim/discrepancy/__init__.py", "rotorsim/discrepancy/data")
SOURCES = (*RUNS, *KNOWN_CHANGES, "rotorsim/analysis", "rotorsim/campaign")


@lru_cache(maxsize=1)
def _versions() -> tuple[tuple[str, str], ...]:
    found = {"rotorsim": installed("rotorsim"), "sources": sources_hash(*SOURCES)[:16]}
    found["python"] = ".".join(platform.python_version_tuple()[:2])
    return tuple((found | {name: installed(name) for name in PACKAGES}).items())


def versions() -> dict[str, str]:
    """Versions by name; 'sources' is a hash of the code that makes records, which may differ at one version."""
    return dict(_versions())


def mismatch(here: dict[str, str], there: dict[str, str], physics_only: bool = False) -> str:
    """Version differences such as 'numba 0.60 there, 0.61 here'; empty if all agree."""
    names = [name for name in here if not (physics_only and name == "distributed")]
    return "; ".join(
        f"{name} {there.get(name, 'missing')} there, {here[name]} here"
        for name in names
        if there.get(name) != here[name]
    )
