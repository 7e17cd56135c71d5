"""Numbers of a figure as a table: a row a point, with panel, curve and the labels of its axes."""

from __future__ import annotations

import base64
import csv
import io
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

HEADS = ("panel", "curve", "x axis", "y axis", "z axis", "x", "y", "z", "value")


def figure_csv(figure: dict[str, Any]) -> str:
    """CSV of a figure (`data` and `layout` of plotly): z of maps and surfaces, as value the colour of a surface."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    layout = figure["layout"]
    for number, trace in enumerate(figure["data"], start=1):
        labels = [label(layout, trace, letter) for letter in "xyz"]
        name = _plain(trace.get("name") or f"{trace.get('type', 'scatter')} {number}")
        for point in _points(layout, trace):
            writer.writerow((panel(layout, trace), name, *labels, *point))
    return text.getvalue()


def _points(layout: dict[str, Any], trace: dict[str, Any]) -> Iterator[list[str]]:
    x, y, z, value = (array(trace.get(name)) for name in ("x", "y", "z", "surfacecolor"))
    if z is not None and z.ndim == 2:
        x = np.arange(z.shape[1]) if x is None else x
        y = np.arange(z.shape[0]) if y is None else y
        x, y = np.meshgrid(x, y) if x.ndim == 1 else (x, y)
        z = 10.0**z if logarithmic(colour_bar(layout, trace)) else z
    known = [one.ravel() for one in (x, y, z) if one is not None]
    if not known:
        return
    x, y = (np.arange(known[0].size) if one is None else one for one in (x, y))
    flat = [None if one is None else one.ravel() for one in (x, y, z, value)]
    for k in range(min(one.size for one in flat if one is not None)):
        yield ["" if one is None else _cell(one[k]) for one in flat]


def colour_bar(layout: dict[str, Any], trace: dict[str, Any]) -> dict[str, Any]:
    """Colour bar of a trace, its own or that of its colour axis."""
    axis = layout.get(str(trace.get("coloraxis", "")), {})
    return dict(trace.get("colorbar") or axis.get("colorbar") or {})


def logarithmic(bar: dict[str, Any]) -> bool:
    """Whether a colour bar shows powers of ten at the values of its ticks."""
    values, texts = array(bar.get("tickvals")), bar.get("ticktext")
    if values is None or not texts:
        return False
    return bool(np.allclose(10.0 ** values.astype(float), [float(t) for t in texts], rtol=1e-3))


def array(values: Any) -> np.ndarray | None:
    """Values of a trace; plotly writes numbers as base64 of their bytes, and two-line labels as two lists."""
    if values is None:
        return None
    if isinstance(values, dict):
        shape = [int(n) for n in str(values.get("shape", "-1")).split(",")]
        return np.frombuffer(base64.b64decode(values["bdata"]), np.dtype(values["dtype"])).reshape(shape)
    if values and isinstance(values[0], list) and any(isinstance(v, str) for v in values[0]):
        return np.array([" / ".join(map(str, one)) for one in zip(*values, strict=True)], dtype=object)
    return np.array([np.nan if v is None else v for v in values], dtype=object if _mixed(values) else None)


def _mixed(values: list[Any]) -> bool:
    return any(isinstance(v, str) for v in values)


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return _plain(value)
    return f"{float(value):.6g}" if np.isfinite(value) else ""


def _plain(text: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", str(text))).strip()


def axis_of(trace: dict[str, Any], letter: str) -> str:
    """Name of a trace's axis in the layout."""
    return axis_name(str(trace.get(f"{letter}axis", letter)))


def axis_name(reference: str) -> str:
    """Name in the layout of an axis that is referred to: "x2" is `xaxis2`."""
    return f"{reference[:1]}axis{reference[1:]}"


def label(layout: dict[str, Any], trace: dict[str, Any], letter: str, aligned: bool = True) -> str:
    """Title of an axis, or of the colour bar; of an axis that has none, that of one linked to it or aligned with it."""
    if "3d" in trace.get("type", "") or trace.get("type") == "surface":
        return title(layout.get(str(trace.get("scene", "scene")), {}).get(f"{letter}axis", {}))
    if letter == "z":
        return title(colour_bar(layout, trace))
    name = axis_of(trace, letter)
    own = layout.get(name, {})
    if stated := title(own):
        return stated
    group = own.get("matches") or name.replace("axis", "")
    linked = [one for key, one in layout.items() if re.fullmatch(rf"{letter}axis\d*", key)
              and group in (one.get("matches"), key.replace("axis", ""))]  # fmt: skip
    return next(filter(None, map(title, [*linked, *(_aligned(layout, name) if aligned else ())])), "")


def _aligned(layout: dict[str, Any], name: str) -> list[dict[str, Any]]:
    """Axes of the panels in the same row, of a y axis, or in the same column, of an x axis."""
    place = layout.get(name, {}).get("domain", (0, 1))
    others = {key: one for key, one in layout.items() if re.fullmatch(rf"{name[0]}axis\d*", key) and key != name}
    return [one for one in others.values() if "overlaying" not in one
            and np.allclose(one.get("domain", (0, 1)), place, atol=1e-6)]  # fmt: skip


def title(axis: dict[str, Any]) -> str:
    """Title of an axis or colour bar as plain text."""
    stated = axis.get("title") or {}
    return _plain(stated.get("text") or "") if isinstance(stated, dict) else _plain(stated)


def panel(layout: dict[str, Any], trace: dict[str, Any]) -> str:
    """Title above the trace's panel."""
    x, y = (layout.get(axis_of(trace, letter), {}).get("domain", (0, 1)) for letter in "xy")
    for note in layout.get("annotations", ()):
        above = note.get("yref") == "paper" and abs(note.get("y", 0) - y[1]) < 1e-3
        if above and note.get("xref") == "paper" and x[0] <= note.get("x", -1) <= x[1]:
            return _plain(note.get("text", ""))
    return ""
