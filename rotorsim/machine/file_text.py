"""Text of machine files: reading, names of bearings, canonical TOML, edits that keep comments and order."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, MutableMapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields
from functools import lru_cache
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable, Table

from rotorsim.base.display import did_you_mean, quote
from rotorsim.base.errors import MachineFileError
from rotorsim.base.input_files import instead, parse_toml
from rotorsim.base.quantity import Quantity, quantity_of
from rotorsim.base.units import show
from rotorsim.effects import Effect
from rotorsim.machine.part import Part

MAX_BYTES = 1_000_000


def read_text(path: Path, wanted: str = "a machine file") -> str:
    """Text of a machine file, or of another that is `wanted`; raises MachineFileError if it cannot be one."""
    if not path.is_file():
        raise MachineFileError(f"{path}: is not a file; give the path of {wanted}")
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
        reason = f"{ours}; {writes}" if ours else f"is not text in UTF-8, as {wanted} is"
        raise MachineFileError(f"{path}: {reason}") from error
    if "\0" in text:
        raise MachineFileError(f"{path}: is binary; {wanted} is text in UTF-8")
    return text


def parse(text: str) -> dict[str, Any]:
    """Tables of a TOML text; raises MachineFileError with line and column."""
    if not text.strip():
        raise MachineFileError("the machine file is empty; 'rotorsim machine new PATH' writes one to start from")
    try:
        return parse_toml(text.removeprefix("\ufeff"))
    except ValueError as error:
        raise MachineFileError(f"not a TOML file: {str(error)[:200]}; correct that line") from error


def tables_of(text: str) -> dict[str, Any]:
    """Tables of a TOML text as of `parse`: a copy of those that are kept, at a tenth of the time."""
    return deepcopy(kept_tables(text))


@lru_cache(maxsize=8)
def kept_tables(text: str) -> dict[str, Any]:
    """Tables of a TOML text as of `parse`, which stay as they are: nobody writes into them."""
    return parse(text)


def value_at(tables: Any, path: str) -> Any:
    """The value that is written at the dotted `path` of tables; None where nothing is."""
    here = tables
    for key in path.split("."):
        if isinstance(here, list):
            here = here[int(key)] if key.isdecimal() and int(key) < len(here) else None
        elif isinstance(here, Mapping):
            here = here.get(key, here if key == "0" else None)
        else:
            return None
    return here


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


_HEADER = re.compile(r"[ \t]*\[{1,2}\s*([^\[\]#]+?)\s*\]{1,2}[ \t]*(?:#.*)?")
"""Line that begins a table."""


def without(text: str, path: str) -> str:
    """TOML `text` without the value, table or entry of a list at the dotted `path`; all other bytes stay.

    A comment above the next table belongs to that one. Raises MachineFileError if nothing is there.
    """
    expected = parse(text)
    *above, last = path.split(".")
    held = _descend(expected, above, path)
    if not _has(held, last):
        raise MachineFileError(f"{path}: is not in the file", argument=path, value=last)
    _remove(held, last)
    for depth in range(len(above), 0, -1):  # a table or list that is empty now has no header of its own
        holder = _descend(expected, above[: depth - 1], path)
        if not holder[int(above[depth - 1]) if isinstance(holder, list) else above[depth - 1]]:
            _remove(holder, above[depth - 1])
    lines = text.splitlines(keepends=True)
    if place := _block(lines, path):
        shorter = "".join([*lines[: place[0]], *lines[place[1] :]])
        if _reads(shorter, expected):
            return shorter
    document = tomlkit.parse(text)
    _remove(_descend(document, above, path), last)
    return tomlkit.dumps(document)


def with_copy(text: str, path: str, changes: Mapping[str, Any]) -> str:
    """TOML `text` with a copy of an entry of a list behind it, and other values at keys of the copy."""
    above, _, number = path.rpartition(".")
    lines = text.splitlines(keepends=True)
    if not number.isdecimal() or (place := _block(lines, path)) is None:
        raise MachineFileError(f"{path}: is not a table of a list with a header of its own; copy it in an editor")
    begin, end = place
    copied = lines[begin:end]
    lines[end - 1] = lines[end - 1].rstrip("\r\n") + "\n" if not lines[end - 1].endswith("\n") else lines[end - 1]
    space = [] if not lines[end - 1].strip() else ["\n"]
    longer = "".join([*lines[:end], *space, *copied, *lines[end:]])
    return with_values(longer, {f"{above}.{int(number) + 1}.{key}": value for key, value in changes.items()})


def with_table(text: str, name: str, values: Mapping[str, Any], single: bool = False) -> str:
    """TOML `text` with one more entry of the list `name`, or with the `single` table, behind its neighbours."""
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    heads = [(k, key) for k, line in enumerate(lines) if (key := _key(line))]
    top = name.partition(".")[0]
    own = [k for k, key in heads if key == name or key.startswith(f"{name}.")]
    near = own or [k for k, key in heads if key.partition(".")[0] == top]
    at = _end(lines, heads, near[-1]) if near else len(lines)
    body = "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items())
    table = f"[{name}]\n{body}" if single else f"[[{name}]]\n{body}"
    before = "" if not at or not lines[at - 1].strip() else "\n"
    after = "\n" if at < len(lines) else ""
    return "".join([*lines[:at], before, table, after, *lines[at:]])


def _has(held: Any, key: str) -> bool:
    return key.isdecimal() and int(key) < len(held) if isinstance(held, list) else key in held


def _remove(held: Any, key: str) -> None:
    del held[int(key) if isinstance(held, list) else key]


def _reads(text: str, expected: Mapping[str, Any]) -> bool:
    """Whether a text holds these tables."""
    try:
        return parse_toml(text) == expected
    except ValueError:
        return False


def _key(line: str) -> str:
    """Dotted key of a line that begins a table, else empty."""
    match = _HEADER.fullmatch(line.rstrip("\r\n"))
    return ".".join(part.strip().strip("\"'") for part in match[1].split(".")) if match else ""


def _block(lines: list[str], path: str) -> tuple[int, int] | None:
    """First line and the one behind the last of the table at a path, those below it included."""
    heads = [(k, key) for k, line in enumerate(lines) if (key := _key(line))]
    name, _, number = path.rpartition(".")
    name, number = (name, number) if number.isdecimal() else (path, "0")
    own = [k for k, key in heads if key == name]
    return (own[int(number)], _end(lines, heads, own[int(number)])) if int(number) < len(own) else None


def _end(lines: list[str], heads: Sequence[tuple[int, str]], begin: int) -> int:
    """The line behind a table and those below it; comments right above the next header belong to that."""
    name = dict(heads)[begin]
    end = next((k for k, key in heads if k > begin and not key.startswith(f"{name}.")), len(lines))
    while begin + 1 < end < len(lines) and lines[end - 1].lstrip().startswith("#"):
        end -= 1
    return end


ANY = "*"
"""Key of a path that stands for every entry of a list."""


def with_value(text: str, path: str, value: Any) -> str:
    """TOML `text` with `value` at the dotted `path`; list items by index, `*` for each; absent tables are made.

    Raises MachineFileError if the path does not lead to a value.
    """
    return with_values(text, {path: value})


def with_values(text: str, values: Mapping[str, Any]) -> str:
    """TOML `text` with several values at their dotted paths; the text is parsed once."""
    if len(values) == 1 and (quick := _replaced(text, *next(iter(values.items())))):
        return quick
    document = tomlkit.parse(text)
    for path, value in values.items():
        for one in _every(document, path):
            _set(document, one, value)
    return tomlkit.dumps(document)


def _replaced(text: str, path: str, value: Any) -> str:
    """TOML `text` with a text or number that stands on a line of its own replaced; empty where it does not.

    It is ten times as quick as to parse the text with its comments, and the tables that it reads as are compared.
    """
    above, _, last = path.rpartition(".")
    value, old = _plain(value), None if ANY in path else value_at(kept_tables(text), path)
    if not above or type(value) is not type(old) or not isinstance(value, (str, float)) or not str(value).isprintable():
        return ""
    lines = text.splitlines(keepends=True)
    begin, end = _block(lines, above) or (0, 0)
    end = next((k for k in range(begin + 1, end) if _key(lines[k])), end)
    key = re.compile(rf"([ \t]*{re.escape(last)}[ \t]*=[ \t]*){re.escape(tomlkit.item(old).as_string())}(?=\s|#|$)")
    found = [(k, place) for k in range(begin, end) if (place := key.match(lines[k]))]
    if len(found) != 1:
        return ""
    k, place = found[0]
    lines[k] = place[1] + tomlkit.item(value).as_string() + lines[k][place.end() :]
    shorter, expected = "".join(lines), tables_of(text)
    held = _descend(expected, above.split("."), path)
    held[last] = value
    return shorter if _reads(shorter, expected) else ""


def expanded(text: str, path: str) -> tuple[str, ...]:
    """The paths that a path with stars stands for: one for each entry of a list that has the value."""
    return _every(tomlkit.parse(text), path)


def _every(document: Any, path: str) -> tuple[str, ...]:
    if ANY not in (keys := path.split(".")):
        return (path,)
    found = tuple(".".join(one) for one in _matches(document, keys))
    if not found:
        raise MachineFileError(f"{path}: no entry of the list has such a value; name one by its number from 0")
    return found


def _matches(here: Any, keys: list[str]) -> Iterator[list[str]]:
    """Key lists of the values below `here` that a path with stars means."""
    if not keys:
        yield []
        return
    key, *rest = keys
    if isinstance(here, list):
        names = map(str, range(len(here))) if key == ANY else [key] if key.isdecimal() and int(key) < len(here) else []
        below = {name: here[int(name)] for name in names}
    else:
        below = {key: here[key]} if isinstance(here, MutableMapping) and key in here else {}
    for name, value in below.items():
        yield from ([name, *after] for after in _matches(value, rest))


def remarked(text: str, paths: Iterable[str], remark: str) -> str:
    """TOML `text` with `remark` as the comment behind the values at `paths`, instead of the one that is there."""
    document = tomlkit.parse(text)
    for path in paths:
        *above, last = path.split(".")
        comment(_descend(document, above, path), last, remark)
    return tomlkit.dumps(document)


def comment(table: Any, key: str, remark: str) -> None:
    """Put `remark` behind a value of a table of tomlkit; an inline table has no room for comments and stays."""
    if not inline(table):
        table[key].comment(remark)


def inline(table: Any) -> bool:
    """Whether a table of tomlkit stands on one line, in braces."""
    return isinstance(table, InlineTable)


def _set(document: Any, path: str, value: Any) -> None:
    keys = path.split(".")
    if not all(keys):
        raise MachineFileError(f"{path!r} is not a path; write e.g. 'effects.unbalance.me'")
    table = _descend(document, keys[:-1], path)
    if isinstance(table, list):
        _item(table, keys[-1], ".".join(keys[:-1]))
    held = table if isinstance(table, list) else table.get(keys[-1])
    if isinstance(held, (MutableMapping, list)):
        below = _first(held[int(keys[-1])] if isinstance(table, list) else held)
        hint = f", e.g. '{path}.{below}'" if below else ""
        raise MachineFileError(
            f"{path}: holds several values; name the one to change{hint}", argument=path, value=value
        )
    behind = _comments_at_the_end(table) if held is None else []
    try:
        table[keys[-1]] = _plain(value)
    except ValueError as error:  # tomlkit's answer to what TOML cannot express
        raise MachineFileError(f"{path}: {quote(value)} is not a valid value; write text with a unit") from error
    for line in behind:
        table.add(line)


def _comments_at_the_end(table: Any) -> list[Any]:
    """Comments and empty lines taken off the end of a table, where a block to be switched on may stand: a new value
    goes before them."""
    body, taken = table.value.body if isinstance(table, Table) else [], list[Any]()
    while body and body[-1][0] is None:
        taken.insert(0, body.pop()[1])
    return taken


def _first(held: Any) -> str:
    """Path of the first value below a table or list; empty where there is none."""
    if not isinstance(held, (MutableMapping, list)):
        return ""
    for key, value in held.items() if isinstance(held, MutableMapping) else enumerate(held):
        nested = isinstance(value, (MutableMapping, list))
        if not nested or _first(value):
            return f"{key}.{_first(value)}" if nested else str(key)
    return ""


def _descend(table: Any, keys: list[str], path: str) -> Any:
    """The table that holds the last key of `path`."""
    for depth, key in enumerate(keys):
        if isinstance(table, list):
            table = _item(table, key, ".".join(keys[:depth]))
        elif key == "0" and "0" not in table:  # a single table is its own first item
            continue
        else:
            if key not in table:
                table[key] = tomlkit.table(is_super_table=depth < len(keys) - 1)
            table = table[key]
        if not isinstance(table, (MutableMapping, list)):
            raise MachineFileError(f"{path}: '{'.'.join(keys[: depth + 1])}' is a value, not a table; check the path")
    return table


def _item(items: list[Any], key: str, where: str) -> Any:
    if key.isdecimal() and int(key) < len(items):
        return items[int(key)]
    raise MachineFileError(f"{where}: has {len(items)} entries, counted from 0; '{key}' is none of them")


def _plain(value: Any) -> Any:
    """Numbers of numpy and the like as TOML knows them."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)


