"""Page of a report: blocks of text, tables and figures, in the units of its reader as plain data, HTML and files.

A chapter of `rotorsim.report` makes a `Page` of a result. `write_page` has it made in one system of units and turns
it into plain data once (`plain_page`): the HTML file, its figures and the tables next to it are forms of these data.

All figures have one style, with colours that are safe for colour-blind readers (Okabe and Ito).
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment, StrictUndefined, Template
from plotly.offline import get_plotlyjs

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_text
from rotorsim.base.input_files import parse_toml
from rotorsim.base.public import Registry
from rotorsim.base.rounding import DAMPED
from rotorsim.report.figure_files import BEGIN, END, check_kind, imperial_figure, write_figures
from rotorsim.report.units import check_units, in_shown_units, is_imperial, label, micrometres, page_system, unit_in

AXIS_COLOURS = {"x": "#0072B2", "y": "#D55E00"}
NEUTRAL, INK, GRID = "#009E73", "#24303c", "#e4e8ec"
UNSAFE = "#7a3b3b"
PIN_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"
SPECTRUM_SCALE = [[0, "#ffffff"], [0.2, "#dbe9f4"], [0.45, "#8fbfdf"], [0.7, "#2f79b5"], [1, "#08264d"]]
"""Lightness falls steadily, so the scale also works in grey."""
AXIS_LOOK = {
    "showline": True, "linecolor": "#8a949e", "gridcolor": GRID, "zeroline": False, "ticks": "outside",
    "tickcolor": "#8a949e", "ticklen": 4, "title": {"standoff": 8},
    "exponentformat": "power", "minexponent": 6,  # no prefixes of SI next to the unit: 20000 rpm, 0.0002 um
}  # fmt: skip
TITLE = 34
"""Room [px] between plot and legend for the titles of the columns."""
PRESSURE_SCALE = [[0, "#fff9ec"], [0.25, "#fdd49e"], [0.5, "#f79a5e"], [0.75, "#d1422f"], [1, "#67000d"]]


def faint(colour: str, opacity: float = 0.25) -> str:
    """A '#rrggbb' colour as rgba with an opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def shade_growth(figure: go.Figure, speed: np.ndarray, zeta: np.ndarray, rows: int) -> None:
    """Shade where a mode grows in panels one above another, over speeds (n,) with the least damping ratio at each.

    An edge lies where the damping ratio passes 0 on a straight line between two speeds, or where the film is lost.
    """
    places = np.flatnonzero(zeta < -DAMPED)
    for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if places.size else ():
        ends = [_zero(speed, zeta, i, j) for i, j in ((run[0], run[0] - 1), (run[-1], run[-1] + 1))]
        for row in range(1, rows + 1):
            figure.add_vrect(*ends, row=row, col=1, fillcolor=UNSAFE, opacity=0.14, line={"width": 0},
                             layer="below")  # fmt: skip


def _zero(x: np.ndarray, y: np.ndarray, i: int, j: int) -> float:
    """Place between i and its neighbour j at which y passes 0 on a straight line; that of i where y is unknown at j."""
    known = 0 <= j < len(y) and np.isfinite(y[j])
    share = min(y[i] / (y[i] - y[j]), 1.0) if known and y[i] != y[j] else 0.0
    return float(x[i] + share * (x[j] - x[i]) if share else x[i])


def style(figure: go.Figure, height: int, **layout: object) -> go.Figure:
    """Give a figure the common look and a height in px; returns it.

    The look goes into plotly's plain data at once: updates of single properties take five times as long.
    """
    titled = any(a.yref in ("paper", "y domain") and (a.y or 0) > 0.99 for a in figure.layout.annotations)
    top, bottom, gap = (30, 55, TITLE) if titled else (14, 55, 6)
    axes = [axis.plotly_name for select in (figure.select_xaxes, figure.select_yaxes) for axis in select()]
    look = {
        "height": height,
        "font": {"family": FONT, "size": 13, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": 70, "r": 30, "t": top, "b": bottom},
        # in coordinates of the plot: plotly then makes room above it for as many lines as the legend takes
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1 + gap / (height - top - bottom),
                   "yanchor": "bottom", "yref": "paper"},
        "hoverlabel": {"font": {"family": FONT}},
    } | dict.fromkeys(axes, AXIS_LOOK)  # fmt: skip
    figure.update_layout(layout)
    plain = figure.layout.to_plotly_json()
    _merge(plain, look)
    for note in plain.get("annotations", ()):
        _merge(note, {"font": {"size": 14, "color": INK}})
    figure.layout = plain
    return figure


