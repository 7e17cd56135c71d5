"""Figure of the unbalance response of a machine: amplitude and phase over speed at its measuring places."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.report.figures.theme import PIN_COLOURS, compact, style


def response_figure(found: xr.Dataset, places: tuple[str, ...] | None = None) -> go.Figure:
    """Major half axis and phase lag of x over speed at `places`; all that move apart without them.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.unbalance_response(plant, [200.0, 300.0, 400.0], 0.5e6)
    >>> figure = rs.report.response_figure(found)
    """
    chosen = list(places or distinct(found))
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06)
    speed = compact(found["speed"].values * TO_RPM, 6)
    for k, place in enumerate(chosen):
        one = found.sel(place=place)
        x = one["response_re"].sel(axis="x").values + 1j * one["response_im"].sel(axis="x").values
        lag = -np.degrees(np.unwrap(np.angle(x)))
        lag -= 360 * np.round(np.nanmin(lag) / 360) if np.isfinite(lag).any() else 0.0
        common = {"x": speed, "mode": "lines", "name": place, "legendgroup": place,
                  "line": {"color": PIN_COLOURS[k % len(PIN_COLOURS)], "width": 2}}  # fmt: skip
        figure.add_trace(go.Scatter(y=compact(one["major"].values * TO_UM), **common), 1, 1)
        figure.add_trace(go.Scatter(y=compact(lag), showlegend=False, **common), 2, 1)
    figure.update_yaxes(title_text="major half axis [µm 0-pk]", rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title_text="phase lag of x [deg]", dtick=90, autorange="reversed", row=2, col=1)
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return style(figure, 560)


def distinct(found: xr.Dataset) -> list[str]:
    """Places of different positions; the first name of those at one position."""
    names: dict[float, str] = {}
    for place, z in zip(found["place"].values, found["z"].values, strict=True):
        names.setdefault(round(float(z), 6), str(place))
    return list(names.values())
