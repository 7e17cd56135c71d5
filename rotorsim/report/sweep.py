"""Page of a sweep, with lines over one axis, contours over two and small multiples over a third."""

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.analysis.sweep import SweepResult, heading, text_of
from rotorsim.analysis.sweep_definition import SweepQuantity
from rotorsim.base.units import TO_MPA, TO_RPM
from rotorsim.report.operating_map import MAP_SCALE
from rotorsim.report.page import INK, PIN_COLOURS, Block, Page, compact, curve, machine_entry, page_of, style
from rotorsim.report.units import quantity

MOST_AXES = 3
"""Axes of a chart: two of a contour, one of small multiples."""
PANELS = 6
"""Small multiples of a chart, at most."""
MOST_ROWS = 400
DEFINITIONS = {
    "lift_off": "Least gauge supply pressure at which the film carries the rotor.",
    "onset": "Lowest speed at which a mode of film and rotor loses its damping.",
    "load": "Static load, distributed as the rotor's mass, under which a journal reaches half of its clearance.",
    "flow": "Mass flow of all injectors and orifices.",
    "damping": "Least damping ratio of the modes near the first critical speeds.",
    "frequency": "Lowest natural frequency of film and rotor together.",
    "peak": "Largest half axis of the orbit at the measuring plane, over the stable speeds.",
    "thrust_gap": "Least gap of the thrust bearings where they carry the axial load.",
    "thrust_flow": "Mass flow from the thrust bearings there.",
    "thrust_power": "Friction power of the thrust bearings there.",
    "axial_stiffness": "Stiffness at rest of the rotor between its thrust bearings.",
    "axial_frequency": "Natural frequency of the rotor along the shaft.",
    "axial_damping": "Damping ratio of that motion.",
}
"""Definition of every quantity of a sweep."""


@page_of(SweepResult)
def sweep_page(result: SweepResult) -> Page:
    """Page of a sweep: best points, cells without a result, a chart of each quantity, a table of the cells."""
    return Page(f"{machine_entry(result.data.attrs)}: sweep", _about(result), _blocks(result))


def _about(result: SweepResult) -> str:
    attrs, axes = result.data.attrs, {str(name) for name in result.data.sizes}
    fixed = []
    if "speed" not in axes:
        fixed.append(f"{attrs['speed'] * TO_RPM:.5g} rpm")
    if "pressure" not in axes:
        fixed.append(f"{quantity(attrs['pressure'] * TO_MPA, 'MPa', '.4g')} gauge")
    at = f" at {' and '.join(fixed)}" if fixed else ""
    top = f"Onset and unbalance response are searched up to {attrs['highest_speed'] * TO_RPM:.5g} rpm."
    cut = "" if result.complete else " The sweep was interrupted and is not complete."
    return f"Equilibria and linear models of film and rotor{at}, without time simulation. {top}{cut}"


def _blocks(result: SweepResult) -> list[Block]:
    blocks = [Block("Best points", "", ("quantity", "best is the", "value", "at"), best_rows(result))]
    if result.reasons:
        blocks.append(Block("Cells without a result", "", ("quantity", "reason", "cells"), reason_rows(result)))
    for shown in result.quantities:
        figure = sweep_figure(result, shown.name)
        if figure is not None:
            blocks.append(Block(shown.meaning.capitalize(), DEFINITIONS[shown.name], figure=figure))
        elif result.data[shown.name].ndim > MOST_AXES:
            blocks.append(Block(shown.meaning.capitalize(), "More than three axes: see the table and the files."))
    head, rows = result.table()
    text = "" if len(rows) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(rows)} cells; all are in the files."
    cells = [["-" if value is None else value for value in row] for row in rows[:MOST_ROWS]]
    return [*blocks, Block("Cell by cell", text, head, cells)]


def best_rows(result: SweepResult) -> list[tuple[str, ...]]:
    """Best points as text: quantity, sense, value, point."""
    return [
        (name, one["best"], f"{one['value']:.4g} {one['unit']}".removesuffix(" 1"),
         ", ".join(f"{path} = {value}" for path, value in one["at"].items()))
        for name, one in result.best.items()
    ]  # fmt: skip


def reason_rows(result: SweepResult) -> list[tuple[str, str, str]]:
    """Cells without a result as text: quantity, reason, number."""
    return [(name, reason, str(n)) for name, found in result.reasons.items() for reason, n in found.items()]


