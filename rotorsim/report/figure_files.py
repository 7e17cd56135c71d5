"""Figures of a page as data and as files: PNG, SVG, a table of their numbers; and as data in imperial units.

A figure is plain data here (`data` and `layout` of plotly). An axis states its unit in the brackets of its title or of
its panel's, a colour scale begins its title with it, and the text at a point has it behind the placeholder. Names of
curves and other texts are made in the units of the page. Figures are converted as data because a page may hold those
of its caller or of a file, which nothing can draw again.
"""

import base64
import json
import re
from collections.abc import Iterator, Sequence
from math import log10
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.files import csv_text, write_bytes, write_text
from rotorsim.report.browser import NO_CHROME, chrome, images
from rotorsim.report.units import LEADING, NUMBER, PLACED, imperial, imperial_label, scaled, unit_in

KINDS = ("png", "svg", "csv")
"""Kinds of files of a figure."""
BEGIN, END = '<script type="application/json" id="figures">', "</script>"
"""Marks of the data of all figures in an HTML page."""


def check_kind(kind: str, name: str = "figures") -> None:
    """Raise DataError for a kind of file that is not known, or that nothing here can draw; `name` is the argument's."""
    if kind not in KINDS:
        raise DataError(f"{name}: '{kind}' is not known; {did_you_mean(kind, KINDS)}")
    if kind != "csv" and chrome() is None:
        raise DataError(f"{name}: {NO_CHROME}, or write csv")


def save_png(figure: go.Figure, path: str | Path, width: int = 1400, height: int = 700) -> None:
    """Write a figure as PNG of width x height px; raises DataError without a browser of the Chrome family.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.save_png(rs.report.waterfall(runup), "waterfall.png")  # doctest: +SKIP
    """
    try:
        content = images([json.loads(str(figure.to_json()))], "png", width, height, scale=1)[0]
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
    write_bytes(path, content)


def save_figures(page: str | Path, kind: str) -> list[Path]:
    """Write every figure of a written page as a file next to it, named after page and section.

    Parameters
    ----------
    page : path
        HTML page of a report.
    kind : {"png", "svg", "csv"}
        PNG and SVG take a browser of the Chrome family, which opens no window; CSV holds the numbers, a row a point.

    Raises
    ------
    DataError
        For another kind, for a file other than a page, and where no browser can draw.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.write_report(record, "page.html")
    >>> rs.report.save_figures("page.html", "csv")[0].suffix
    '.csv'
    """
    check_kind(kind, "kind")
    return write_figures(Path(page), figures_of(Path(page)), kind)


def write_figures(page: Path, figures: Sequence[dict[str, Any]], kind: str) -> list[Path]:
    """Write figures (`title`, `data`, `layout`) of a complete page next to it; raises DataError."""
    paths = _paths(page, figures, kind)
    if kind == "csv":
        for path, figure in zip(paths, figures, strict=True):
            write_text(path, figure_csv(figure))
        return paths
    try:
        drawn = images(figures, kind) if figures else []
    except DataError as error:
        raise DataError(f"the page {page} is complete, its figures are not drawn: {error}") from error
    for path, content in zip(paths, drawn, strict=True):
        write_bytes(path, content)
    return paths


def figure_paths(page: Path, kind: str) -> list[Path]:
    """Files that `save_figures` writes for a page, there or not; raises DataError for a file other than a page."""
    return _paths(page, figures_of(page), kind)


def figures_of(page: Path) -> list[dict[str, Any]]:
    """Figures (`title`, `data`, `layout`) of a page's file in order; raises DataError for a file other than a page."""
    try:
        _, begin, rest = page.read_text(encoding="utf-8").partition(BEGIN)
        if not begin:
            raise ValueError("it holds no figures")
        return list(json.loads(rest.partition(END)[0]))
    except (OSError, ValueError) as error:
        raise DataError(
            f"{page}: cannot be read as the page of a report; name one that a command wrote",
            argument="page",
            value=page,
        ) from error


def _paths(page: Path, figures: Sequence[dict[str, Any]], kind: str) -> list[Path]:
    """One path a figure; a number follows a title that stands there twice."""
    names: list[str] = []
    for figure in figures:
        name = re.sub(r"[^a-z0-9]+", "_", figure["title"].lower()).strip("_")[:60] or "figure"
        count = sum(one == name or re.fullmatch(rf"{name}_\d+", one) is not None for one in names)
        names.append(f"{name}_{count + 1}" if count else name)
    return [page.with_name(f"{page.stem}_{name}.{kind}") for name in names]


HEADS = ("panel", "curve", "x axis", "y axis", "z axis", "x", "y", "z", "value")
TEXTS = {"text", "hovertemplate", "title"}
"""Entries that state units: titles of axes, of panels and of colour scales, and the text at a point."""
Object = dict[str, Any]


def figure_csv(figure: Object) -> str:
    """CSV of a figure, a row a point: z of maps and surfaces, as value the colour of a surface."""
    layout = figure["layout"]
    rows: list[tuple[Any, ...]] = [HEADS]
    for number, trace in enumerate(figure["data"], start=1):
        labels = [label(layout, trace, letter) for letter in "xyz"]
        name = _bare(trace.get("name") or f"{trace.get('type', 'scatter')} {number}")
        for point in _points(layout, trace):
            rows.append((panel(layout, trace), name, *labels, *point))
    return csv_text(rows)


