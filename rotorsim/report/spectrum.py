"""Spectra of a steady motion with marks of the orders, noise of the sensors, and runout over the shaft angle."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.page.theme import AXIS_COLOURS, INK, NEUTRAL, compact, faint, style
from rotorsim.report.page.units import displacement
from rotorsim.report.run import AnalysedRun, need_motion, record_section, sensed
from rotorsim.signals.record_blocks import RunoutProfile, need, runout_of
from rotorsim.signals.spectra import SensorError, Spectrum, difference_of, spectrum_of

ORDERS = (1, 2, 3)
DECADES = 5.0


def _steady_spectrum(run: AnalysedRun) -> Any:
    need(not run.swept, "The speed changes; see the waterfall.")
    need_motion(run)
    return spectrum_of(run.record, run.output, run.highest_frequency)


def spectrum_caption(run: AnalysedRun, spectrum: Spectrum) -> str:
    """The strongest line and the quality of the estimate."""
    k, axis = np.unravel_index(int(spectrum.single.argmax()), spectrum.single.shape)
    full = int(spectrum.full.argmax())
    return (
        f"The strongest line is {displacement(spectrum.single.max())} 0-pk at {spectrum.frequency[k]:.4g} Hz, "
        f"disc {'xy'[axis]}; "
        f"of x + i y it is {displacement(spectrum.full[full])} at {spectrum.signed[full]:.4g} Hz, "
        f"{'forward' if spectrum.signed[full] > 0 else 'backward'}. Hann window, root mean square of {spectrum.count} "
        f"segment{'s' * (spectrum.count > 1)}, resolution {spectrum.resolution:.2g} Hz.{sensed(run)}"
    )


@record_section("Spectra", _steady_spectrum, spectrum_caption)
def spectra(run: AnalysedRun, spectrum: Spectrum) -> go.Figure:
    """Averaged spectra [um 0-pk] of x, y and x + i y at constant speed, with the orders marked.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.spectra(record)
    """
    figure = make_subplots(2, 1, vertical_spacing=0.18)
    add_single(figure, spectrum, 1)
    figure.add_trace(_line(spectrum.signed, spectrum.full, "x + i y", NEUTRAL), 2, 1)
    figure.update_xaxes(range=[0, float(spectrum.frequency[-1])], row=1)
    edge = float(np.abs(spectrum.signed).max())
    figure.update_xaxes(range=[-edge, edge], title_text="frequency [Hz], backward below 0, forward above", row=2)
    figure.update_xaxes(title_text="frequency [Hz]", row=1)
    for row, values, what in ((1, spectrum.single, "disc x, disc y"), (2, spectrum.full, "x + i y")):
        set_log_axis(figure, values, row)
        figure.update_yaxes(title_text=f"{what}<br>[µm 0-pk]", row=row)
    mark_orders(figure, run.turning, float(spectrum.frequency[-1]), 1, ORDERS)
    mark_orders(figure, run.turning, edge, 2, (-3, -2, -1, *ORDERS))
    return style(figure, 640)


def _difference(run: AnalysedRun) -> SensorError:
    return difference_of(run.record, run.highest_frequency)


def difference_caption(run: AnalysedRun, difference: SensorError) -> str:
    """Noise levels."""
    parts = [
        f"along {axis} {displacement(difference.rms[k])} rms and {displacement(difference.peak_to_peak[k])} pk-pk "
        f"about an offset of {displacement(difference.offset[k] + 0.0, '.3f')}"
        for k, axis in enumerate("xy")
    ]
    text = f"Measured less true displacement is {' and '.join(parts)}."
    return text + (" Lines at multiples of the shaft speed are runout." if run.revolutions >= 1 else "")


@record_section("Measured against true displacement", _difference, difference_caption)
def sensor_noise(run: AnalysedRun, difference: SensorError) -> go.Figure:
    """Spectrum [um 0-pk] of measured less true displacement.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.sensor_noise(record)
    """
    spectrum = difference.spectrum
    figure = make_subplots(1, 1)
    add_single(figure, spectrum, 1)
    figure.update_xaxes(title_text="frequency [Hz]", range=[0, float(spectrum.frequency[-1])])
    set_log_axis(figure, spectrum.single, 1)
    figure.update_yaxes(title_text="difference [µm 0-pk]")
    mark_orders(figure, run.turning, float(spectrum.frequency[-1]), 1, ORDERS)
    return style(figure, 380)


def add_single(figure: go.Figure, spectrum: Spectrum, row: int) -> None:
    """Lines of x and y."""
    for k, axis in enumerate("xy"):
        trace = _line(spectrum.frequency, spectrum.single[:, k], f"disc {axis}", AXIS_COLOURS[axis])
        figure.add_trace(trace.update(showlegend=True), row, 1)


def _line(frequency: np.ndarray, size: np.ndarray, name: str, colour: str) -> go.Scatter:
    return go.Scatter(x=compact(frequency, 6), y=compact(np.maximum(size * TO_UM, 1e-9)), mode="lines", name=name,
                      showlegend=False, line={"color": colour, "width": 1.2, "simplify": False},
                      hovertemplate="%{y:.3g} µm at %{x:.1f} Hz<extra></extra>")  # fmt: skip


def set_log_axis(figure: go.Figure, values: np.ndarray, row: int) -> None:
    """Decades below the largest value, no further than just below the usual floor."""
    um = np.maximum(values * TO_UM, 1e-9)
    top = float(np.log10(um.max())) + 0.4
    floor = max(float(np.log10(np.median(um))) - 1.0, top - DECADES)
    figure.update_yaxes(type="log", range=[min(floor, top - 2), top], dtick=1, exponentformat="power", row=row)


def mark_orders(figure: go.Figure, turning: float, edge: float, row: int, orders: tuple[int, ...]) -> None:
    """Dotted lines at multiples of `turning` [Hz] within the axis, far enough apart to be read."""
    for n in orders if turning > edge / 100 else ():
        if abs(n) * turning < edge:
            figure.add_vline(x=n * turning, line={"color": faint(INK, 0.55), "width": 1, "dash": "dot"}, row=row, col=1,
                             annotation={"text": f"{n}X".replace("-", "−"), "yanchor": "bottom"},
                             annotation_position="top")  # fmt: skip


def _runout(run: AnalysedRun) -> Any:
    run.need_turning()
    return runout_of(run.record, run.output, run.revolutions)


def runout_caption(run: AnalysedRun, runout: RunoutProfile) -> str:
    """Peak-to-peak runout, its harmonics and the scatter."""
    parts = []
    for k, axis in enumerate("xy"):
        order, span = (
            int(np.abs(runout.harmonic[:, k]).argmax()),
            float(np.ptp(runout.mean[np.isfinite(runout.mean[:, k]), k])),
        )
        parts.append(
            f"Disc {axis}: {displacement(span)} pk-pk, "
            "largest "
            f"harmonic {order + 1}X with {displacement(abs(runout.harmonic[order, k]))} 0-pk, scatter about the mean "
            f"{displacement(np.sqrt(np.nanmean(runout.scatter[:, k] ** 2)), '.2g')} rms."
        )
    parts.append(f"Mean of {runout.revolutions:.1f} revolutions; bands are one standard deviation.")
    return " ".join(parts) + sensed(run)


@record_section("Runout", _runout, runout_caption)
def runout_profile(run: AnalysedRun, runout: RunoutProfile) -> go.Figure:
    """Runout [um] over the shaft angle [deg] of a slow roll, and its harmonics.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=60.0, pressure=0.5e6, revolutions=2)
    >>> figure = rs.report.runout_profile(slow)
    """
    figure = make_subplots(1, 2, column_widths=[0.66, 0.34], horizontal_spacing=0.1,
                           subplot_titles=["mean over the revolutions", "harmonics"])  # fmt: skip
    for k, axis in enumerate("xy"):
        for trace in _profile(runout, k, axis):
            figure.add_trace(trace, 1, 1)
        figure.add_trace(_bars(runout, k, axis), 1, 2)
    figure.update_xaxes(title_text="shaft angle [deg]", range=[0, 360], tickvals=[0, 90, 180, 270, 360], col=1)
    figure.update_xaxes(title_text="order", dtick=1, col=2)
    figure.update_yaxes(title_text="runout [µm]", col=1)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", rangemode="tozero", col=2)
    return style(figure, 440, barmode="group")


def _profile(runout: RunoutProfile, k: int, axis: str) -> list[go.Scatter]:
    degrees, mean, spread = np.degrees(runout.angle), runout.mean[:, k] * TO_UM, runout.scatter[:, k] * TO_UM
    edge = {"x": compact(degrees), "mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
    return [
        go.Scatter(y=compact(mean - spread), **edge),
        go.Scatter(y=compact(mean + spread), fill="tonexty", fillcolor=faint(AXIS_COLOURS[axis]), **edge),
        go.Scatter(x=compact(degrees), y=compact(mean), mode="lines", name=f"disc {axis}", legendgroup=axis,
                   line={"color": AXIS_COLOURS[axis], "width": 2},
                   hovertemplate="%{y:.3g} µm at %{x:.0f} deg<extra></extra>"),
    ]  # fmt: skip


def _bars(runout: RunoutProfile, k: int, axis: str) -> go.Bar:
    size = np.abs(runout.harmonic[:, k]) * TO_UM
    return go.Bar(x=np.arange(1, size.size + 1), y=compact(size), marker={"color": AXIS_COLOURS[axis]},
                  name=f"disc {axis}", legendgroup=axis, showlegend=False,
                  hovertemplate="%{x}X: %{y:.3g} µm<extra></extra>")  # fmt: skip
