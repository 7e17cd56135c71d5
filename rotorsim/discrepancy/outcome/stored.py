"""Whole diagnosis as bytes of an npz file and back: numbers, texts and arrays, nothing that is executed when read.

The file has the arrays, as `content` a JSON text and as `seal` the digest of both. The text holds the version of the
format, a digest of the verdict's file that it was written with, the machine file, the gap and every field.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, cast, get_type_hints

import numpy as np
import xarray as xr

from rotorsim.base import json_text as json
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.exchange.archive import ArchiveError, read_archive
from rotorsim.base.exchange.plain_data import from_plain, to_plain
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.discrepancy.outcome.stored_plan import StoredPlan
from rotorsim.discrepancy.plan.plan import Plan
from rotorsim.machine import Machine

VERSION = 2
"""Version of the format."""
KIND = "stored diagnosis"
OWN = ("machine", "gap", "planned", "planner")
"""Fields with a form of their own."""
LARGEST = 1_000_000_000
"""Bytes that a stored diagnosis may take, packed or unpacked."""
AGAIN = "run 'rotorsim diagnose' again"


def to_bytes(diagnosis: Diagnosis, verdict: str, toml: str = "") -> bytes:
    """The npz file of a diagnosis; `verdict` is the JSON text next to it, `toml` the plan of the next experiment."""
    arrays: dict[str, np.ndarray] = {}
    machine, plan = diagnosis.machine, diagnosis.planned
    content = {
        "kind": KIND,
        "version": VERSION,
        "verdict": digest(verdict),
        "machine": machine._source or machine.text,
        "gap": _gap_to_plain(diagnosis.gap, arrays),
        "plan": None if plan is None else to_plain({"content": plan.as_dict(), "toml": toml}, arrays),
        "fields": {
            f.name: to_plain(getattr(diagnosis, f.name), arrays) for f in fields(diagnosis) if f.name not in OWN
        },
    }
    arrays["content"] = np.frombuffer(json.dumps(content).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, seal=_seal(arrays), **arrays)
    return buffer.getvalue()


def from_bytes(data: bytes, verdict: str) -> Diagnosis:
    """The diagnosis of an npz file that was written with the text `verdict`; raises DataError with a sentence."""
    arrays = _arrays(data)
    content = _content(arrays)
    if content.get("kind") != KIND or content.get("version") != VERSION:
        raise DataError(f"is of another version of rotorsim; {AGAIN}")
    if not np.array_equal(arrays.pop("seal", np.zeros(0)), _seal(arrays)):
        raise DataError(f"was changed since it was written; {AGAIN}")
    if content.get("verdict") != digest(verdict):
        raise DataError(f"does not belong to the verdict next to it, which was changed or is another's; {AGAIN}")
    try:
        return _diagnosis(content, arrays)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        reason = f"{error}" if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        raise DataError(f"is damaged or of another version of rotorsim ({reason}); {AGAIN}") from error


def digest(verdict: str) -> str:
    """SHA-256 of a verdict's JSON, whatever its spaces and line ends; raises DataError for other text."""
    try:
        content = json.loads(verdict)
    except ValueError as error:
        raise DataError(f"stands next to a verdict that is not JSON; {AGAIN}") from error
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _seal(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """SHA-256 (32,) of names, types, shapes and values of arrays."""
    sum_of_all = hashlib.sha256()
    for name in sorted(arrays):
        sum_of_all.update(f"{name} {arrays[name].dtype.str} {arrays[name].shape}".encode())
        sum_of_all.update(np.ascontiguousarray(arrays[name]).tobytes())
    return np.frombuffer(sum_of_all.digest(), np.uint8)


def _arrays(data: bytes) -> dict[str, np.ndarray]:
    try:
        files = read_archive(data, LARGEST, densest=float("inf"))  # arrays of zeros pack by 1 : 1000
        return {name.removesuffix(".npy"): _array(content) for name, content in files.items()}
    except Exception as error:  # numpy raises many kinds for damaged files
        reason = f" ({error})" if isinstance(error, ArchiveError) else ""
        raise DataError(f"is damaged{reason}; {AGAIN}") from error


def _array(content: bytes) -> np.ndarray:
    found: np.ndarray = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    return found


def _content(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    try:
        content = json.loads(arrays["content"].tobytes())
    except (KeyError, ValueError) as error:
        raise DataError(f"has no content that can be read; {AGAIN}") from error
    if not isinstance(content, dict):
        raise DataError(f"has no content that can be read; {AGAIN}")
    return content


def _diagnosis(content: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Diagnosis:
    hints, stored = get_type_hints(Diagnosis, localns={"xr": xr}), content["fields"]
    given: dict[str, Any] = {"machine": _machine(content["machine"]), "gap": _gap_from_plain(content["gap"], arrays)}
    for field in (f for f in fields(Diagnosis) if f.name not in OWN):
        if field.name in stored:
            given[field.name] = from_plain(hints[field.name], stored[field.name], arrays, field.name)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise ValueError(f"{field.name} is missing")
    if content["plan"] is not None:
        plan = from_plain(StoredPlan, content["plan"], arrays, "plan")
        given["planned"] = cast(Plan, plan)  # has all of a plan that is shown
    return Diagnosis(**given)


def _machine(text: Any) -> Machine:
    try:
        return Machine.from_text(text)
    except MachineFileError as error:
        raise ValueError(f"its machine: {str(error).splitlines()[0]}") from error


def _gap_to_plain(gap: xr.Dataset, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """A dataset as objects; texts of coordinates as lists."""
    variables = {
        str(name): {
            "dims": list(one.dims), "attrs": to_plain(dict(one.attrs), arrays),
            "values": to_plain(one.values if one.dtype.kind in "biufc" else one.values.tolist(), arrays),
        }
        for name, one in gap.variables.items()
    }  # fmt: skip
    return {"coords": [str(name) for name in gap.coords], "variables": variables, "attrs": to_plain(gap.attrs, arrays)}


def _gap_from_plain(stored: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> xr.Dataset:
    made = {}
    for name, one in stored["variables"].items():
        values = from_plain(Any, one["values"], arrays, f"gap.{name}")
        made[name] = xr.Variable(one["dims"], values, one["attrs"])
    coords = {name: made.pop(name) for name in stored["coords"]}
    return xr.Dataset(made, coords, stored["attrs"])


__all__ = ["from_bytes", "to_bytes"]
