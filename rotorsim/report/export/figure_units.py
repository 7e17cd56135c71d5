"""Figures in imperial units: data, ranges and labels of the axes and colour scales that state a metric unit.

An axis states its unit in the brackets of its title or of its panel's, a colour scale begins its title with it, and the
text at a point has it behind the placeholder. Names of curves and other texts are made in the units of the page.
"""

from __future__ import annotations

import re
from math import log10
from typing import Any

import numpy as np

from rotorsim.report.export import figure_table as table
from rotorsim.report.export.display_units import LEADING, NUMBER, PLACED, imperial, imperial_label, scaled, unit_in

TEXTS = {"text", "hovertemplate", "title"}
"""Entries that state units: titles of axes, of panels and of colour scales, and the text at a point."""
Object = dict[str, Any]


def imperial_figure(figure: Object) -> Object:
    """A figure (`data` and `layout` of plotly) with every axis, colour scale and text in imperial units."""
    layout, data = figure["layout"], figure["data"]
    flat = [_flat(layout, trace) for trace in data]
    factors = {name: _factor(unit) for units in flat for name, unit in units.items() if unit}
    traces = [_trace(layout, trace, factors) for trace in data]
    for name, factor in factors.items():
        layout = layout | {name: _axis(layout.get(name, {}), factor)}
    layout = {key: _colour_axis(value) if key.startswith("coloraxis") else value for key, value in layout.items()}
    layout = {key: _scene(value) if key.startswith("scene") else value for key, value in layout.items()}
    for kind in ("shapes", "annotations"):
        if kind in layout:
            layout = layout | {kind: [_placed(one, factors) for one in layout[kind]]}
    return {"data": _texts(traces), "layout": _texts(layout)}


def _factor(unit: str) -> float:
    return imperial(unit)[1]


def _flat(layout: Object, trace: Object) -> dict[str, str | None]:
    """Units of the two axes of a trace by their names in the layout."""
    if _in_space(trace):
        return {}
    return {table.axis_of(trace, letter): _axis_unit(layout, trace, letter) for letter in "xy"}


def _axis_unit(layout: Object, trace: Object, letter: str) -> str | None:
    """Unit in the title of an axis, else in that of the panel for y, else in that of the axis in the next panel."""
    own = table.label(layout, trace, letter, aligned=False)
    if not own and letter == "y" and not _is_map(trace):
        own = table.panel(layout, trace)
    found = unit_in(own if "[" in own else table.label(layout, trace, letter))
    return found


def _in_space(trace: Object) -> bool:
    return "3d" in trace.get("type", "") or trace.get("type") == "surface"


def _is_map(trace: Object) -> bool:
    return trace.get("type") in ("heatmap", "contour")


def _trace(layout: Object, trace: Object, factors: dict[str, float]) -> Object:
    made = dict(trace)
    if _in_space(trace):
        scene = layout.get(trace.get("scene", "scene"), {})
        for letter in "xyz":
            unit = unit_in(table.title(scene.get(f"{letter}axis", {})))
            if unit and letter in made:
                made[letter] = _times(made[letter], _factor(unit))
    for letter in "xy":
        factor = factors.get(table.axis_of(trace, letter))
        for name in (letter, *(("base",) if (trace.get("orientation") == "h") == (letter == "x") else ())):
            if factor and not _in_space(trace) and name in made:
                made[name] = _times(made[name], factor)
    bar = table.colour_bar(layout, trace)
    unit = _bar_unit(bar) or (unit_in(table.panel(layout, trace)) if _is_map(trace) else None)
    if not unit or (trace.get("hoverinfo") == "skip" and _is_map(trace)):
        return made
    name = "surfacecolor" if "surfacecolor" in made else "z"
    if name in made:
        made[name] = _times(made[name], _factor(unit), table.logarithmic(bar))
    if "customdata" in made and _is_map(trace):
        made["customdata"] = _times(made["customdata"], _factor(unit))
    for limit in ("zmin", "zmax", "cmin", "cmax"):
        if made.get(limit) is not None:
            made[limit] = _shifted(made[limit], _factor(unit), table.logarithmic(bar))
    return made


