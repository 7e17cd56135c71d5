"""Linear analyses over speed: Campbell diagram, critical speeds, unbalance response, sag; figures and pages."""

from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.analysis.campbell import critical_rows, modes_line, searched_line
from rotorsim.analysis.shaft_motion import ENDS, peak_of
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.report.page import (
    INK,
    PIN_COLOURS,
    Block,
    Page,
    compact,
    curve,
    machine_entry,
    page_of,
    phase_axes,
    phase_lag,
    shade_growth,
    style,
)
from rotorsim.report.units import quantity

SYMBOLS = {"forward": "triangle-up", "backward": "triangle-down", "mixed": "circle", "": "circle"}
UNDAMPED = "undamped_critical_speed"
"""Variable of undamped critical speeds [rad/s] over the bearings' stiffness, in a result with a critical speed map."""
ROWS = 60
"""Rows of a table, at most."""


def _need(found: xr.Dataset, figure: str, *names: str) -> None:
    """Raise DataError unless this is the dataset of the result that the figure shows."""
    missing = [name for name in names if name not in getattr(found, "variables", ())]
    if missing:
        raise DataError(f"{figure}: there is no '{missing[0]}'; give the .dataset() of the fe_shaft result")


def shaft_campbell(found: xr.Dataset) -> go.Figure:
    """Natural frequencies and logarithmic decrements over speed; triangles up whirl forward, down backward.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.shaft_campbell(rotor.run_campbell([0.0, 100.0, 200.0]).dataset())
    """
    _need(found, "shaft_campbell", "speed", "wn", "log_dec", "whirl")
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.05)
    speed = found["speed"].values * TO_RPM
    for k in range(found.sizes["branch"]):
        one = found.isel(branch=k)
        marks = [SYMBOLS[str(sense)] for sense in one["whirl"].values]
        colour = PIN_COLOURS[k % len(PIN_COLOURS)]
        for row, name, scale in ((1, "wn", TO_HZ), (2, "log_dec", 1.0)):
            figure.add_trace(curve(speed, one[name].values * scale, colour, f"mode {k + 1}",
                                   dash="solid" if k < len(PIN_COLOURS) else "dot", mode="lines+markers",
                                   legendgroup=str(k), showlegend=row == 1,
                                   marker={"symbol": marks, "size": 6}), row, 1)  # fmt: skip
    figure.add_trace(curve(speed, np.abs(speed) / 60, INK, "1X", 1, "dash", hoverinfo="skip"), 1, 1)
    if "zeta_least" in found:
        shade_growth(figure, speed, found["zeta_least"].values, rows=2)
    _add_criticals(figure, found)
    top = float(np.nanmax(found["wn"].values)) * TO_HZ
    figure.update_yaxes(title_text="natural frequency [Hz]", range=[0, 1.05 * top], row=1, col=1)
    figure.update_yaxes(title_text="log. decrement", row=2, col=1)
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return style(figure, 640)


def _add_criticals(figure: go.Figure, found: xr.Dataset) -> None:
    """Rings where a mode crosses an order line within the speeds, and the lines of the orders above the first."""
    if "critical_speed" not in found:
        return
    speeds = found["speed"].values
    inside = (found["critical_speed"].values >= speeds[0]) & (found["critical_speed"].values <= speeds[-1])
    for order in np.unique(found["critical_order"].values[inside]).tolist():
        one = found.isel(critical=inside & (found["critical_order"].values == order))
        if order > 1:
            figure.add_trace(curve(speeds * TO_RPM, np.abs(speeds) * TO_HZ * order, INK, f"{order:.0f}X", 0.7, "dot",
                                   hoverinfo="skip", showlegend=False), 1, 1)  # fmt: skip
        x, text = one["critical_speed"].values * TO_RPM, [f"damping {z:.3g}" for z in one["critical_zeta"].values]
        figure.add_trace(go.Scatter(x=compact(x, 7), y=compact(np.abs(x) / 60 * order, 7), mode="markers", text=text,
                                    name=f"critical {order:.0f}X",
                                    marker={"symbol": "circle-open", "size": 12, "color": INK,
                                            "line": {"width": 3 - 0.75 * (order - 1)}}), 1, 1)  # fmt: skip


