"""Campaign store on disk: a folder with the plan, the index, one record per case and a log.

::

    store.json            plan, machines and versions it was made with
    index.sqlite          one row per case
    cases/3f/3f08...nc    the record of a case, moved here when it is complete
    parts/                records being written; emptied when the campaign is resumed
    campaign.log          what happened when
    lock                  held by the process that runs the campaign

Client, workers and store must agree in the versions that determine a record's bits.
"""

from __future__ import annotations

import os
import platform
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotorsim.base.cache import RUNS, sources_hash
from rotorsim.base.files import BusyError, Lock, about_us, is_temporary, make_folder, write_json, write_text
from rotorsim.base.input_files import parse_json
from rotorsim.base.version import installed
from rotorsim.campaign.errors import StoreError
from rotorsim.campaign.index import FAILED, Index
from rotorsim.campaign.plan import Plan, differences, text_hash
from rotorsim.campaign.read_plan import make_plan

PACKAGES = ("numpy", "scipy", "numba", "h5py", "h5netcdf", "distributed")
KNOWN_CHANGES = ("rotorsim/discrepancy/__init__.py", "rotorsim/discrepancy/changes.py")
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


FORMAT = 1
MANIFEST = "store.json"


def record_path(folder: Path, key: str) -> Path:
    """Path of a case's record."""
    return folder / "cases" / key[:2] / f"{key}.nc"


def parts_folder(folder: Path) -> Path:
    """Folder of records being written."""
    return folder / "parts"


def part_path(folder: Path, name: str, pid: int | None = None) -> Path:
    """Path of a growing file of a process of this computer, by default this one."""
    return parts_folder(folder) / f"{name}.{socket.gethostname()}.{os.getpid() if pid is None else pid}.nc"


@dataclass(frozen=True)
class Store:
    """Existing store: its plan, machines and versions."""

    folder: Path
    plan: Plan
    versions: dict[str, str]

    @property
    def index_path(self) -> Path:
        """The index."""
        return self.folder / "index.sqlite"

    def index(self, writable: bool = False) -> Index:
        """The index, opened."""
        return Index(self.index_path, writable)

    def damaged(self, index: Index) -> list[int]:
        """Numbers of the cases whose record is not there as the index knows it."""
        if self.plan.keep == ():
            return []
        sizes = dict(_files(self.folder / "cases"))
        return [number for number, key, size in index.sizes() if sizes.get(f"{key}.nc") != size]

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the store; raises StoreError if another campaign does."""
        try:
            with Lock(self.folder / "lock", about_us()):
                yield
        except BusyError as error:
            raise StoreError(
                f"{self.folder}: {error.strerror} runs a campaign in it; wait for its end or choose another --out"
            ) from error


def open_store(folder: str | Path) -> Store:
    """Existing store in a folder; raises StoreError if there is none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.open_store(Path("mine")).plan.name
    'short'
    """
    folder = Path(folder)
    path = folder / MANIFEST
    if not path.is_file():
        raise StoreError(f"{folder}: holds no campaign; give the folder that was its --out")
    try:
        manifest = parse_json(path.read_text(encoding="utf-8-sig"))
        if manifest["format"] != FORMAT:
            raise StoreError(
                f"{path}: has format {manifest['format']!r}, this version reads {FORMAT}; use the one it is of"
            )
        plan = make_plan(manifest["plan"], machines=manifest["machines"])
        known = {str(name): str(value) for name, value in manifest["versions"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StoreError(f"{path}: is damaged ({error!r}); restore it from a copy") from error
    if plan.digest != manifest.get("digest"):
        wrong = mismatch(versions(), known, physics_only=True) or "the same versions"
        raise StoreError(
            f"{path}: was changed, or means other cases in this version ({wrong}); use the version it was made with"
        )
    return Store(folder, plan, known)


def machines(folder: Path) -> dict[str, str]:
    """Texts of a store's machines by their hash."""
    manifest = parse_json((folder / MANIFEST).read_text(encoding="utf-8-sig"))
    return {text_hash(text): text for text in manifest["machines"].values()}


def make_store(plan: Plan, folder: Path) -> Store:
    """Store of this plan, new or existing; raises StoreError if it belongs to another plan."""
    if (folder / MANIFEST).exists():
        store = open_store(folder)
        found = differences(store.plan.content, plan.content)
        if found:
            more = f" and {len(found) - 3} more" if len(found) > 3 else ""
            raise StoreError(
                f"{folder}: holds a campaign of another plan ({'; '.join(found[:3])}{more}); choose another --out"
            )
        return Store(folder, plan, store.versions)
    if folder.exists() and (not folder.is_dir() or _strange(folder)):
        raise StoreError(f"{folder}: is there already and is not a campaign; choose another --out")
    for name in ("cases", "parts"):
        make_folder(folder / name)
    store = Store(folder, plan, versions())
    with store.locked():
        if (folder / MANIFEST).exists():  # another process was quicker
            return open_store(folder)
        Index.create(store.index_path, plan.cases())
        write_text(folder / "plan.toml", plan.text)
        write_json(folder / MANIFEST, _manifest(plan, store.versions))
    return store


def _manifest(plan: Plan, known: dict[str, str]) -> dict[str, Any]:
    return {
        "format": FORMAT, "name": plan.name, "digest": plan.digest, "plan": plan.text, "machines": plan.machines,
        "versions": known,
    }  # fmt: skip


_OWN = ("cases", "parts", "lock", "plan.toml", "index.sqlite", "index.sqlite-journal")


def _strange(folder: Path) -> bool:
    """Whether a folder holds what no interrupted start of a campaign leaves."""
    return any(entry.name not in _OWN and not is_temporary(entry) for entry in folder.iterdir())


def _files(folder: Path) -> Iterator[tuple[str, int]]:
    """Name and size of every record."""
    with suppress(FileNotFoundError), os.scandir(folder) as shelves:
        for shelf in shelves:
            with os.scandir(shelf.path) as entries:
                for entry in entries:
                    yield entry.name, entry.stat().st_size


def clear_parts_of(folder: Path, pid: int) -> None:
    """Remove partial files of a process of this computer that was ended."""
    pattern = part_path(folder, "*", pid)
    for path in pattern.parent.glob(pattern.name):
        with suppress(OSError):
            path.unlink()


def clear_parts(folder: Path) -> int:
    """Remove partial files of killed workers; returns their number."""
    left = list(parts_folder(folder).iterdir()) if parts_folder(folder).is_dir() else []
    for path in left:
        with suppress(OSError):
            path.unlink()
    parts_folder(folder).mkdir(exist_ok=True)
    return len(left)


def status(folder: str | Path, failures: int = 5) -> dict[str, Any]:
    """Counts of cases by state, computing time [s], bytes, and the first failed cases; also while it runs.

    Parameters
    ----------
    folder : path
        Of the campaign; raises StoreError where it is damaged.
    failures : int
        How many failed cases to list.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.status("mine")["done"]
    1
    """
    store = open_store(Path(folder))
    index = store.index()
    try:
        counts, (seconds, size) = index.counts(), index.totals()
        rows = [(row.number, row.experiment, row.parameters, row.error) for row in index.rows(FAILED, limit=failures)]
    finally:
        index.close()
    named = [dict(zip(("number", "experiment", "parameters", "error"), row, strict=True)) for row in rows]
    return {"name": store.plan.name, **counts, "computing_s": seconds, "bytes": size, "failures": named}