def _points(layout: Object, trace: Object) -> Iterator[list[str]]:
    x, y, z, value = (numbers(trace.get(name)) for name in ("x", "y", "z", "surfacecolor"))
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


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return _bare(value)
    return f"{float(value):.6g}" if np.isfinite(value) else ""


def _bare(text: str) -> str:
    """A text without tags, its white space single."""
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", str(text))).strip()


def colour_bar(layout: Object, trace: Object) -> Object:
    """Colour bar of a trace, its own or that of its colour axis."""
    axis = layout.get(str(trace.get("coloraxis", "")), {})
    return dict(trace.get("colorbar") or axis.get("colorbar") or {})


def logarithmic(bar: Object) -> bool:
    """True if a colour bar shows powers of ten at the values of its ticks."""
    values, texts = numbers(bar.get("tickvals")), bar.get("ticktext")
    if values is None or not texts:
        return False
    return bool(np.allclose(10.0 ** values.astype(float), [float(t) for t in texts], rtol=1e-3))


def numbers(values: Any) -> np.ndarray | None:
    """Values of a trace; plotly writes numbers as base64 of their bytes, and two-line labels as two lists."""
    if values is None:
        return None
    if isinstance(values, dict):
        shape = [int(n) for n in str(values.get("shape", "-1")).split(",")]
        return np.frombuffer(base64.b64decode(values["bdata"]), np.dtype(values["dtype"])).reshape(shape)
    if values and isinstance(values[0], list) and any(isinstance(v, str) for v in values[0]):
        return np.array([" / ".join(map(str, one)) for one in zip(*values, strict=True)], dtype=object)
    mixed = any(isinstance(v, str) for v in values)
    return np.array([np.nan if v is None else v for v in values], dtype=object if mixed else None)


def axis_name(reference: str) -> str:
    """Name in the layout of an axis that is referred to: "x2" is `xaxis2`."""
    return f"{reference[:1]}axis{reference[1:]}"


def axis_of(trace: Object, letter: str) -> str:
    """Name of a trace's axis in the layout."""
    return axis_name(str(trace.get(f"{letter}axis", letter)))


def label(layout: Object, trace: Object, letter: str, aligned: bool = True) -> str:
    """Title of an axis, or of the colour bar; of an axis that has none, that of one linked to it or aligned with it."""
    if _in_space(trace):
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


def _aligned(layout: Object, name: str) -> list[Object]:
    """Axes of the panels in the same row, of a y axis, or in the same column, of an x axis."""
    place = layout.get(name, {}).get("domain", (0, 1))
    others = {key: one for key, one in layout.items() if re.fullmatch(rf"{name[0]}axis\d*", key) and key != name}
    return [one for one in others.values() if "overlaying" not in one
            and np.allclose(one.get("domain", (0, 1)), place, atol=1e-6)]  # fmt: skip


def title(axis: Object) -> str:
    """Title of an axis or colour bar as plain text."""
    stated = axis.get("title") or {}
    return _bare(stated.get("text") or "") if isinstance(stated, dict) else _bare(stated)


def panel(layout: Object, trace: Object) -> str:
    """Title above the trace's panel."""
    x, y = (layout.get(axis_of(trace, letter), {}).get("domain", (0, 1)) for letter in "xy")
    for note in layout.get("annotations", ()):
        above = note.get("yref") == "paper" and abs(note.get("y", 0) - y[1]) < 1e-3
        if above and note.get("xref") == "paper" and x[0] <= note.get("x", -1) <= x[1]:
            return _bare(note.get("text", ""))
    return ""


def _in_space(trace: Object) -> bool:
    return "3d" in trace.get("type", "") or trace.get("type") == "surface"


def imperial_figure(figure: Object) -> Object:
    """A figure with every axis, colour scale and text in imperial units."""
    layout, data = dict(figure["layout"]), figure["data"]
    units = {axis_of(trace, letter): _axis_unit(layout, trace, letter)
             for trace in data if not _in_space(trace) for letter in "xy"}  # fmt: skip
    factors = {name: imperial(unit)[1] for name, unit in units.items() if unit}
    traces = [_trace(layout, trace, factors) for trace in data]
    layout |= {name: _axis(layout.get(name, {}), factor) for name, factor in factors.items()}
    for key, value in layout.items():
        if key.startswith("coloraxis"):
            layout[key] = _colour_axis(value)
        elif key.startswith("scene"):
            axes = {name: unit_in(title(value.get(name, {}))) for name in ("xaxis", "yaxis", "zaxis")}
            layout[key] = value | {name: _axis(value[name], imperial(unit)[1]) for name, unit in axes.items() if unit}
        elif key in ("shapes", "annotations"):
            layout[key] = [_placed(one, factors) for one in value]
    return {"data": _texts(traces), "layout": _texts(layout)}