def critical_speed_map(found: xr.Dataset) -> go.Figure:
    """Undamped critical speeds over the stiffness of the bearings, both logarithmic.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.critical_speed_map(rotor.run_ucs(num=5).dataset())
    """
    _need(found, "critical_speed_map", "stiffness", "wn")
    figure = go.Figure()
    for k in range(found.sizes["mode"]):
        figure.add_trace(curve(found["stiffness"].values, found["wn"].values[k] * TO_RPM,
                               PIN_COLOURS[k % len(PIN_COLOURS)], f"mode {k + 1}"))  # fmt: skip
    figure.update_xaxes(title_text="stiffness of a bearing [N/m]", type="log", exponentformat="power")
    figure.update_yaxes(title_text="critical speed [rpm]", type="log", dtick=1)
    return style(figure, 460)


@page_of(xr.Dataset, "campbell")
def campbell_page(found: xr.Dataset) -> Page:
    """Page of a Campbell diagram with critical speeds, and the undamped ones over the bearings' stiffness if known."""
    text = (
        "Triangles up whirl forward at the measuring plane, down backward. Rings mark critical speeds. Lines end where "
        "a mode leaves the region that is searched or the film does not carry. Shaded: a mode grows."
    )
    orders = ("order", "speed [rpm]", "natural frequency", "damping ratio", "amplification", "whirl", "mode")
    sure = f"Modes: {modes_line(found)}. Critical speeds are searched from {searched_line(found)}."
    ends = ("mode", "speed [rpm]", "frequency [Hz]", "damping ratio", "whirl")
    blocks = [
        Block("Campbell diagram", text, figure=shaft_campbell(found)),
        Block("Critical speeds", sure, orders, criticals(found)),
        Block("Modes at the ends", "", ends, _ends(found)),
    ]
    if UNDAMPED in found:
        text = "Undamped, of the rotor on bearings of one stiffness each; films are springs here."
        undamped = critical_speed_map(found[[UNDAMPED]].rename({UNDAMPED: "wn"}))
        blocks.append(Block("Critical speeds over the bearings' stiffness", text, figure=undamped))
    return Page(
        f"{machine_entry(found.attrs)}: Campbell diagram",
        f"{at(found)} The lowest modes of the region.{warned(found)}",
        blocks,
    )


def criticals(found: xr.Dataset) -> list[tuple[object, ...]]:
    """Critical speeds: order, speed [rpm], how the natural frequency passes, damping, amplification, whirl, mode."""
    return [
        (f"{order}X", f"{rpm:.0f}", direction, zeta,
         f"{1 / (2 * zeta):.3g}" if zeta > 0 else "grows", whirl, str(mode))
        for order, rpm, direction, zeta, whirl, mode in critical_rows(found)
    ]  # fmt: skip


def _ends(found: xr.Dataset) -> list[tuple[object, ...]]:
    return [
        (str(int(one["branch"])), f"{float(one['speed']) * TO_RPM:.0f}", float(one["wn"]) * TO_HZ, float(one["zeta"]),
         str(one["whirl"].values))
        for k in range(found.sizes["branch"])
        for one in (found.isel(branch=k, speed=int(end)) for end in np.flatnonzero(found["wn"].notnull()[k])[[0, -1]])
    ]  # fmt: skip


