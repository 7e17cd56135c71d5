"""Look of all pages: the unit in which a number is shown, colours and style of figures, axes of phase lags.

Results are computed and stored in SI. A number with a unit becomes a text once, by `quantity`, in the system of units
of the page that is being made (`unit_system`); columns and axes state their unit in the brackets of their label, and
`label` and `in_shown_units` turn label and numbers together. Nothing else is touched: the name of a machine, a sentence
of somebody else or an acceleration in g stay as they are. Numbers keep their count of significant digits.

Colours are safe for colour-blind readers (Okabe and Ito).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_UM

SYSTEMS = ("metric", "imperial")
_INCH, _LBF, _PSI = 25.4e-3, 4.4482216152605, 6894.757293168361
_OUNCE, _SCF = 28.349523125e-3, 28.316846592 * 273.15 / 288.7055555555556
"""Ounce [g], and a standard cubic foot (60 degF) in normal litres (0 degC)."""
IMPERIAL: dict[str, tuple[str, float]] = {
    "µm/V": ("mil/V", 1 / 25.4),
    "µm/N": ("mil/lbf", _LBF / 25.4),
    "V/µm": ("V/mil", 25.4),
    "V/N": ("V/lbf", _LBF),
    "µm": ("mil", 1 / 25.4),
    "mm": ("in", 1e-3 / _INCH),
    "MPa": ("psi", 1e6 / _PSI),
    "kPa": ("psi", 1e3 / _PSI),
    "kN s/m": ("lbf s/in", 1e3 * _INCH / _LBF),
    "MN/m": ("klbf/in", 1e6 * _INCH / _LBF / 1e3),
    "N/m": ("lbf/in", _INCH / _LBF),
    "N m": ("lbf in", 1 / (_LBF * _INCH)),
    "N": ("lbf", 1 / _LBF),
    "mg/s": ("lb/h", 1e-6 * 3600 / 0.45359237),
    "Nl/min": ("scfm", 1 / _SCF),
    "normal litres per minute": ("standard cubic feet per minute", 1 / _SCF),
    "g mm": ("oz in", 1e-6 / (_OUNCE * _INCH)),
    "g": ("oz", 1e-3 / _OUNCE),
}
"""Imperial unit of each metric unit of pages, and how many of it are one metric unit."""
_SYSTEM: ContextVar[str] = ContextVar("unit_system", default="metric")
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_LABELLED = "|".join(
    re.escape(unit).replace("µ", "[µu]").replace(r"g\ mm", "g[ *]mm")
    for unit in sorted(IMPERIAL, key=len, reverse=True)
    if unit != "g"
)
_END = r"(?![\w/]|\*\w| s/m| m\b)"
BRACKETED = re.compile(rf"\[({_LABELLED}){_END}")
"""Unit in the brackets of a label; never g, which there is an acceleration."""
PLACED = re.compile(rf"(%\{{[^}}]*\}} )({_LABELLED}){_END}")
"""Unit behind a placeholder of the text that a figure shows at a point."""
LEADING = re.compile(rf"^({_LABELLED}){_END}")
"""Unit with which the title of a colour scale begins."""


def check_units(units: str) -> None:
    """Raise DataError for a system of units that is not known."""
    if units not in SYSTEMS:
        raise DataError(f"units: '{units}' is not known; {did_you_mean(units, SYSTEMS)}", argument="units", value=units)


@contextmanager
def unit_system(units: str) -> Iterator[None]:
    """Within, pages are made in "metric" or "imperial" units; raises DataError for another system."""
    check_units(units)
    token = _SYSTEM.set(units)
    try:
        yield
    finally:
        _SYSTEM.reset(token)


@contextmanager
def page_system(units: str) -> Iterator[None]:
    """Within, a page is made in imperial units where they are asked for, else in those of the surroundings."""
    with nullcontext() if units == "metric" else unit_system(units):
        yield


def use_units(units: str) -> None:
    """Make pages in "metric" or "imperial" units from here on; raises DataError for another system."""
    check_units(units)
    _SYSTEM.set(units)


def is_imperial() -> bool:
    """True while a page is made in imperial units."""
    return _SYSTEM.get() == "imperial"


def imperial(unit: str) -> tuple[str, float]:
    """Imperial unit of a metric one, and how many of it are one metric unit."""
    return IMPERIAL[unit.replace("um", "µm").replace("*", " ")]


def quantity(value: float, unit: str, form: str = ".3g") -> str:
    """A number of a metric unit as a text with its unit, in the units of the page."""
    return f"{number(value, unit, form)} {unit_name(unit)}"


def displacement(value: float, form: str = ".3g") -> str:
    """A displacement [m] as a text in micrometres or mils."""
    return quantity(value * TO_UM, "µm", form)


def number(value: float, unit: str, form: str = ".3g") -> str:
    """A number of a metric unit as a text without its unit, in the units of the page."""
    text = format(value, form)
    known = is_imperial() and unit.replace("um", "µm").replace("*", " ") in IMPERIAL
    return scaled(text, imperial(unit)[1]) if known and re.fullmatch(NUMBER, text) else text


def unit_name(unit: str) -> str:
    """Name of a metric unit in the units of the page."""
    name = unit.replace("um", "µm")
    return imperial(name)[0] if is_imperial() and name.replace("*", " ") in IMPERIAL else name


def unit_in(text: str) -> str | None:
    """Metric unit in the brackets of a label."""
    found = BRACKETED.search(text)
    return found[1] if found else None


def label(text: str) -> str:
    """A label of a column or an axis with the unit in its brackets in the units of the page."""
    return imperial_label(text) if is_imperial() else text


def imperial_label(text: str) -> str:
    """A label with the unit in its brackets as an imperial one."""
    return BRACKETED.sub(lambda at: f"[{imperial(at[1])[0]}", text)


def in_shown_units(text: str, unit: str | None) -> str:
    """A number as a text, below a label that states a metric unit, in the units of the page; another text stays."""
    wanted = unit is not None and is_imperial() and re.fullmatch(NUMBER, text)
    return scaled(text, imperial(str(unit))[1]) if wanted else text


def scaled(text: str, factor: float) -> str:
    """A number times a factor, with as many significant digits, at least three."""
    digits = re.sub(r"e.*", "", text.lower()).lstrip("+-0.").replace(".", "")
    return f"{float(text) * factor:.{max(3, len(digits))}g}"


def micrometres(text: str) -> str:
    """A text with the sign µm for the unit that terminals and files write as um."""
    return re.sub(r"(?<=[\d\[( ])um\b", "µm", text)


AXIS_COLOURS = {"x": "#0072B2", "y": "#D55E00"}
NEUTRAL, INK, GRID = "#009E73", "#24303c", "#e4e8ec"
PIN_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"
SPECTRUM_SCALE = [[0, "#ffffff"], [0.2, "#dbe9f4"], [0.45, "#8fbfdf"], [0.7, "#2f79b5"], [1, "#08264d"]]
"""Lightness falls steadily, so the scale also works in grey."""
TITLE = 34
"""Room [px] between plot and legend for the titles of the columns."""
PRESSURE_SCALE = [[0, "#fff9ec"], [0.25, "#fdd49e"], [0.5, "#f79a5e"], [0.75, "#d1422f"], [1, "#67000d"]]


def faint(colour: str, opacity: float = 0.25) -> str:
    """A '#rrggbb' colour as rgba with an opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def style(figure: go.Figure, height: int, **layout: object) -> go.Figure:
    """Give a figure the common look and a height in px; returns it."""
    titled = any(a.yref in ("paper", "y domain") and (a.y or 0) > 0.99 for a in figure.layout.annotations)
    top, bottom, gap = (30, 55, TITLE) if titled else (14, 55, 6)
    figure.update_layout(
        height=height,
        font={"family": FONT, "size": 13, "color": INK},
        paper_bgcolor="white",
        plot_bgcolor="white",
        margin={"l": 70, "r": 30, "t": top, "b": bottom},
        # in coordinates of the plot: plotly then makes room above it for as many lines as the legend takes
        legend={"orientation": "h", "x": 0, "xanchor": "left", "y": 1 + gap / (height - top - bottom),
                "yanchor": "bottom", "yref": "paper"},
        hoverlabel={"font": {"family": FONT}},
        **layout,
    )  # fmt: skip
    look = {"showline": True, "linecolor": "#8a949e", "gridcolor": GRID, "zeroline": False, "ticks": "outside",
            "tickcolor": "#8a949e", "ticklen": 4, "title": {"standoff": 8},
            # no prefixes of SI next to the unit in the title: 20000 rpm, 0.0002 um
            "exponentformat": "power", "minexponent": 6}  # fmt: skip
    figure.update_xaxes(**look)
    figure.update_yaxes(**look)
    figure.update_annotations(font={"size": 14, "color": INK})
    return figure


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
    lag, seen = np.full(a.size, np.nan), np.abs(a) > max(FAINTEST * np.abs(a).max(initial=0.0), least)
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
