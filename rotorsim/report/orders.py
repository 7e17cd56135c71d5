"""Orders and spectra: Bode plot, waterfall, full spectrum; at one speed spectra, noise of the sensors and runout."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.report.page import (
    AXIS_COLOURS,
    FAINTEST,
    INK,
    NEUTRAL,
    SPECTRUM_SCALE,
    compact,
    faint,
    phase_axes,
    phase_lag,
    style,
)
from rotorsim.report.run import (
    AnalysedRun,
    end_of_run,
    need_motion,
    need_orders,
    need_plane,
    need_time,
    record_section,
    sensed,
    slow_roll_text,
)
from rotorsim.report.units import displacement, number, quantity
from rotorsim.signals.record_blocks import RunoutProfile, need, runout_of, sampling_time
from rotorsim.signals.spectra import SensorError, Spectrum, difference_of, spectrum_of

MOST_POINTS, MOST_LINES = 1500, 250
FEW = 8
"""Number of windows up to which each is marked."""
DECADES = 3.5
"""Decades of the colour scale of spectra."""
SHORTEST = 0.5
"""Shortest record [s] that has a waterfall: it holds two spectra."""
CONVENTION = (
    "Displacements are Re(A exp(i n α)) with the shaft angle α; amplitudes are 0-pk and a positive phase lag means "
    "that the maximum comes after the mark. On a round forward orbit y lags x by 90 degrees."
)


def bode_caption(run: AnalysedRun, _: None) -> str:
    """Speeds and amplitudes of the peaks of the orders."""
    if not run.summary["peaks"]:
        return "The shaft did not turn long enough for whole revolutions to be tracked."
    parts = [*(_order_sentence(run, int(n)) for n in run.tracked["order"].values), _start(run.summary)]
    return " ".join(parts).strip() + slow_roll_text(run)


def _order_sentence(run: AnalysedRun, order: int) -> str:
    peaks = [p for p in run.peaks if p["order"] == order]
    if not peaks:
        return f"{order}X is not resolved, or stays below a thousandth of the largest order."
    resonant = [p for p in peaks if p["local_maximum"]]
    axes = sorted({p["axis"] for p in resonant})
    if resonant:
        return (
            f"{order}X peaks at "
            + " and ".join(_place(next(p for p in resonant if p["axis"] == a)) for a in axes)
            + "."
        )
    where = " and ".join(_place(p) + (end_of_run(p) if run.swept else "") for p in peaks)
    if not run.swept:
        return f"{order}X is at most {where}."
    return f"{order}X passes no resonance; it is largest at {where}."


def _place(peak: dict[str, Any]) -> str:
    return f"{peak['rpm']:.0f} rpm ({peak['axis']}: {quantity(peak['um'], 'µm')})"


def _start(summary: dict[str, Any]) -> str:
    """A sentence about the start transient that the numbers leave out; empty without one."""
    begin = summary["start_transient_s"]
    if not begin:
        return ""
    more = "" if summary["start_settled"] else " The free vibration of the start goes on behind them: run longer."
    return f"The first {begin:.3g} s, from rest onto the orbit, are left out of the numbers.{more}"


@record_section("Amplitude and phase of the orders", need_orders, bode_caption)
def bode(run: AnalysedRun, _: None) -> go.Figure:
    """Amplitude [um 0-pk] and phase lag [deg] of 1X, 2X, 3X against speed [rpm]; against time at constant speed.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.bode(runup)
    """
    orders = [int(n) for n in run.tracked["order"].values]
    least = faintest(run)
    figure = make_subplots(2, len(orders), shared_xaxes=True, vertical_spacing=0.06, horizontal_spacing=0.07,
                           row_heights=[0.6, 0.4], subplot_titles=[f"{n}X" for n in orders])  # fmt: skip
    for column, n in enumerate(orders, 1):
        for axis in run.axes:
            for row, trace in enumerate(order_traces(run, n, axis), 1):
                figure.add_trace(trace.update(showlegend=row == column == 1), row, column)
        own = float(np.abs(run.tracked["amplitude"].sel(order=n).values).max(initial=0.0))
        figure.update_yaxes(range=[0, 1.06 * TO_UM * max(own, least)] if least else None, row=1, col=column)
    figure.update_xaxes(range=run.reach)
    figure.update_xaxes(title_text=run.abscissa(run.tracked)[1], row=2)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", row=1, col=1)
    phase_axes(figure, 2)
    return style(figure, 560)


def order_traces(run: AnalysedRun, order: int, axis: str) -> tuple[go.Scatter, go.Scatter]:
    """Amplitude and phase lag of one order and axis."""
    tracked = run.tracked.isel(window=slice(None, None, 1 + run.tracked.sizes["window"] // MOST_POINTS))
    at, label = run.abscissa(tracked)
    a = tracked["amplitude"].sel(order=order, axis=axis).values
    unit = label.split("[")[1][:-1]
    common = {"x": compact(at, 6), "name": run.axes[axis], "legendgroup": axis,
              "mode": "lines" if tracked.sizes["window"] > FEW else "lines+markers",
              "line": {"color": AXIS_COLOURS[axis], "width": 2, "simplify": False}}  # fmt: skip
    hover = f"{order}X {axis}: %{{y:.3g}} {{}} at %{{x:.0f}} {unit}<extra></extra>"
    return (
        go.Scatter(y=compact(np.abs(a) * TO_UM), hovertemplate=hover.replace("{}", "µm"), **common),
        go.Scatter(y=compact(phase_lag(a, faintest(run))), hovertemplate=hover.replace("{}", "deg"), **common),
    )


def faintest(run: AnalysedRun) -> float:
    """Amplitude [m] below which an order counts as absent."""
    return FAINTEST * float(np.abs(run.tracked["amplitude"].values).max(initial=0.0))


def _need_spectra(run: AnalysedRun) -> None:
    need_time(run)
    seconds = run.record.sizes["time"] * sampling_time(run.record)
    need(seconds >= SHORTEST, f"The record of {seconds:.2g} s is too short for spectra that follow the time.")
    need_motion(run)


def waterfall_caption(run: AnalysedRun, _: None) -> str:
    """The strongest line, and whether anything below 1X stands out."""
    size = run.spectra["amplitude"]
    line, k, axis = (int(v) for v in np.unravel_index(int(size.values.argmax()), size.shape))
    frequency, rpm = float(run.spectra["frequency"][k]), float(run.spectra["speed"][line]) * TO_RPM
    where = f"{frequency:.0f} Hz ({run.axes['xy'[axis]]}" + (f", {rpm:.0f} rpm)" if run.speed_known else ")")
    text = f"The strongest line is {displacement(float(size.max()))} at {where}."
    return f"{text} {sub_synchronous_text(run)}" if run.self_excitable else text


def sub_synchronous_text(run: AnalysedRun) -> str:
    """A sentence on motion below 1X."""
    found = run.summary["sub_synchronous"]
    if found is None:
        return "Nothing stands out below 1X in this record."
    turn = "forward" if found["frequency_hz"] > 0 else "backward"
    return (
        f"Below 1X the largest component is {quantity(found['um'], 'µm')} at {abs(found['frequency_hz']):.0f} Hz, "
        f"{turn}, {found['ratio']:.2f} times the shaft speed, at {found['rpm']:.0f} rpm."
    )


@record_section("Waterfall", _need_spectra, waterfall_caption)
def waterfall(run: AnalysedRun, _: None) -> go.Figure:
    """Amplitude spectra [um 0-pk] of disc x and y against speed [rpm] or time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.waterfall(runup)
    """
    titles = list(run.axes.values())
    figure = make_subplots(1, len(titles), shared_yaxes=True, horizontal_spacing=0.06, subplot_titles=titles)
    for column, axis in enumerate(run.axes, 1):
        size = run.spectra["amplitude"].sel(axis=axis).values
        figure.add_trace(spectrum_trace(run, "frequency", size), 1, column)
        add_order_lines(figure, run, (1, 2, 3), 1, column)
    return _finish(figure, run, 460, "frequency [Hz]")


def full_spectrum_caption(run: AnalysedRun, _: None) -> str:
    """Forward and backward part of the motion at the fastest tracked window."""
    if run.tracked.sizes["window"] == 0:
        return "Spectrum of x + i y."
    i = int(np.abs(run.tracked["speed"].values).argmax())
    rpm = float(run.tracked["speed"][i]) * TO_RPM
    f, b = (abs(complex(run.tracked[k].sel(order=1).values[i])) * TO_UM for k in ("forward", "backward"))
    return (
        f"Spectrum of x + i y. At {rpm:.0f} rpm the 1X orbit is made of {quantity(f, 'µm')} forward and "
        f"{quantity(b, 'µm')} backward: semi-axes {number(f + b, 'µm')} and {quantity(abs(f - b), 'µm')}."
    )


def _need_full_spectra(run: AnalysedRun) -> None:
    _need_spectra(run)
    need_plane(run)


@record_section("Forward and backward whirl", _need_full_spectra, full_spectrum_caption)
def full_spectrum(run: AnalysedRun, _: None) -> go.Figure:
    """Spectra [um 0-pk] of x + i y, forward above and backward below zero, against speed [rpm] or time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.full_spectrum(runup)
    """
    figure = make_subplots(1, 1)
    figure.add_trace(spectrum_trace(run, "signed_frequency", run.spectra["full"].values), 1, 1)
    add_order_lines(figure, run, (-3, -2, -1, 1, 2, 3), 1, 1)
    figure.add_hline(y=0, line={"color": INK, "width": 1})
    for text, y in (("forward", 0.98), ("backward", 0.02)):
        figure.add_annotation(text=text, x=0.01, y=y, xref="paper", yref="paper", showarrow=False)
    return _finish(figure, run, 520, "frequency [Hz]")


MOST_RAISED = 40
"""Most spectra of a cascade."""
HIGHEST = 4.0
"""Highest order of a cascade."""
RAISED = 6.0
"""Height of the tallest line of a cascade, in distances of its spectra."""


def _need_cascade(run: AnalysedRun) -> None:
    _need_spectra(run)
    need(run.swept, "The speed does not change; see the waterfall.")


def cascade_caption(run: AnalysedRun, _: None) -> str:
    """Tallest line and what its height stands for."""
    size = run.spectra["amplitude" if run.lone else "full"]
    what = f"of {run.axes['x']}" if run.lone else "of x + i y, forward above and backward below zero"
    return (
        f"Spectra {what}, each raised from its speed by its amplitude; the tallest line is "
        f"{displacement(float(size.max()))} 0-pk."
    )


@record_section("Cascade", _need_cascade, cascade_caption)
def cascade(run: AnalysedRun, _: None) -> go.Figure:
    """Spectra of x + i y, or of the only probe, each above its shaft speed [rpm].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.cascade(runup)
    """
    size = run.spectra["amplitude"].values[..., 0] if run.lone else run.spectra["full"].values
    frequency = run.spectra["frequency" if run.lone else "signed_frequency"].values
    at = run.abscissa(run.spectra)[0]
    within = np.abs(frequency) <= HIGHEST * np.abs(at).max() / 60
    frequency, size = frequency[within], size[:, within]
    chosen = np.argsort(at, kind="stable")[:: 1 + at.size // MOST_RAISED]
    apart = float(np.ptp(at[chosen])) / max(chosen.size - 1, 1)
    group = -(-frequency.size // (2 * MOST_LINES))
    starts = np.arange(0, frequency.size, group)
    middle = np.add.reduceat(frequency, starts) / np.diff(np.append(starts, frequency.size))
    figure = go.Figure()
    for k in reversed(chosen):  # the slowest, drawn last, stands in front
        um = np.maximum.reduceat(size[k], starts) * TO_UM
        raised = at[k] + RAISED * apart * um / (float(size.max()) * TO_UM)
        figure.add_trace(go.Scatter(x=compact(middle), y=compact(raised, 6), mode="lines", fill="tozeroy",
                                    fillcolor="white", line={"color": AXIS_COLOURS["x"], "width": 1, "simplify": False},
                                    customdata=compact(um, 3), showlegend=False,
                                    hovertemplate=f"%{{customdata:.3g}} µm at %{{x:.0f}} Hz, {at[k]:.0f} rpm"
"<extra></extra>"))  # fmt: skip
    turning, low = np.abs(at[chosen]) / 60, float(at[chosen].min())
    edge = float(np.abs(middle).max())
    top, line = float(at.max()) + RAISED * apart, {"color": faint(INK, 0.6), "width": 1, "dash": "dot"}
    for n in (1, 2, 3) if run.lone else (-2, -1, 1, 2):
        if abs(n) * turning.max() <= edge:
            figure.add_trace(go.Scatter(x=compact(n * turning), y=compact(at[chosen], 6), mode="lines", line=line,
                                        hoverinfo="skip", showlegend=False))  # fmt: skip
            figure.add_annotation(x=n * turning.max(), y=top, text=f"{n}X".replace("-", "−"),
                                  showarrow=False, yanchor="bottom", yshift=2)  # fmt: skip
    figure.update_xaxes(title_text="frequency [Hz]", range=[float(middle[0]), float(middle[-1])])
    figure.update_yaxes(title_text="shaft speed [rpm]", range=[low - apart, top + 2 * apart])
    return style(figure, 620)


def spectrum_trace(run: AnalysedRun, axis: str, size: np.ndarray) -> go.Heatmap:
    """Heat map of the decimal logarithm of amplitudes (line, frequency) [m], at most 250 frequencies."""
    frequency = run.spectra[axis].values
    group = -(-frequency.size // MOST_LINES)
    starts = np.arange(0, frequency.size, group)
    um = np.maximum.reduceat(size, starts, axis=1).T * TO_UM
    at = np.add.reduceat(frequency, starts) / np.diff(np.append(starts, frequency.size))
    across, label = run.abscissa(run.spectra)
    unit, rising = label.split("[")[1][:-1], np.argsort(across, kind="stable")
    um = um[:, rising]
    return go.Heatmap(
        x=compact(across[rising], 6), y=compact(at), z=compact(np.log10(np.maximum(um, 1e-9)), 4),
        customdata=compact(um, 3), coloraxis="coloraxis",
        hovertemplate=f"%{{customdata:.3g}} µm at %{{y:.0f}} Hz, %{{x:.0f}} {unit}<extra></extra>",
    )  # fmt: skip


def add_order_lines(figure: go.Figure, run: AnalysedRun, orders: tuple[int, ...], row: int, col: int) -> None:
    """Dotted lines at multiples of the shaft speed, each labelled at its right end."""
    at, turning = run.abscissa(run.spectra)[0], np.abs(run.spectra["speed"].values) / (2 * np.pi)
    right = int(at.argmax())
    for n in orders if turning[right] > 0 else ():
        line = {"color": faint(INK, 0.45), "width": 1, "dash": "dot"}
        figure.add_trace(go.Scatter(x=compact(at), y=compact(n * turning), mode="lines", line=line,
                                    showlegend=False, hoverinfo="skip"), row, col)  # fmt: skip
        figure.add_annotation(x=max(float(at[right]), *run.reach), y=n * turning[right], 
                              text=f"{n}X".replace("-", "−"), showarrow=False,
                              xanchor="left", yanchor="middle", xshift=2, row=row, col=col)  # fmt: skip


def colour_axis(run: AnalysedRun) -> dict[str, object]:
    """Logarithmic colour scale in um, the same for all spectra of a run."""
    largest = max(float(run.spectra["full"].max()), float(run.spectra["amplitude"].max())) * TO_UM
    top = np.log10(max(largest, 1e-6))
    ticks = np.arange(np.ceil(top - DECADES), np.floor(top) + 1)
    bar = {"title": {"text": "µm 0-pk", "side": "right"}, "x": 1.04, "thickness": 14, "outlinewidth": 0,
           "tickvals": ticks, "ticktext": [f"{10.0**t:g}" for t in ticks]}  # fmt: skip
    return {"colorscale": SPECTRUM_SCALE, "cmin": top - DECADES, "cmax": top, "colorbar": bar}


def _finish(figure: go.Figure, run: AnalysedRun, height: int, label: str) -> go.Figure:
    figure.update_xaxes(title_text=run.abscissa(run.spectra)[1], range=run.reach)
    frequency = figure.data[0].y
    figure.update_yaxes(range=[min(0.0, float(frequency[0])), float(frequency[-1])])
    figure.update_yaxes(title_text=label, col=1)
    style(figure, height, coloraxis=colour_axis(run))
    for side in (figure.update_xaxes, figure.update_yaxes):
        side(showgrid=False)
    return figure


ORDERS = (1, 2, 3)
DEEPEST = 5.0
"""Decades of a logarithmic axis of amplitudes, at most."""


def _steady_spectrum(run: AnalysedRun) -> Any:
    need_time(run)
    need(not run.swept, "The speed changes; see the waterfall.")
    need_motion(run)
    return spectrum_of(run.record, run.output, run.highest_frequency)


def spectrum_caption(run: AnalysedRun, spectrum: Spectrum) -> str:
    """The strongest line and the quality of the estimate."""
    k, axis = np.unravel_index(int(spectrum.single.argmax()), spectrum.single.shape)
    full = int(spectrum.full.argmax())
    turn = "forward" if spectrum.signed[full] > 0 else "backward"
    line = f"{displacement(spectrum.full[full])} at {spectrum.signed[full]:.4g} Hz, {turn}"
    both = "" if run.lone else f"; of x + i y it is {line}"
    return (
        f"The strongest line is {displacement(spectrum.single.max())} 0-pk at {spectrum.frequency[k]:.4g} Hz, "
        f"{run.axes['xy'[axis]]}{both}. Hann window, root mean square of {spectrum.count} "
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
    rows = 1 if run.lone else 2
    figure = make_subplots(rows, 1, vertical_spacing=0.18)
    add_single(figure, spectrum, 1, run.axes)
    figure.update_xaxes(title_text="frequency [Hz]", range=[0, float(spectrum.frequency[-1])], row=1)
    edge = float(np.abs(spectrum.signed).max())
    shown = [(1, spectrum.single, ", ".join(run.axes.values()))]
    if not run.lone:
        figure.add_trace(_line(spectrum.signed, spectrum.full, "x + i y", NEUTRAL), 2, 1)
        figure.update_xaxes(range=[-edge, edge], title_text="frequency [Hz], backward below 0, forward above", row=2)
        shown.append((2, spectrum.full, "x + i y"))
    for row, values, what in shown:
        set_log_axis(figure, values[:, : len(run.axes)] if values.ndim > 1 else values, row)
        figure.update_yaxes(title_text=f"{what}<br>[µm 0-pk]", row=row)
    mark_orders(figure, run.turning, float(spectrum.frequency[-1]), 1, ORDERS)
    if not run.lone:
        mark_orders(figure, run.turning, edge, 2, (-3, -2, -1, *ORDERS))
    return style(figure, 640 if rows == 2 else 380)


def difference_caption(run: AnalysedRun, difference: SensorError) -> str:
    """Noise levels."""
    parts = [
        f"along {axis} {displacement(difference.rms[k])} rms and {displacement(difference.peak_to_peak[k])} pk-pk "
        f"about an offset of {displacement(difference.offset[k] + 0.0, '.3f')}"
        for k, axis in enumerate("xy")
    ]
    text = f"Measured less true displacement is {' and '.join(parts)}."
    return text + (" Lines at multiples of the shaft speed are runout." if run.revolutions >= 1 else "")


@record_section(
    "Measured against true displacement", lambda run: difference_of(run.record, run.highest_frequency),
    difference_caption,
)  # fmt: skip
def sensor_noise(run: AnalysedRun, difference: SensorError) -> go.Figure:
    """Spectrum [um 0-pk] of measured less true displacement.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.sensor_noise(record)
    """
    spectrum = difference.spectrum
    figure = make_subplots(1, 1)
    add_single(figure, spectrum, 1, run.axes)
    figure.update_xaxes(title_text="frequency [Hz]", range=[0, float(spectrum.frequency[-1])])
    set_log_axis(figure, spectrum.single, 1)
    figure.update_yaxes(title_text="difference [µm 0-pk]")
    mark_orders(figure, run.turning, float(spectrum.frequency[-1]), 1, ORDERS)
    return style(figure, 380)


def add_single(figure: go.Figure, spectrum: Spectrum, row: int, axes: Mapping[str, str]) -> None:
    """A line for each axis, of its label."""
    for k, (axis, name) in enumerate(axes.items()):
        trace = _line(spectrum.frequency, spectrum.single[:, k], name, AXIS_COLOURS[axis])
        figure.add_trace(trace.update(showlegend=True), row, 1)


def _line(frequency: np.ndarray, size: np.ndarray, name: str, colour: str) -> go.Scatter:
    return go.Scatter(x=compact(frequency, 6), y=compact(np.maximum(size * TO_UM, 1e-9)), mode="lines", name=name,
                      showlegend=False, line={"color": colour, "width": 1.2, "simplify": False},
                      hovertemplate="%{y:.3g} µm at %{x:.1f} Hz<extra></extra>")  # fmt: skip


def set_log_axis(figure: go.Figure, values: np.ndarray, row: int) -> None:
    """Decades below the largest value, no further than just below the usual floor."""
    um = np.maximum(values * TO_UM, 1e-9)
    top = float(np.log10(um.max())) + 0.4
    floor = max(float(np.log10(np.median(um))) - 1.0, top - DEEPEST)
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