def _merge(plain: dict[str, Any], more: Mapping[str, Any]) -> None:
    """Put values into nested tables."""
    for key, value in more.items():
        if isinstance(value, Mapping):
            _merge(plain.setdefault(key, {}), value)
        else:
            plain[key] = value


def compact(values: np.ndarray, digits: int = 5) -> np.ndarray:
    """Values rounded to significant digits as float32: what a screen can show, in half the bytes."""
    values = np.asarray(values, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 10.0 ** (digits - 1 - np.floor(np.log10(np.abs(values))))
        rounded = np.round(values * scale) / scale
    return np.where(np.isfinite(rounded), rounded, values).astype(np.float32)


def curve(x: np.ndarray, y: np.ndarray, colour: str = INK, name: str | None = None, width: float | None = None,
          dash: str | None = None, digits: int = 5, mode: str | None = "lines", **more: Any) -> go.Scatter:  # fmt: skip
    """Curve of compact numbers, `digits` of x; `more` are further arguments of plotly's Scatter."""
    line = {"color": colour, "width": width, "dash": dash}
    return go.Scatter(x=compact(x, digits), y=compact(y), mode=mode, name=name, line=line, **more)


MOST_TURNING = 400.0
"""Range [deg] over which a phase is drawn without wrapping."""
FAINTEST = 1e-3
"""Phase is not drawn where the amplitude is below this share of its largest value, or of that of all orders."""
MOST_TICKED = 1080.0
"""Range [deg] up to which there is a tick every 90 deg."""


def phase_lag(a: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Continuous phase lag [deg] of complex amplitudes, its median in [-90, 270); NaN where |a| is below `least`.

    Wrapped to [-90, 270), with gaps where it wraps, if it turns by more than modes of one order do: beats of a free
    vibration with the order would otherwise carry it off.
    """
    size = np.nan_to_num(np.abs(a))
    lag, seen = np.full(a.size, np.nan), size > max(FAINTEST * size.max(initial=0.0), least)
    if not seen.any():
        return lag
    lag[seen] = -np.degrees(np.unwrap(np.angle(a[seen])))
    lag -= 360 * np.floor((np.nanmedian(lag) + 90) / 360)
    if np.nanmax(lag) - np.nanmin(lag) < MOST_TURNING:
        return lag
    lag = wrapped(lag)
    lag[1:][np.abs(np.diff(lag)) > 180] = np.nan
    return lag


def next_to(lag: np.ndarray, speed: np.ndarray, first: np.ndarray, of_first: np.ndarray) -> np.ndarray:
    """Phase lags [deg] moved by the whole turns that bring them nearest those of a first run over common speeds.

    `lag` and `speed` are (n,), NaN where there is no lag; `first` and `of_first` (m,) those of the first run.
    """
    seen = np.isfinite(first)
    if not seen.any():
        return lag
    order = np.argsort(of_first[seen])
    at, values = of_first[seen][order], first[seen][order]
    common = np.isfinite(lag) & (speed >= at[0]) & (speed <= at[-1])
    if not common.any():
        return lag
    apart = np.median(lag[common] - np.interp(speed[common], at, values))
    return np.asarray(lag - 360 * np.round(apart / 360))


def wrapped(lag: np.ndarray) -> np.ndarray:
    """Phase lags [deg] in [-90, 270)."""
    return (lag + 90) % 360 - 90


def phase_axes(figure: go.Figure, row: int, what: str = "phase lag") -> None:
    """Title in the first column, lags downwards, ticks every 90 deg where they have room."""
    figure.update_yaxes(autorange="reversed", row=row)
    figure.update_yaxes(title_text=f"{what} [deg]", row=row, col=1)
    names = {(axis.plotly_name or "").replace("axis", "") for axis in figure.select_yaxes(row=row)}
    lags = [np.asarray(trace.y, float) for trace in figure.data if (trace.yaxis or "y") in names and len(trace.y)]
    if max(map(_range, lags), default=0.0) <= MOST_TICKED:
        figure.update_yaxes(dtick=90, row=row)


def _range(lag: np.ndarray) -> float:
    seen = lag[np.isfinite(lag)]
    return float(np.ptp(seen)) if seen.size else 0.0


Plain = dict[str, Any]
Maker = TypeVar("Maker", bound=Callable[[Any], "Page"])


@dataclass(frozen=True)
class Block:
    """A section: title, sentence, figure and table, then further sentences; all texts are plain.

    Without heads the first column of the table names its rows. `legend` explains colours of the figure, `code` is text
    of fixed width, `link` a sentence that leads to the block with this anchor. A folded block shows its title alone
    until it is opened; without `tools` its figure has no toolbar.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.Block("Modes", "Natural frequencies.", heads=("speed", "wn"), rows=[(100.0, 630.0)]).title
    'Modes'
    """

    title: str
    text: str = ""
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    figure: go.Figure | None = None
    legend: Sequence[tuple[str, str]] = ()
    texts: Sequence[str] = ()
    code: str = ""
    link: tuple[str, str] | None = None
    anchor: str = ""
    folded: bool = False
    tools: bool = True


@dataclass(frozen=True)
class Page:
    """Heading, introduction, warnings, key numbers with their names, and blocks; a row of blocks is side by side.

    The window of the browser has the name `title`, by default the heading.
    """

    heading: str
    introduction: str
    blocks: Sequence[Block | Sequence[Block]]
    numbers: Sequence[tuple[str, str]] = ()
    warnings: Sequence[str] = ()
    title: str = ""


RESULT_PAGES = Registry[tuple[type, Callable[[Any], Page]]](
    {name: f"rotorsim.report.{chapter}" for name, chapter in {
        "Dataset": "record", "Diagnosis": "diagnosis", "Verification": "control", "SweepResult": "sweep",
        "map": "operating_map", "DesignReview": "design", "RandomResult": "random", "Optimisation": "random",
        "campbell": "linear", "response": "linear", "dict": "comparison",
        "RunComparison": "comparison", "Assessment": "comparison",
    }.items()}
)  # fmt: skip
"""Types of results with the makers of their pages, by the name of the type; datasets by their attribute `kind` too."""


def page_of(kind: type, name: str = "") -> Callable[[Maker], Maker]:
    """Decorator that registers the maker of the page of a type of result, for `rotorsim.report.write`."""

    def register(make: Maker) -> Maker:
        RESULT_PAGES[name or kind.__name__] = kind, make
        return make

    return register


def machine_entry(attrs: Mapping[Any, Any], entry: str = "name", missing: str = "Unnamed machine") -> str:
    """Name of the machine whose file is in the attributes of a result, or another entry, as far as it can be read."""
    try:
        return str(parse_toml(str(attrs.get("machine", ""))).get(entry, missing))
    except tomllib.TOMLDecodeError:
        return missing


def plain_page(page: Page) -> Plain:
    """The page in the current units: texts, rows of texts and figures (`data` and `layout` of plotly) as for JSON."""
    rows = [[block] if isinstance(block, Block) else list(block) for block in page.blocks]
    return {
        "title": page.title or page.heading, "heading": page.heading, "introduction": page.introduction,
        "warnings": [micrometres(text) for text in page.warnings],
        "numbers": [[micrometres(number), micrometres(name)] for number, name in page.numbers],
        "rows": [[_plain_block(block) for block in row] for row in rows],
    }  # fmt: skip


def _plain_block(block: Block) -> Plain:
    units = [unit_in(head) for head in block.heads]
    return {
        "title": micrometres(block.title), "text": micrometres(block.text),
        "texts": [micrometres(text) for text in block.texts],
        "heads": [micrometres(label(head)) for head in block.heads], "rows": [cells(row, units) for row in block.rows],
        "code": block.code,
        "legend": [[micrometres(text), colour] for text, colour in block.legend], "link": block.link,
        "anchor": block.anchor, "folded": block.folded, "figure": None if block.figure is None else _figure(block),
    }  # fmt: skip


def cells(row: Sequence[Any], units: Sequence[str | None] = ()) -> list[str]:
    """Cells as texts, below heads with these metric units; a row of another length has none."""
    texts = ["-" if v is None else _number(v) if isinstance(v, float) else str(v) for v in row]
    own = units if len(units) == len(texts) else [None] * len(texts)
    return [micrometres(in_shown_units(text, unit)) for text, unit in zip(texts, own, strict=True)]


def _number(value: float) -> str:
    """A number of four digits, of more where it is a whole one below a million: 22235 is no 2.224e+04."""
    if not isfinite(value):
        return "-"
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e6 else f"{value:.4g}"


def _figure(block: Block) -> Plain:
    made = json.loads(str(block.figure.to_json()))  # type: ignore[union-attr]
    shown = imperial_figure(made) if is_imperial() else made
    return {
        "title": micrometres(block.title) or "figure",
        "tools": block.tools,
        "data": shown["data"],
        "layout": shown["layout"],
    }


def figures(shown: Plain) -> list[Plain]:
    """Figures of a plain page in order, each with the title of its block."""
    return [block["figure"] for row in shown["rows"] for block in row if block["figure"]]


@cache
def _template() -> Template:
    style, text = (files(__package__).joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.html"))
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.globals["style"] = style
    return environment.from_string(text)


def html(page: Page) -> str:
    """The page in the current units as an HTML file that loads nothing from elsewhere."""
    return _html(plain_page(page))


def _html(shown: Plain) -> str:
    drawn = json.dumps(figures(shown), ensure_ascii=False).replace("<", "\\u003c")
    return _template().render(page=shown, plotly=get_plotlyjs(), figures=f"{BEGIN}{drawn}{END}")


def check_wanted(units: str, figures: str | None) -> None:
    """Raise DataError for units or a kind of figure files that are not known, and where no figure can be drawn."""
    check_units(units)
    if figures is not None:
        check_kind(figures)


def write_page(
    make: Callable[[], Page], path: str | Path, units: str = "metric", figures_as: str | None = None
) -> Path:
    """Make a page, write it, complete or not at all, then its figures; return its path.

    `units` are "metric" or "imperial"; `figures_as` "png", "svg" or "csv", None for no files. Raises DataError for
    others, WriteError for a path that cannot be written.
    """
    check_wanted(units, figures_as)
    path = Path(path)
    with page_system(units):
        shown = plain_page(make())
    write_text(path, _html(shown))
    if figures_as is not None:
        write_figures(path, figures(shown), figures_as)
    return path


def write(result: Any, path: str | Path, units: str = "metric", figures: str | None = None) -> Path:
    """Write the HTML report of a result or a record, complete or not at all.

    A result is a diagnosis, a verification, a sweep, a comparison of runs, a balancing, a dataset of `campbell`,
    `unbalance_response` or `map_machine`, or a dictionary of such datasets of one kind, which are compared.

    `units` are "metric" or "imperial"; with `figures` "png", "svg" or "csv" every figure is a file too. Raises
    DataError for others and for any other type, WriteError for a path that cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.write(record, "page.html").name
    'page.html'
    """
    attrs = getattr(result, "attrs", None)
    names = [str(attrs.get("kind"))] if isinstance(attrs, Mapping) else []
    names += [kind.__name__ for kind in type(result).__mro__]
    made = (RESULT_PAGES[name] for name in names if name in RESULT_PAGES)
    make = next((make for kind, make in made if isinstance(result, kind)), None)
    if make is None:
        given = type(result).__name__
        raise DataError(
            f"report: {given} is not a Diagnosis, another result or a record; for a file use write_report",
            argument="report",
            value=given,
        )
    return write_page(lambda: make(result), path, units, figures)


def save_study_page(title: str, description: str, blocks: Sequence[Block], path: str | Path, units: str = "metric",
                    figures: str | None = None) -> None:  # fmt: skip
    """Write a page of blocks, complete or not at all; raises WriteError.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> table = rs.report.Block("Modes", heads=("speed", "wn"), rows=[(100.0, 630.0)])
    >>> rs.report.save_study_page("Study", "Modes of a rotor.", [table], Path("study.html"))
    """
    write_page(lambda: Page(title, description, blocks), path, units, figures)