def _bar_unit(bar: Object) -> str | None:
    found = LEADING.search(table.title(bar))
    return found[1] if found else None


def _times(values: Any, factor: float, logarithmic: bool = False) -> Any:
    array = table.array(values)
    if array is None or array.dtype.kind in "OU":
        return _categories(values, factor)
    made = array + log10(factor) if logarithmic else array * factor
    return _plain(made)


def _categories(values: Any, factor: float) -> Any:
    """Names of categories of which some are bare numbers, in the unit of their axis."""
    if isinstance(values, list):
        return [_categories(one, factor) for one in values]
    return scaled(values, factor) if isinstance(values, str) and re.fullmatch(NUMBER, values) else values


def _plain(values: np.ndarray) -> Any:
    if values.ndim > 1:
        return [_plain(row) for row in values]
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in values]


def _shifted(value: float, factor: float, logarithmic: bool) -> float:
    return value + log10(factor) if logarithmic else value * factor


def _axis(axis: Object, factor: float) -> Object:
    made, logarithmic = dict(axis), axis.get("type") == "log"
    if made.get("range"):
        made["range"] = [None if v is None else _shifted(v, factor, logarithmic) for v in made["range"]]
    if isinstance(made.get("tickvals"), (list, dict)):
        made["tickvals"] = _times(made["tickvals"], factor)
    if isinstance(made.get("dtick"), (int, float)) and not logarithmic:
        del made["dtick"]
    return made


def _colour_axis(axis: Object) -> Object:
    bar = axis.get("colorbar", {})
    unit = _bar_unit(bar)
    if not unit:
        return axis
    factor, logarithmic = _factor(unit), table.logarithmic(bar)
    made = axis | {k: _shifted(axis[k], factor, logarithmic) for k in ("cmin", "cmax") if axis.get(k) is not None}
    if logarithmic:
        ticks = [float(t) for t in range(int(np.ceil(made["cmin"])), int(np.floor(made["cmax"])) + 1)]
        made["colorbar"] = bar | {"tickvals": ticks, "ticktext": [f"{10.0**t:g}" for t in ticks]}
    return made


def _scene(scene: Object) -> Object:
    made = dict(scene)
    for name in ("xaxis", "yaxis", "zaxis"):
        unit = unit_in(table.title(scene.get(name, {})))
        if unit:
            made[name] = _axis(scene[name], _factor(unit))
    return made


def _placed(one: Object, factors: dict[str, float]) -> Object:
    """A shape or note whose place is in the units of axes."""
    made = dict(one)
    for letter in "xy":
        factor = factors.get(table.axis_name(one.get(f"{letter}ref", letter)))
        for name in (letter, f"{letter}0", f"{letter}1"):
            if factor and isinstance(made.get(name), (int, float)):
                made[name] *= factor
    return made


def _texts(value: Any, key: str = "") -> Any:
    """The same structure with converted texts."""
    if isinstance(value, dict):
        return {name: _texts(one, name) for name, one in value.items()}
    if isinstance(value, list):
        return [_texts(one, key) for one in value] if key in TEXTS or _holds_objects(value) else value
    return _text(value) if isinstance(value, str) and key in TEXTS and not re.fullmatch(r"[\d.]*", value) else value


def _text(value: str) -> str:
    """A text with the units in brackets, behind placeholders and at its beginning in imperial ones."""
    value = PLACED.sub(lambda at: f"{at[1]}{imperial(at[2])[0]}", imperial_label(value))
    return LEADING.sub(lambda at: imperial(at[1])[0], value)


def _holds_objects(values: list[Any]) -> bool:
    return any(isinstance(one, dict) for one in values[:1])