def _axis_unit(layout: Object, trace: Object, letter: str) -> str | None:
    """Unit in the title of an axis, else in that of the panel for y, else in that of the axis in the next panel.

    A title may begin with its unit, as that of a colour scale.
    """
    own = label(layout, trace, letter, aligned=False)
    if not own and letter == "y" and not _is_map(trace):
        own = panel(layout, trace)
    text = own if "[" in own else label(layout, trace, letter)
    leading = LEADING.search(text)
    return leading[1] if leading else unit_in(text)


def _is_map(trace: Object) -> bool:
    return trace.get("type") in ("heatmap", "contour")


def _trace(layout: Object, trace: Object, factors: dict[str, float]) -> Object:
    made = dict(trace)
    scene = layout.get(trace.get("scene", "scene"), {})
    for letter in "xyz" if _in_space(trace) else "xy":
        unit = unit_in(title(scene.get(f"{letter}axis", {}))) if _in_space(trace) else None
        factor = imperial(unit)[1] if unit else None if _in_space(trace) else factors.get(axis_of(trace, letter))
        along = (trace.get("orientation") == "h") == (letter == "x") and not _in_space(trace)
        for name in (letter, *(("base",) if along else ())):
            if factor and name in made:
                made[name] = _times(made[name], factor)
    bar = colour_bar(layout, trace)
    unit = _bar_unit(bar) or (unit_in(panel(layout, trace)) if _is_map(trace) else None)
    if not unit or (trace.get("hoverinfo") == "skip" and _is_map(trace)):
        return made
    factor, powers = imperial(unit)[1], logarithmic(bar)
    name = "surfacecolor" if "surfacecolor" in made else "z"
    if name in made:
        made[name] = _times(made[name], factor, powers)
    if "customdata" in made and _is_map(trace):
        made["customdata"] = _times(made["customdata"], factor)
    limits = [limit for limit in ("zmin", "zmax", "cmin", "cmax") if made.get(limit) is not None]
    return made | {limit: _shifted(made[limit], factor, powers) for limit in limits}


def _bar_unit(bar: Object) -> str | None:
    found = LEADING.search(title(bar))
    return found[1] if found else None


def _times(values: Any, factor: float, powers: bool = False) -> Any:
    """Values of a trace times a factor; of categories those that are bare numbers, in the unit of their axis."""
    array = numbers(values)
    if array is not None and array.dtype.kind not in "OU":
        return _rounded(array + log10(factor) if powers else array * factor)
    if isinstance(values, list):
        return [_times(one, factor) if isinstance(one, (list, str)) else one for one in values]
    return scaled(values, factor) if isinstance(values, str) and re.fullmatch(NUMBER, values) else values


def _rounded(values: np.ndarray) -> Any:
    if values.ndim > 1:
        return [_rounded(row) for row in values]
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in values]


def _shifted(value: float, factor: float, powers: bool) -> float:
    return value + log10(factor) if powers else value * factor


def _axis(axis: Object, factor: float) -> Object:
    made, powers = dict(axis), axis.get("type") == "log"
    if made.get("range"):
        made["range"] = [None if v is None else _shifted(v, factor, powers) for v in made["range"]]
    if isinstance(made.get("tickvals"), (list, dict)):
        made["tickvals"] = _times(made["tickvals"], factor)
    if isinstance(made.get("dtick"), (int, float)) and not powers:
        del made["dtick"]
    return made


def _colour_axis(axis: Object) -> Object:
    bar = axis.get("colorbar", {})
    unit = _bar_unit(bar)
    if not unit:
        return axis
    factor, powers = imperial(unit)[1], logarithmic(bar)
    made = axis | {k: _shifted(axis[k], factor, powers) for k in ("cmin", "cmax") if axis.get(k) is not None}
    if powers:
        ticks = [float(t) for t in range(int(np.ceil(made["cmin"])), int(np.floor(made["cmax"])) + 1)]
        made["colorbar"] = bar | {"tickvals": ticks, "ticktext": [f"{10.0**t:g}" for t in ticks]}
    return made


def _placed(one: Object, factors: dict[str, float]) -> Object:
    """A shape or note whose place is in the units of axes."""
    made = dict(one)
    for letter in "xy":
        factor = factors.get(axis_name(one.get(f"{letter}ref", letter)))
        for name in (letter, f"{letter}0", f"{letter}1"):
            if factor and isinstance(made.get(name), (int, float)):
                made[name] *= factor
    return made


def _texts(value: Any, key: str = "") -> Any:
    """The same structure with texts whose units, in brackets, behind placeholders or at the beginning, are imperial."""
    if isinstance(value, dict):
        return {name: _texts(one, name) for name, one in value.items()}
    if isinstance(value, list):
        return (
            [_texts(one, key) for one in value] if key in TEXTS or isinstance(next(iter(value), None), dict) else value
        )
    if not isinstance(value, str) or key not in TEXTS or re.fullmatch(r"[\d.]*", value):
        return value
    placed = PLACED.sub(lambda at: f"{at[1]}{imperial(at[2])[0]}", imperial_label(value))
    return LEADING.sub(lambda at: imperial(at[1])[0], placed)