KEYS = ("bearing", "place")
"""Keys under which an effect names its bearing."""


@dataclass
class Names:
    """Indices of bearings by name, and a sentence for each name that is none."""

    known: dict[str, int]
    problems: list[str] = field(default_factory=list)

    def index(self, path: str, value: Any) -> Any:
        """The index of a name, None for one that is not known; other values are left as they are."""
        if not isinstance(value, str) or value in self.known:
            return self.known[value] if isinstance(value, str) else value
        remedy = did_you_mean(value, self.known) if self.known else "give the bearings names, or write an index from 0"
        self.problems.append(f"{path}: {quote(value)} is not the name of a bearing; {remedy}")
        return None


def by_index(tables: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The tables of a machine file with indices for names of bearings, and a sentence for each name that is none."""
    bearings = tables.get("bearings")
    named = [b.get("name") if isinstance(b, Mapping) else None for b in bearings] if isinstance(bearings, list) else []
    names = Names({name: i for i, name in enumerate(named) if isinstance(name, str)})
    found = dict(tables)
    if isinstance(tables.get("injection"), Mapping):
        found |= _fed(tables, names)
    if isinstance(tables.get("probes"), list):
        found["probes"] = [_effect(f"probes.{i}", one, names) for i, one in enumerate(tables["probes"])]
    if isinstance(tables.get("effects"), Mapping):
        found["effects"] = {name: _effect(f"effects.{name}", one, names) for name, one in tables["effects"].items()}
    return found, names.problems


def _fed(tables: Mapping[str, Any], names: Names) -> dict[str, Any]:
    """Injection and injectors: the bearing that injectors name is that of `[injection]`, as pins feed one film."""
    common, injectors = dict(tables["injection"]), tables.get("injectors")
    given = injectors if isinstance(injectors, list) else []
    for i, one in enumerate(given):
        own = one.get("bearing") if isinstance(one, Mapping) else None
        if own is not None and common.setdefault("bearing", own) != own:
            sentence = f"{quote(own)} is not that of the others; all pins feed one film"
            names.problems.append(f"injectors.{i}.bearing: {sentence}")
    if "bearing" in common:
        common["bearing"] = names.index("injection.bearing", common["bearing"])
    if not given:
        return {"injection": common}
    kept = [{k: v for k, v in one.items() if k != "bearing"} if isinstance(one, Mapping) else one for one in given]
    return {"injection": common, "injectors": kept}


def _effect(path: str, entry: Any, names: Names) -> Any:
    """One effect or several; a `place` that names a bearing is written as `bearing`."""
    if isinstance(entry, list):
        return [_effect(f"{path}.{i}", one, names) for i, one in enumerate(entry)]
    if not isinstance(entry, Mapping):
        return entry
    return {"bearing" if k in KEYS else k: names.index(f"{path}.{k}", v) if k in KEYS else v for k, v in entry.items()}
