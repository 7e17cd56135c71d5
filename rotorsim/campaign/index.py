"""Index of a campaign store: one row per case in an SQLite file.

Only the process that runs the campaign writes; workers hand their rows to it. So there is nothing to gain from
write-ahead logging, which needs memory shared between processes and therefore fails on network file systems: the index
keeps the rollback journal, which needs no more than file locks. Rows are committed in batches; what a crash loses of
them is taken from the records themselves when the campaign is resumed.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorsim.base.files import replacing
from rotorsim.base.input_files import parse_json
from rotorsim.campaign.errors import PlanError, StoreError
from rotorsim.campaign.plan import NumberedCase

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
COLUMNS = (
    "number", "key", "experiment", "repeat", "seed", "parameters", "status", "error", "summary", "duration", "cpu",
    "bytes", "host", "versions", "finished", "attempts",
)  # fmt: skip


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
                    map(_new, cases),
                )
                db.commit()
            except sqlite3.IntegrityError as error:
                raise PlanError(
                    "experiments: two cases are the same, down to the seed; give the experiments seeds that are "
                    "further apart than there are repeats, or write seeds = 'different'"
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


def _new(one: NumberedCase) -> tuple[Any, ...]:
    return one.number, one.case.key, one.experiment, one.repeat, one.case.seed, json.dumps(one.values)


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
