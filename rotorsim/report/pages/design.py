"""Report of a controller design: sensitivities, damping over the operating range, root locus."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import MPA, TO_HZ, TO_RPM
from rotorsim.control.law import Law
from rotorsim.control.plants import sampled_plant
from rotorsim.control.sampled_loop import (
    closed_poles,
    fine_axes,
    law_system,
    loop_of,
    oscillating,
    overview,
    root_locus,
    sweep,
)
from rotorsim.control.systems import largest
from rotorsim.report.export.display_units import in_page_units, quantity
from rotorsim.report.export.page_files import check_wanted
from rotorsim.report.figures.theme import AXIS_COLOURS, NEUTRAL, PIN_COLOURS, compact, style
from rotorsim.report.pages.study import Block, save_study_page


@in_page_units
def write_design(law: Law, model: Any, path: str | Path, units: str = "metric", figures: str | None = None) -> Path:
    """Write the page; raises DataError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.write_design(law, lpv, "law.html").name
    'law.html'
    """
    check_wanted(units, figures)
    speeds, pressures = fine_axes(law, model)
    corners = [(w, p) for w in {speeds[0], speeds[-1]} for p in {pressures[0], pressures[-1]}]
    rows = [
        (key.replace("_", " "), f"{v:.5g}" if isinstance(v, float) else v) for key, v in overview(law, model).items()
    ]
    middle = float(np.mean(speeds)), float(np.mean(pressures))
    single = len(speeds) == len(pressures) == 1
    where = f"at {_point(*middle)}" if single else "at the corners of the range"
    blocks = [
        Block("The loop", "With the identified model, one sample of delay and the hold.", ("quantity", "value"), rows),
        Block("Sensitivities", f"Largest singular values {where}: disc to disc (S), disc to "
              "reference (KS), disturbance at the reference to disc, closed (solid) and open (dotted).",
              figure=sensitivity_figure(law, model, sorted(corners))),
        _modes(law, model, middle) if single else
        Block("Damping over the range", "Smallest damping ratio of the closed loop below 600 Hz.",
              figure=damping_figure(law, model, speeds, pressures)),
        Block("Root locus", f"Poles of the loop {where if single else 'at the middle of the range'} for the law times "
              "0 to 2: crosses 0, dots 1.", figure=locus_figure(law, model, *middle)),
    ]  # fmt: skip
    save_study_page(f"Design {law.name}", "A control law on its identified model.", blocks, path, units, figures)
    return Path(path)


def _modes(law: Law, model: Any, point: tuple[float, float]) -> Block:
    """Frequencies and damping ratios without and with the law at one operating point."""
    plant = sampled_plant(model, *point, law.Ts)
    loops = (("open", np.linalg.eigvals(plant.A)), ("closed", closed_poles(plant, law_system(law, *point))))
    rows = [(name, float(abs(s) * TO_HZ), float(-s.real / abs(s))) for name, z in loops for s in oscillating(z, law.Ts)]
    heads = ("loop", "natural frequency [Hz]", "damping ratio")
    return Block("Modes", f"At {_point(*point)}, the point of the model, below 600 Hz.", heads, rows)


def sensitivity_figure(law: Law, model: Any, points: list[tuple[float, float]]) -> go.Figure:
    """S, KS and GS over frequency."""
    figure = make_subplots(1, 3, subplot_titles=["S", "KS [V/µm]", "GS, G [µm/V]"])
    for k, (w, p) in enumerate(points):
        loop = loop_of(sampled_plant(model, w, p, law.Ts), law_system(law, w, p), law.Ts)
        name, colour = _point(w, p), PIN_COLOURS[k % len(PIN_COLOURS)]
        curves = ((1, loop.So, "solid"), (2, loop.KS, "solid"), (3, loop.GS, "solid"), (3, loop.G, "dot"))
        for column, matrices, dash in curves:
            figure.add_trace(go.Scatter(x=compact(loop.frequency), y=compact(largest(matrices)), name=name,
                                        legendgroup=name, showlegend=column == 1,
                                        line={"color": colour, "dash": dash, "width": 1.5}), 1, column)  # fmt: skip
    figure.update_xaxes(title_text="frequency [Hz]", type="log")
    figure.update_yaxes(type="log")
    return style(figure, 440)


def damping_figure(law: Law, model: Any, speeds: np.ndarray, pressures: np.ndarray) -> go.Figure:
    """Smallest damping ratio over speed and pressure; a line where one of them does not vary."""
    damping = sweep(law, model, speeds, pressures).damping
    x, y = compact(speeds * TO_RPM), compact(pressures / MPA)
    figure = go.Figure()
    if len(speeds) > 1 and len(pressures) > 1:
        figure.add_trace(go.Heatmap(x=x, y=y, z=compact(damping.T, 3), colorscale="Blues", colorbar={"title": "ζ"}))
    else:
        along = x if len(speeds) > 1 else y
        figure.add_trace(go.Scatter(x=along, y=compact(damping.ravel(), 3), line={"color": AXIS_COLOURS["x"]}))
    figure.update_xaxes(title_text="speed [rpm]" if len(speeds) > 1 else "pressure [MPa]")
    figure.update_yaxes(title_text="pressure [MPa]" if figure.data[0].type == "heatmap" else "damping ratio")
    return style(figure, 360)


def locus_figure(law: Law, model: Any, speed: float, pressure: float) -> go.Figure:
    """Poles z for gains 0 to 2 times the law's."""
    gains = np.linspace(0, 2, 81)
    rows = root_locus(sampled_plant(model, speed, pressure, law.Ts), law_system(law, speed, pressure), gains)
    figure = go.Figure()
    turn = np.linspace(0, 2 * np.pi, 200)
    figure.add_trace(go.Scatter(x=compact(np.cos(turn)), y=compact(np.sin(turn)), mode="lines", name="unit circle",
                                line={"color": NEUTRAL, "width": 1}))  # fmt: skip
    for k in range(rows.shape[1]):
        figure.add_trace(go.Scatter(x=compact(rows[:, k].real), y=compact(rows[:, k].imag), mode="markers",
                                    marker={"size": 3, "color": AXIS_COLOURS["x"]}, showlegend=False))  # fmt: skip
    for index, symbol, name in ((0, "x", "open loop"), (40, "circle", "the law")):
        figure.add_trace(go.Scatter(x=compact(rows[index].real), y=compact(rows[index].imag), mode="markers", name=name,
                                    marker={"size": 8, "symbol": symbol, "color": AXIS_COLOURS["y"]}))  # fmt: skip
    figure.update_xaxes(range=[0.6, 1.05], title_text="Re z")
    figure.update_yaxes(range=[-0.3, 0.3], title_text="Im z")
    return style(figure, 460)


def _point(speed: float, pressure: float) -> str:
    """An operating point [rad/s], [Pa] in the units of the page."""
    return f"{speed * TO_RPM:.0f} rpm, {quantity(pressure / MPA, 'MPa')}"