def sweep_figure(result: SweepResult, quantity: str) -> go.Figure | None:
    """Chart of a quantity; None where it has more axes than can be drawn, or no number.

    A line over one axis, a contour over two, one contour for each value of the third of three; the best point is a
    diamond. Axes with a single value are left out.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.sweep("dtu_gas_bearing", ["pressure=0.4 MPa, 0.5 MPa"], "flow")
    >>> figure = rs.report.sweep_figure(found, "flow")
    """
    shown = next(q for q in result.quantities if q.name == quantity)
    values = result.data[quantity]
    values = values.squeeze([d for d in values.dims if values.sizes[d] == 1]) * shown.factor
    axes = [str(dim) for dim in sorted(map(str, values.dims), key=lambda d: -values.sizes[d])]
    if not axes or len(axes) > MOST_AXES or not np.isfinite(values).any():
        return None
    if len(axes) == 1:
        return _line(result.data, values, shown, axes[0])
    return _contours(result.data, values, shown, axes)


def _line(data: xr.Dataset, values: xr.DataArray, shown: SweepQuantity, axis: str) -> go.Figure:
    figure = go.Figure(
        curve(data[axis].values, values.values, PIN_COLOURS[0], width=2, mode="lines+markers", showlegend=False)
    )
    k = _best(values, shown)[0]
    figure.add_trace(_mark([float(data[axis][k])], [float(values[k])], shown))
    figure.update_xaxes(title_text=heading(data, axis))
    figure.update_yaxes(title_text=f"{shown.meaning} [{shown.shown}]")
    return style(figure, 380)


def _contours(data: xr.Dataset, values: xr.DataArray, shown: SweepQuantity, axes: list[str]) -> go.Figure:
    x, y, *third = axes
    values = values.transpose(*third, y, x)
    panels = values.values if third else values.values[None]
    chosen = np.unique(np.linspace(0, len(panels) - 1, min(len(panels), PANELS)).round().astype(int))
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    titles = [
        f"{heading(data, t).split(' [')[0]} = {text_of(data[t], float(data[t][k]))}" for t in third for k in chosen
    ]
    figure = make_subplots(rows, columns, shared_xaxes="all", shared_yaxes="all", subplot_titles=titles or None,
                           horizontal_spacing=0.05, vertical_spacing=0.12)  # fmt: skip
    best = _best(values, shown)
    for number, k in enumerate(chosen.tolist()):
        place = {"row": number // columns + 1, "col": number % columns + 1}
        figure.add_trace(_contour(data, panels[k], shown, x, y), **place)
        if not third or best[0] == k:
            j, i = best[-2:]
            figure.add_trace(_mark([float(data[x][i])], [float(data[y][j])], shown), **place)
        if place["col"] == 1:
            figure.update_yaxes(title_text=heading(data, y), **place)
        if number + columns >= len(chosen):
            figure.update_xaxes(title_text=heading(data, x), showticklabels=True, **place)
    for update, axis in ((figure.update_xaxes, x), (figure.update_yaxes, y)):
        ends = data[axis].values[[0, -1]]
        update(range=[float(v) for v in ends])
    figure.update_layout(coloraxis={"colorscale": MAP_SCALE, "colorbar": {"title": f"{shown.name}<br>[{shown.shown}]"}})
    return style(figure, 110 + 300 * rows, hovermode="closest")


def _contour(data: xr.Dataset, table: np.ndarray, shown: SweepQuantity, x: str, y: str) -> go.Contour:
    return go.Contour(
        x=compact(data[x].values), y=compact(data[y].values), z=compact(table), coloraxis="coloraxis", ncontours=9,
        contours={"showlabels": True, "labelfont": {"size": 10, "color": INK}}, line={"width": 0.8},
        hovertemplate=f"%{{x:.4g}}, %{{y:.4g}}: %{{z:.4g}} {shown.shown}<extra></extra>",
    )  # fmt: skip


def _best(values: xr.DataArray, shown: SweepQuantity) -> tuple[int, ...]:
    find = np.nanargmax if shown.best == "highest" else np.nanargmin
    return tuple(map(int, np.unravel_index(int(find(values.values)), values.shape)))


def _mark(x: list[float], y: list[float], shown: SweepQuantity) -> go.Scatter:
    """The best point."""
    return go.Scatter(
        x=x, y=y, mode="markers", name=f"{shown.best} {shown.name}", cliponaxis=False, showlegend=True,
        marker={"symbol": "diamond", "size": 12, "color": PIN_COLOURS[1], "line": {"width": 1, "color": "white"}},
    )  # fmt: skip
