"""Common style of all figures, colours safe for colour-blind readers (Okabe and Ito), and the axes of phase lags."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

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
