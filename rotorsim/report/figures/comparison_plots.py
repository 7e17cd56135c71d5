"""Figures that lay results of several machines over each other: unbalance response, Campbell diagram, map."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.base.errors import DataError
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures.phase import next_to, phase_axes, phase_lag
from rotorsim.report.figures.theme import INK, PIN_COLOURS, compact, style

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
Results = Mapping[str, xr.Dataset]


def compare_results(results: Results) -> go.Figure:
    """Results of one kind by name in one figure: of `unbalance_response`, of `campbell` or of `map_machine`.

    Responses are those of the measuring plane, of maps the least damping ratio over the speed at each pressure.

    Raises
    ------
    DataError
        If they are of no such kind, or of several.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> figure = rs.report.compare_results({"before": found, "after": found})
    """
    return FIGURES[common_kind(results)](results)


def common_kind(results: Results) -> str:
    """The kind of all results; raises DataError if they have none or several."""
    kinds = {name: str(found.attrs.get("kind", "record")) for name, found in results.items()}
    for name, kind in kinds.items():
        if kind not in FIGURES:
            raise DataError(f"{name}: is a {kind}; give results of one kind: {', '.join(FIGURES)}, or records only")
    (first, kind), *others = kinds.items()
    for name, other in others:
        if other != kind:
            raise DataError(f"{name}: is a {other} and {first} a {kind}; give results of one kind")
    return kind


def line_look(number: int) -> dict[str, Any]:
    """Line of a run or result by its number: colour and dashes."""
    return {"color": PIN_COLOURS[number % len(PIN_COLOURS)], "width": 2, "dash": DASHES[number % len(DASHES)]}


def _responses(results: Results) -> go.Figure:
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06)
    first: tuple[np.ndarray, np.ndarray] | None = None
    for number, (name, found) in enumerate(results.items()):
        one = found.isel(place=0)
        x = one["response_re"].sel(axis="x").values + 1j * one["response_im"].sel(axis="x").values
        speed, lag = found["speed"].values, phase_lag(np.nan_to_num(x))
        first = first or (lag, speed)
        common = {"x": compact(speed * TO_RPM, 6), "mode": "lines", "name": name, "legendgroup": name,
                  "line": line_look(number)}  # fmt: skip
        figure.add_trace(go.Scatter(y=compact(one["major"].values * TO_UM), **common), 1, 1)
        figure.add_trace(go.Scatter(y=compact(next_to(lag, speed, *first)), showlegend=False, **common), 2, 1)
    figure.update_yaxes(title_text="major half axis [µm 0-pk]", rangemode="tozero", row=1, col=1)
    phase_axes(figure, 2, "phase lag of x")
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return style(figure, 560)


def _campbells(results: Results) -> go.Figure:
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.05)
    for number, (name, found) in enumerate(results.items()):
        speed = compact(found["speed"].values * TO_RPM, 6)
        for k in range(found.sizes["branch"]):
            one = found.isel(branch=k)
            common = {"x": speed, "mode": "lines", "name": name, "legendgroup": name, "line": line_look(number)}
            figure.add_trace(go.Scatter(y=compact(one["wn"].values * TO_HZ), showlegend=k == 0, **common), 1, 1)
            figure.add_trace(go.Scatter(y=compact(one["log_dec"].values), showlegend=False, **common), 2, 1)
    longest = max(results.values(), key=lambda found: float(found["speed"].max()))["speed"].values
    line = {"color": INK, "width": 1, "dash": "dash"}
    figure.add_trace(go.Scatter(x=compact(longest * TO_RPM, 6), y=compact(longest * TO_HZ), mode="lines", name="1X",
                                hoverinfo="skip", line=line), 1, 1)  # fmt: skip
    top = max(float(np.nanmax(found["wn"].values)) for found in results.values()) * TO_HZ
    figure.update_yaxes(title_text="natural frequency [Hz]", range=[0, 1.05 * top], row=1, col=1)
    figure.update_yaxes(title_text="log. decrement", row=2, col=1)
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return style(figure, 640)


def _maps(results: Results) -> go.Figure:
    pressures = sorted({round(float(p), 3) for found in results.values() for p in found["pressure"].values})
    figure = go.Figure()
    for number, (name, found) in enumerate(results.items()):
        speed = compact(found["speed"].values * TO_RPM, 6)
        for one in (found.isel(pressure=k) for k in range(found.sizes["pressure"])):
            at = pressures.index(round(float(one["pressure"]), 3))
            figure.add_scatter(
                x=speed, y=compact(one["zeta_least"].values), mode="lines+markers", legendgroup=name,
                name=f"{name}, {quantity(float(one['pressure']) * TO_MPA, 'MPa')}",
                line={"color": PIN_COLOURS[number % len(PIN_COLOURS)], "width": 2, "dash": DASHES[at % len(DASHES)]},
            )  # fmt: skip
    figure.add_hline(y=0, line={"color": INK, "width": 1})
    figure.update_xaxes(title_text="speed [rpm]")
    figure.update_yaxes(title_text="least damping ratio")
    return style(figure, 480)


FIGURES: dict[str, Callable[[Results], go.Figure]] = {"response": _responses, "campbell": _campbells, "map": _maps}
"""Figure of the results of each kind."""
