"""Phase lags: the one way in which figures draw the phase of a synchronous vibration."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

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

    Parameters
    ----------
    lag, speed : arrays (n,)
        Phase lags [deg], NaN where there is none, and their speeds.
    first, of_first : arrays (m,)
        Those of the first run.
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
