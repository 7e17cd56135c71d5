"""Campaign store on disk: a folder with the plan, the index, one record per case and a log.

::

    store.json            plan, machines and versions it was made with
    index.sqlite          one row per case
    cases/3f/3f08...nc    the record of a case, moved here when it is complete
    parts/                records being written; emptied when the campaign is resumed
    campaign.log          what happened when
    lock                  held by the process that runs the campaign

Client, workers and store must agree in the versions that determine a record's bits.

Only the process that runs the campaign writes the index; workers hand their rows to it. So there is nothing to gain
from write-ahead logging, which needs memory shared between processes and therefore fails on network file systems: the
index keeps the rollback journal, which needs no more than file locks. Rows are committed in batches; what a crash loses
of them is taken from the records themselves when the campaign is resumed.
"""

from __future__ import annotations

import json
import os
import platform
import socket
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotorsim.base.cache import RUNS, installed, sources_hash
from rotorsim.base.errors import RotorsimError
from rotorsim.base.files import BusyError, Lock, about_us, is_temporary, make_folder, replacing, write_json, write_text
from rotorsim.base.input_files import parse_json
from rotorsim.campaign.axes import PlanError
from rotorsim.campaign.plan import NumberedCase, Plan, differences, text_hash
from rotorsim.campaign.read_plan import make_plan

PACKAGES = ("numpy", "scipy", "numba", "h5py", "h5netcdf", "distributed")
KNOWN_CHANGES = ("rotorsim/discrepancy/__init__.py", "rotorsim/discrepancy/changes.py")
SOURCES = (*RUNS, *KNOWN_CHANGES, "rotorsim/analysis", "rotorsim/campaign")
FORMAT = 1
MANIFEST = "store.json"
_OWN = ("cases", "parts", "lock", "plan.toml", "index.sqlite", "index.sqlite-journal")
"""Names in a folder that an interrupted start of a campaign leaves."""
PENDING, DONE, FAILED = "pending", "done", "failed"
BATCH = 5000
_SCHEMA = """
CREATE TABLE cases (
    number INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, experiment TEXT NOT NULL, repeat INTEGER NOT NULL,
    seed INTEGER NOT NULL, parameters TEXT NOT NULL, status TEXT NOT NULL DEFAULT 'pending', error TEXT, summary TEXT,
    duration REAL, cpu REAL, bytes INTEGER, host TEXT, versions TEXT, finished TEXT, attempts INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE INDEX by_status ON cases (status, number);
"""


class StoreError(RotorsimError):
    """Raised for a store that is in use, of another plan, damaged, or cannot be written."""


class StorageError(RotorsimError):
    """Raised for a record that cannot be stored; its case stays pending."""


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
                f"{self.folder}: {error.strerror} runs a campaign in it; wait for its end or choose another folder",
                argument="folder",
                value=self.folder,
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
        raise StoreError(
            f"{folder}: holds no campaign; give the folder that it was run in", argument="folder", value=folder
        )
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
            f"{path}: was changed, or means other cases in this version ({wrong}); use the version it was made with",
            argument="plan",
            value=path,
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
                f"{folder}: holds a campaign of another plan ({'; '.join(found[:3])}{more}); choose another folder",
                argument="plan",
                value=found,
            )
        return Store(folder, plan, store.versions)
    if folder.exists() and not (
        folder.is_dir() and all(entry.name in _OWN or is_temporary(entry) for entry in folder.iterdir())
    ):
        raise StoreError(
            f"{folder}: is there already and is not a campaign; choose another folder", argument="folder", value=folder
        )
    for name in ("cases", "parts"):
        make_folder(folder / name)
    store = Store(folder, plan, versions())
    with store.locked():
        if (folder / MANIFEST).exists():  # another process was quicker
            return open_store(folder)
        Index.create(store.index_path, plan.cases())
        write_text(folder / "plan.toml", plan.text)
        write_json(folder / MANIFEST, {
            "format": FORMAT, "name": plan.name, "digest": plan.digest, "plan": plan.text, "machines": plan.machines,
            "versions": store.versions,
        })  # fmt: skip
    return store


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
    with closing(store.index()) as index:
        counts, (seconds, size) = index.counts(), index.totals()
        failed = list(index.rows(FAILED, limit=failures))
    named = [{name: getattr(row, name) for name in ("number", "experiment", "parameters", "error")} for row in failed]
    return {"name": store.plan.name, **counts, "computing_s": seconds, "bytes": size, "failures": named}


@dataclass(frozen=True)
class IndexRow:
    """Case in the index; duration and CPU time `cpu` in s, `finished` in UTC."""

    number: int
    key: str
    experiment: str
    repeat: int
    seed: int
    parameters: dict[str, Any]
    status: str
    error: str | None
    summary: dict[str, Any]
    duration: float | None
    cpu: float | None
    bytes: int | None
    host: str | None
    versions: str | None
    finished: str | None
    attempts: int


COLUMNS = tuple(entry.name for entry in fields(IndexRow))