def unbalance_response(found: xr.Dataset, nodes: tuple[int, ...] | None = None) -> go.Figure:
    """Half axis and phase lag of the whirl over speed at `nodes`; without them at the one that moves most.

    Examples
    --------
    >>> import rotorsim as rs
    >>> whirl = rotor.run_unbalance_response(3, 1e-5, 0.0, np.linspace(10.0, 200.0, 20))
    >>> figure = rs.report.unbalance_response(whirl.dataset())
    """
    _need(found, "unbalance_response", "frequency", "major", "x", "z")
    chosen = nodes or (int(found["major"].values.max(axis=1).argmax()),)
    figure = make_subplots(2, 1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.05)
    speed = found["frequency"].values * TO_RPM
    for k, node in enumerate(chosen):
        one = found.isel(node=node)
        colour, name = PIN_COLOURS[k % len(PIN_COLOURS)], f"z = {quantity(float(one['z']) * 1e3, 'mm', '.0f')}"
        for row, values in ((1, one["major"].values * TO_UM), (2, phase_lag(one["x"].values))):
            figure.add_trace(curve(speed, values, colour, name, legendgroup=name, showlegend=row == 1), row, 1)
    figure.update_yaxes(title_text="major half axis [µm]", type="log", row=1, col=1)
    phase_axes(figure, 2, "phase lag of x")
    figure.update_xaxes(title_text="speed [rpm]", row=2, col=1)
    return style(figure, 560)


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
    speed = found["speed"].values * TO_RPM
    for k, place in enumerate(chosen):
        one = found.sel(place=place)
        x = one["response_re"].sel(axis="x").values + 1j * one["response_im"].sel(axis="x").values
        lag, seen = np.full(x.size, np.nan), np.isfinite(x)
        lag[seen] = -np.degrees(np.unwrap(np.angle(x[seen])))
        lag -= 360 * np.round(np.nanmin(lag) / 360) if np.isfinite(lag).any() else 0.0
        look: dict[str, Any] = {"colour": PIN_COLOURS[k % len(PIN_COLOURS)], "name": place, "width": 2, "digits": 6}
        figure.add_trace(curve(speed, one["major"].values * TO_UM, legendgroup=place, **look), 1, 1)
        figure.add_trace(curve(speed, lag, legendgroup=place, showlegend=False, **look), 2, 1)
    shade_growth(figure, speed, found["zeta_least"].values, rows=2)
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


@page_of(xr.Dataset, "response")
def response_page(found: xr.Dataset) -> Page:
    """Page of an unbalance response over speed."""
    about = f"Unbalance: {found.attrs['unbalance']}. {at(found)} Linear about the equilibrium of each speed."
    about += warned(found)
    places = distinct(found)
    head = ("speed [rpm]", *(f"{place} [µm 0-pk]" for place in places), "least damping ratio")
    step = -(-found.sizes["speed"] // ROWS)
    rows = [
        (f"{float(one['speed']) * TO_RPM:.0f}", *(float(one["major"].sel(place=p)) * TO_UM for p in places),
         float(one["zeta_least"]))
        for one in (found.isel(speed=k) for k in range(0, found.sizes["speed"], step))
    ]  # fmt: skip
    text = "Amplitudes are 0-pk; the phase of x lags the unbalance. Shaded: a mode grows, and no response is steady."
    blocks = [
        Block("Response over speed", text, figure=response_figure(found)),
        Block("Peaks", "Where no mode grows.", ("place", "speed [rpm]", "size [µm 0-pk]", "may be larger beyond"),
              peaks(found)),
        Block("Speed by speed", "" if step == 1 else "Every speed is in the files.", head, rows),
    ]  # fmt: skip
    return Page(f"{machine_entry(found.attrs)}: unbalance response", about, blocks)


def peaks(found: xr.Dataset) -> list[tuple[str, str, float, str]]:
    """Largest response of each place: place, speed [rpm], size [um 0-pk], and where it may be larger beyond."""
    known = [(place, peak_of(found, place)) for place in distinct(found)]
    return [
        (place, f"{one['rpm']:.0f}", one["um"], ENDS.get(one["at_end"], "-")) for place, one in known if one is not None
    ]


def warned(found: xr.Dataset) -> str:
    """Sentences about the speeds at which a result does not hold, after a space; empty without any."""
    return "".join(f" Warning: {sentence}." for sentence in str(found.attrs.get("warnings", "")).splitlines())


def at(found: xr.Dataset) -> str:
    """Sentence about the supply pressure; empty for a machine without a film."""
    films = "gas_film" in str(found.attrs["machine"])
    return f"Supply pressure {quantity(found.attrs['pressure'] * TO_MPA, 'MPa', '.4g')} gauge." if films else ""


def sag(found: xr.Dataset) -> go.Figure:
    """The bent shaft at rest in x and y.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.sag(rotor.run_static().dataset())
    """
    _need(found, "sag", "x", "y", "z")
    figure = go.Figure()
    for axis, colour in zip("xy", PIN_COLOURS, strict=False):
        figure.add_trace(curve(found["z"].values * 1e3, found[axis].values * TO_UM, colour, axis,
                               mode="lines+markers", marker={"size": 5}))  # fmt: skip
    figure.update_xaxes(title_text="position along the shaft [mm]")
    figure.update_yaxes(title_text="displacement [µm]")
    return style(figure, 380)
