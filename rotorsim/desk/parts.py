"""Parts of a design as a page lists them: groups, parts, fields with what is written, unit, sentence and problem."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from rotorsim.base.quantity import Quantity
from rotorsim.base.units import show
from rotorsim.desk.design import NEW, Design, _shown, unit_of
from rotorsim.machine.file_text import kept_tables, value_at
from rotorsim.machine.schema import leaves

GROUPS = {
    "shaft.sections": "Shaft sections", "discs": "Discs", "bearings": "Bearings",
    "thrust_bearings": "Thrust bearings", "probes": "Probes", "shaft.layers": "Layers on the shaft",
    "point_masses": "Point masses", "effects": "Effects", "shaft": "Shaft", "probe": "Measuring plane",
    "injectors": "Injectors", "injection": "Injection", "actuators": "Actuators", "gas": "Gas", "drive": "Drive",
    "limits": "Limits", "grid": "Grid of the film", "solver": "Solver", "checked": "Checked range", "": "Machine",
}  # fmt: skip
"""Titles of groups of parts in their order, by the key of their list or table."""
OPEN = ("shaft.sections", "discs", "bearings", "thrust_bearings", "probes")
"""Groups that are open at first where they have a part or may get one."""
NAMES = {
    "shaft.sections": "section", "discs": "disc", "bearings": "bearing", "thrust_bearings": "thrust bearing",
    "probes": "probe", "shaft.layers": "layer", "point_masses": "mass", "injectors": "injector",
}  # fmt: skip
"""Word for a part of a list."""
LISTS = re.compile(rf"({'|'.join(map(re.escape, NAMES))})\.(\d+)\.(.+)")
EFFECT = re.compile(r"(effects\.\w+(?:\.\d+)?)\.(.+)")
ADDED = {"effects": ("effects.unbalance", "effects.gravity")}
"""Parts that can be added to a group, where they are not of the group's own kind."""


def listed(design: Design) -> list[dict[str, Any]]:
    """Groups of parts of a design for a page, those without parts that can be added included."""
    tables = kept_tables(design.text)
    groups: dict[str, dict[str, dict[str, Any]]] = {key: {} for key in GROUPS}
    for path, value, declared, doc in _fields(design, tables):
        group, part, name = _place(path)
        if part not in groups[group]:
            groups[group][part] = {"path": part, "title": _title(tables, group, part), "fields": [],
                                   "many": part != group and not part.startswith("effects.")}  # fmt: skip
        groups[group][part]["fields"].append(_field(path, name, value_at(tables, path), value, declared, doc))
    found = []
    for key, title in GROUPS.items():
        kinds = ADDED.get(key, (key,) if key in NEW else ())
        if groups[key] or kinds:
            found.append({"key": key, "title": title, "open": key in OPEN, "parts": list(groups[key].values()),
                          "add": [{"kind": kind, "text": _word(kind)} for kind in kinds]})  # fmt: skip
    return found


def problem_fields(design: Design) -> dict[str, str]:
    """Sentences about the text as it is, by the path of the field that they are about."""
    pairs = (problem.partition(": ") for problem in design.problems)
    return {path: sentence or path for path, _, sentence in pairs}


def _fields(design: Design, tables: Mapping[str, Any]) -> Iterator[tuple[str, Any, Quantity | None, str]]:
    """Path, SI value, declaration and sentence of every field; only what is written in a text that makes no machine."""
    if design.machine is None or design.problems:
        known = {path: (declared, doc) for path, _, declared, doc in leaves(design.machine)} if design.machine else {}
        for path in _written(tables):
            yield path, None, *known.get(path, (None, ""))
        return
    for path, value, declared, doc in leaves(design.machine):
        if (
            declared is not None
            or isinstance(value, str)
            or value_at(tables, path) is not None
            or path.endswith("name")
        ):
            yield path, value, declared, doc


def _written(here: Any, path: str = "") -> Iterator[str]:
    """Paths of all values that are written."""
    entries = here.items() if isinstance(here, Mapping) else enumerate(here)
    for key, value in entries:
        below = f"{path}.{key}".lstrip(".")
        if isinstance(value, Mapping) or (isinstance(value, list) and any(isinstance(one, Mapping) for one in value)):
            yield from _written(value, below)
        else:
            yield below


def _place(path: str) -> tuple[str, str, str]:
    """Group, path of the part and name of a field."""
    if match := LISTS.fullmatch(path):
        return match[1], f"{match[1]}.{match[2]}", match[3]
    if match := EFFECT.fullmatch(path):
        return "effects", match[1], match[2]
    group, _, name = path.partition(".")
    return (group, group, name) if name and group in GROUPS else ("", "", path)


def _title(tables: Mapping[str, Any], group: str, part: str) -> str:
    if group == "effects":
        return part.removeprefix("effects.").replace("_", " ").replace(".", " ")
    if group not in NAMES:
        return GROUPS[group]
    table = value_at(tables, part)
    name = table.get("name") if isinstance(table, Mapping) else None
    kind = table.get("kind") if isinstance(table, Mapping) else None
    # counted from 0 as in the file and in names of results
    text = f"{NAMES[group]} {part.rpartition('.')[2]}"
    return text + (f": {name}" if name else f" ({kind})" if kind else "")


def _word(kind: str) -> str:
    return NAMES.get(kind, kind.rpartition(".")[2])


def _field(path: str, name: str, written: Any, value: Any, declared: Quantity | None, doc: str) -> dict[str, Any]:
    """A field: what is written, what holds where nothing is, its unit and choices."""
    dimension = declared is not None and declared.unit != "1"
    unit = unit_of(written, declared) if dimension and declared is not None else ""
    holds = "" if value is None or written is not None else show(value, declared.unit) if declared else str(value)
    text = "" if written is None else _shown(written) if dimension or declared is None else str(written)
    if declared is None and isinstance(written, str):
        text = written
    return {
        "path": path, "label": name.replace("_", " ").replace(".", " "), "text": text, "unit": unit, "doc": doc,
        "holds": holds.removesuffix(f" {unit}") if unit else holds, "set": written is not None,
        "number": declared is not None and not declared.choices,
        "choices": list(declared.choices) if declared is not None and declared.choices else [],
    }  # fmt: skip