class Index:
    """Index of all cases; `writable` only for the process that holds the store's lock."""

    def __init__(self, path: Path, writable: bool = False) -> None:
        self.path = path
        self._waiting: list[tuple[Any, ...]] = []
        self._db = _connect(path, writable)

    @classmethod
    def create(cls, path: Path, cases: Iterable[NumberedCase]) -> None:
        """Write a new index of pending cases in one piece; raises PlanError if two cases are the same."""
        with replacing(path) as part, closing(sqlite3.connect(part)) as db:
            try:
                db.executescript("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;" + _SCHEMA)
                db.executemany(
                    "INSERT INTO cases (number, key, experiment, repeat, seed, parameters) VALUES (?, ?, ?, ?, ?, ?)",
                    ((c.number, c.case.key, c.experiment, c.repeat, c.case.seed, json.dumps(c.values)) for c in cases),
                )
                db.commit()
            except sqlite3.IntegrityError as error:
                raise PlanError(
                    "experiments: two cases are the same, down to the seed; give the experiments seeds that are "
                    "further apart than there are repeats, or write seeds = 'different'",
                    argument="experiments",
                ) from error
            except sqlite3.Error as error:
                raise _failed(path, error) from error

    def pending(self) -> list[int]:
        """Numbers of the cases that are neither done nor failed, in order."""
        query = "SELECT number FROM cases WHERE status = ? ORDER BY number"
        return [number for (number,) in self._db.execute(query, (PENDING,))]

    def counts(self) -> dict[str, int]:
        """Number of cases by status."""
        found = dict(self._db.execute("SELECT status, count(*) FROM cases GROUP BY status").fetchall())
        return {status: found.get(status, 0) for status in (DONE, FAILED, PENDING)}

    def totals(self) -> tuple[float, int]:
        """Computing time [s] and bytes of all that is done."""
        seconds, size = self._db.execute("SELECT total(duration), total(bytes) FROM cases").fetchone()
        return seconds, int(size)

    def rows(self, status: str | None = None, experiment: str | None = None, limit: int = -1) -> Iterator[IndexRow]:
        """Rows in order, of one status and one experiment if given."""
        query = f"SELECT {', '.join(COLUMNS)} FROM cases WHERE (?1 IS NULL OR status = ?1) "
        query += "AND (?2 IS NULL OR experiment = ?2) ORDER BY number LIMIT ?3"
        for values in self._db.execute(query, (status, experiment, limit)):
            row = dict(zip(COLUMNS, values, strict=True))
            row["parameters"], row["summary"] = parse_json(row["parameters"]), parse_json(row["summary"] or "{}")
            yield IndexRow(**row)

    def sizes(self) -> Iterator[tuple[int, str, int | None]]:
        """Number, key and bytes of every case that is done."""
        yield from self._db.execute("SELECT number, key, bytes FROM cases WHERE status = ?", (DONE,))

    def note(self, number: int, result: Mapping[str, Any]) -> None:
        """Keep a case's outcome; it is written with the next `commit`."""
        summary = json.dumps(result["summary"]) if "summary" in result else None
        values = (result.get(name) for name in ("duration", "cpu", "bytes", "host", "versions", "finished"))
        self._waiting.append((result["status"], result.get("error"), summary, *values, number))
        if len(self._waiting) >= BATCH:
            self.commit()

    def commit(self) -> None:
        """Write what was noted; raises StoreError if the disk is full, and keeps it for the next try."""
        try:
            with self._db:
                self._db.executemany(
                    "UPDATE cases SET status = ?, error = ?, summary = ?, duration = ?, cpu = ?, bytes = ?, "
                    "host = ?, versions = ?, finished = ?, attempts = attempts + 1 WHERE number = ?",
                    self._waiting,
                )
        except sqlite3.Error as error:
            raise _failed(self.path, error) from error
        self._waiting.clear()

    def reset(self, numbers: Iterable[int]) -> None:
        """Make cases pending again."""
        try:
            with self._db:
                self._db.executemany(
                    "UPDATE cases SET status = 'pending', error = NULL, summary = NULL, bytes = NULL WHERE number = ?",
                    ((number,) for number in numbers),
                )
        except sqlite3.Error as error:
            raise _failed(self.path, error) from error

    def close(self) -> None:
        """Let go of the file; what was noted since the last commit is lost."""
        self._db.close()


def _connect(path: Path, writable: bool) -> sqlite3.Connection:
    try:
        mode = "rw" if writable else "ro"
        db = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=60)
        db.execute("PRAGMA trusted_schema = OFF")
        db.execute("SELECT number, key, status FROM cases LIMIT 1").fetchone()
    except sqlite3.Error as error:
        raise _failed(path, error) from error
    return db


def _failed(path: Path, error: sqlite3.Error) -> StoreError:
    if "full" in str(error) or "disk I/O" in str(error):
        return StoreError(f"{path}: cannot be written ({error}); free some space and run the same command again")
    return StoreError(f"{path}: is not a usable index ({error}); give the folder of a campaign")
