"""Reading of machine files and writing of canonical TOML."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

from rotorsim.base import toml_text as tomllib
from rotorsim.base.errors import MachineFileError
from rotorsim.base.file_kinds import instead
from rotorsim.base.quantity import Quantity, quantity_of
from rotorsim.base.units import show
from rotorsim.effects import Effect
from rotorsim.machine.part import Part

MAX_BYTES = 1_000_000


def read_text(path: Path) -> str:
    """Text of a machine file; raises MachineFileError if it cannot be one."""
    if not path.is_file():
        raise MachineFileError(f"{path}: is not a file; give the path of a machine file")
    if path.stat().st_size > MAX_BYTES:
        size = path.stat().st_size / 1e6
        raise MachineFileError(f"{path}: {size:.3g} MB is above the limit of 1 MB; is it a machine file?")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise MachineFileError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error
    except UnicodeDecodeError as error:
        ours = instead(path, "a machine file (TOML)", "")
        writes = "'rotorsim machine new PATH' writes one"
        reason = f"{ours}; {writes}" if ours else "is not text; a machine file is TOML in UTF-8"
        raise MachineFileError(f"{path}: {reason}") from error
    if "\0" in text:
        raise MachineFileError(f"{path}: is binary; a machine file is TOML in UTF-8")
    return text


def parse(text: str) -> dict[str, Any]:
    """Tables of a TOML text; raises MachineFileError with line and column."""
    if not text.strip():
        raise MachineFileError("the machine file is empty; 'rotorsim machine new PATH' writes one to start from")
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except ValueError as error:
        raise MachineFileError(f"not a TOML file: {str(error)[:200]}; correct that line") from error


def dumps(part: Part) -> str:
    """Canonical TOML of a part: every value with its unit, exact to the last bit."""
    return "\n".join(_table(part, "")).lstrip("\n") + "\n"


def entries(part: Part | Effect) -> Iterator[tuple[str, Any, Quantity | None, str]]:
    """Name, value, declaration and sentence of every field that is set (and, of a file with faults, readable)."""
    known = declarations(type(part))
    for name in known:
        if getattr(part, name, None) is not None:
            quantity, doc = known[name]
            yield name, getattr(part, name), quantity, doc


def declarations(kind: type[Part | Effect]) -> dict[str, tuple[Quantity | None, str]]:
    """Declaration (None for text, a table, a list) and sentence of every field of a part or effect."""
    if issubclass(kind, Effect):
        found = {f.name: quantity_of(f) for f in fields(kind)}
        return {name: (quantity, quantity.doc if quantity else "") for name, quantity in found.items()}
    return {name: (quantity_of(info), info.description or "") for name, info in kind.model_fields.items()}


def _table(part: Part | Effect, path: str) -> Iterator[str]:
    below: list[tuple[str, Any]] = []
    for name, value, known, _ in entries(part):
        if value == ():
            continue
        if isinstance(value, (Part, tuple, dict)) and name != "unusual":
            below.append((f"{path}.{name}".lstrip("."), value))
        else:
            yield f"{name} = {_literal(value, known)}"
    for name, value in below:
        yield from _nested(name, value)


def _nested(path: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for name, parts in value.items():
            yield from _nested(f"{path}.{name}", parts[0] if len(parts) == 1 else parts)
    elif isinstance(value, tuple):
        for part in value:
            yield from ("", f"[[{path}]]", *_table(part, path))
    else:
        yield from ("", f"[{path}]", *_table(value, path))


def _literal(value: Any, known: Quantity | None) -> str:
    if isinstance(value, (bool, int, tuple)) or (known is not None and known.unit == "1"):
        return json.dumps(value)
    if known is not None:
        return json.dumps(show(value, known.unit))
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
