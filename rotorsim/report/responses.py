"""Responses to excitation: frequency responses, ring-down after impacts, static gain, hysteresis of the actuators."""

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.units import TO_UM
from rotorsim.report.page import AXIS_COLOURS, INK, PIN_COLOURS, compact, curve, faint, style
from rotorsim.report.run import AnalysedRun, analyse, record_section, sensed
from rotorsim.report.units import displacement, quantity
from rotorsim.signals import impact
from rotorsim.signals.impact import ModePair, RingDown
from rotorsim.signals.record_blocks import need, sampling_time
from rotorsim.signals.spectra import Transfer, peak_of, welch_transfer
from rotorsim.signals.static_gain import Branches, HysteresisLoop, loops as loops_of, static_gain as gains_of

UNITS = {"reference": "µm/V", "disc_force": "µm/N"}
NAMES = {"reference": "reference", "disc_force": "force"}
FAINTEST = 0.5
"""Least coherence at which a phase is drawn."""
DECADES = 3.0
"""Decades of the magnitude below its largest value, within which a phase is drawn."""
RESPONSE_REACH = 500.0
"""Highest frequency [Hz] of a frequency response."""
MOST_POINTS = 4000
PULSE_REACH = (-0.5, 2.0)
"""The force is drawn from before to after the pulse, in lengths of the pulse."""
MANY_MODES = 0.15
"""Least scatter of the logarithms of the extremes of a decay of several modes."""
SYMBOLS = {True: "triangle-up", False: "triangle-down-open"}


def _per_volt(run: AnalysedRun) -> Transfer:
    need("reference" in run.record, "The record has no reference of the actuators.")
    need("reference" in run.driven, "The reference of the actuators does not change.")
    return welch_transfer(run.record, run.driven["reference"], "reference", run.output, _reach(run))


def _reach(run: AnalysedRun) -> float:
    return min(RESPONSE_REACH, 0.4 / sampling_time(run.record))


def transfer_caption(run: AnalysedRun, transfer: Transfer) -> str:
    """Peaks of the direct responses, and their estimate."""
    peaks = [(k, *peak_of(transfer, k, i)) for i, k in enumerate(transfer.inputs)]
    unit = UNITS[transfer.input_name]
    parts = [f"{'xy'[k]} responds to {'xy'[k]} most at {f:.4g} Hz with {quantity(size * TO_UM, unit)}."
            for k, f, size in peaks if np.isfinite(f)]  # fmt: skip
    text = " ".join(parts) or "No peak stands out with a coherence above one half."
    times = "impact" if transfer.input_name == "disc_force" else "segment"
    if transfer.input_name == "disc_force" and "force_position" in run.record.attrs:
        text += f" The shaft was hit at {1e3 * float(run.record.attrs['force_position']):.6g} mm, not on the disc."
    text += f" H1 estimate from {transfer.count} {times}{'s' * (transfer.count > 1)}"
    text += "." if transfer.coherence is not None else "; a coherence takes more."
    if transfer.together:
        text += f" Both {NAMES[transfer.input_name]}s move together; their responses cannot be separated."
    if run.revolutions >= 1 and transfer.input_name == "reference":
        text += " The unbalance response lowers the coherence at multiples of the shaft speed."
    return text + sensed(run)


@record_section("Frequency response of the disc to the reference", _per_volt, transfer_caption)
def response_to_reference(run: AnalysedRun, transfer: Transfer) -> go.Figure:
    """Response of the disc to the reference [um/V]: magnitude over phase over coherence, a column an input."""
    return transfer_figure(transfer)


@record_section(
    "Frequency response of the disc to the force",
    lambda run: impact.impact_transfer(run.record, run.output, _reach(run)), transfer_caption,
)  # fmt: skip
def response_to_force(run: AnalysedRun, transfer: Transfer) -> go.Figure:
    """Response of the disc to impacts [um/N]: magnitude over phase over coherence, a column an input."""
    return transfer_figure(transfer)


def frequency_response(record: xr.Dataset) -> go.Figure:
    """Response of the disc to the reference [um/V], or to impacts [um/N] where the reference rests.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.frequency_response(record)
    """
    driven = analyse(record).driven
    draw = response_to_force if "reference" not in driven and "disc_force" in driven else response_to_reference
    return draw(record)


def transfer_figure(transfer: Transfer) -> go.Figure:
    """Magnitude [um per unit] over phase [deg] over coherence against frequency [Hz]; disc x and disc y in colour."""
    rows = 3 if transfer.coherence is not None else 2
    titles = [f"from {NAMES[transfer.input_name]} {'xy'[k]}" for k in transfer.inputs]
    figure = make_subplots(rows, len(titles), shared_xaxes=True, shared_yaxes=True, subplot_titles=titles,
                           vertical_spacing=0.04, horizontal_spacing=0.04,
                           row_heights=[0.5, 0.3, 0.2][:rows])  # fmt: skip
    for column in range(len(titles)):
        for output, axis in enumerate("xy"):
            for row, trace in enumerate(_traces(transfer, output, column, axis), 1):
                figure.add_trace(trace.update(showlegend=row == column + 1 == 1), row, column + 1)
    top = float(np.log10(np.nanmax(np.abs(transfer.H)) * TO_UM))
    figure.update_yaxes(type="log", range=[top - DECADES, top + 0.15], dtick=1, row=1)
    figure.update_yaxes(range=[-190, 190], tickvals=[-180, -90, 0, 90, 180], row=2)
    if rows == 3:
        figure.update_yaxes(range=[0, 1.05], tickvals=[0, 0.5, 1], row=3)
        figure.update_yaxes(title_text="coherence", row=3, col=1)
    figure.update_yaxes(title_text=f"magnitude [{UNITS[transfer.input_name]}]", row=1, col=1)
    figure.update_yaxes(title_text="phase [deg]", row=2, col=1)
    seen = transfer.frequency[np.isfinite(transfer.H).any(axis=(1, 2))]
    figure.update_xaxes(range=[0, 1.02 * float(seen.max())])
    figure.update_xaxes(title_text="frequency [Hz]", row=rows)
    return style(figure, 640 if rows == 3 else 520)


def _traces(transfer: Transfer, output: int, column: int, axis: str) -> list[go.Scatter]:
    """Magnitude, phase and, where there is one, coherence of one element."""
    H = transfer.H[:, output, column]
    phase = np.where(np.abs(H) > np.nanmax(np.abs(transfer.H)) * 10**-DECADES, np.degrees(np.angle(H)), np.nan)
    if transfer.coherence is not None:
        phase = np.where(transfer.coherence[:, output] >= FAINTEST, phase, np.nan)
    rows = [(np.abs(H) * TO_UM, UNITS[transfer.input_name]), (_gaps(phase), "deg")]
    if transfer.coherence is not None:
        rows.append((np.where(np.isfinite(H), transfer.coherence[:, output], np.nan), ""))
    lone = _is_sparse(H)
    common = {"mode": "lines+markers" if lone else "lines", "name": f"disc {axis}", "legendgroup": axis,
              "line": {"color": AXIS_COLOURS[axis], "width": 1 if lone else 1.8}, "marker": {"size": 4}}  # fmt: skip
    kept = np.isfinite(H) | (not lone)
    return [go.Scatter(x=compact(transfer.frequency[kept], 6), y=compact(y[kept]),
                       hovertemplate=f"%{{y:.3g}} {unit} at %{{x:.1f}} Hz<extra>disc {axis}</extra>", **common)
            for y, unit in rows]  # fmt: skip


def _is_sparse(H: np.ndarray) -> bool:
    """True if only lines here and there are driven, as by a multisine."""
    seen = np.isfinite(H)
    inside = seen[seen.argmax() : len(seen) - seen[::-1].argmax()]
    return bool(inside.mean() < 0.8)


def _gaps(phase: np.ndarray) -> np.ndarray:
    """Phase (n,) [deg] with a gap where it wraps."""
    jumps = np.abs(np.diff(phase)) > 270
    return np.where(np.append(False, jumps), np.nan, phase)


def ring_down_caption(run: AnalysedRun, downs: list[RingDown]) -> str:
    """Frequency and damping after each pulse."""
    place = run.record.attrs.get("force_position")
    hit = "" if place is None else f" The shaft was hit at {1e3 * float(place):.6g} mm, not on the disc."
    return " ".join(_decay_sentence(down) for down in downs) + hit + sensed(run)


def _decay_sentence(down: RingDown) -> str:
    axis = "xy"[down.pulse.axis]
    pair = "" if down.modes is None else _pair_sentence(down.modes)
    if down.decay is None:
        return f"Along {axis}: {down.why}{pair}"
    d = down.decay
    text = (
        f"Along {axis} the disc rings at {d.frequency:.4g} Hz with a logarithmic decrement of {d.decrement:.3g}, "
        f"a damping ratio of {d.zeta:.3g}, from {d.time.size} extremes."
    )
    if d.scatter > MANY_MODES:
        text += f" The extremes scatter by {100 * d.scatter:.0f} % about that decay: more than one mode rings."
    return text + pair


def _pair_sentence(modes: ModePair) -> str:
    """Both modes of the fit with two degrees of freedom."""
    clear = [f"{f:.4g} Hz, damping ratio {zeta:.3g}" for f, zeta, seen in
             zip(modes.frequency, modes.zeta, modes.clear, strict=True) if seen]  # fmt: skip
    if not clear:
        return " A fit of two modes to x and y together finds none above the noise."
    other = "" if len(clear) > 1 else "; a second one does not stand out of the noise"
    return (
        f" A fit of two modes to x and y together: {' and '.join(clear)}{other}. It explains "
        f"{100 * modes.explained:.3g} % of the energy."
    )


@record_section("Impact and ring-down", lambda run: impact.ring_downs(run.record, run.output), ring_down_caption)
def ring_down(run: AnalysedRun, downs: list[RingDown]) -> go.Figure:
    """Force pulse [N] and ring-down of the disc [um] after impacts, with the fitted decay.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.ring_down(impact)
    """
    titles = [f"impact along {'xy'[d.pulse.axis]}: {quantity(d.pulse.peak, 'N')}" for d in downs]
    figure = make_subplots(2, len(downs), subplot_titles=titles, vertical_spacing=0.16, horizontal_spacing=0.09,
                           row_heights=[0.32, 0.68])  # fmt: skip
    for column, down in enumerate(downs, 1):
        _add_force(figure, down, column)
        _add_motion(figure, down, column)
    figure.update_xaxes(title_text="time after the pulse begins [ms]", row=1)
    figure.update_xaxes(title_text="time after the pulse begins [s]", row=2)
    figure.update_yaxes(title_text="force [N]", row=1, col=1)
    figure.update_yaxes(title_text="disc [µm]", row=2, col=1)
    return style(figure, 600)


def _add_force(figure: go.Figure, down: RingDown, column: int) -> None:
    time, length = down.values["time"], max(down.pulse.stop - down.pulse.start, 2)
    dt = (time[-1] - time[0]) / (len(time) - 1)
    near = (time >= (PULSE_REACH[0] * length - 2) * dt) & (time <= (PULSE_REACH[1] * length) * dt)
    force = down.values["force"][near, down.pulse.axis]
    figure.add_trace(curve(time[near] * 1e3, force, INK, width=1.5, mode="lines+markers", marker={"size": 4},
                           showlegend=False, hovertemplate="%{y:.3g} N at %{x:.1f} ms<extra></extra>"),
                     1, column)  # fmt: skip


def _add_motion(figure: go.Figure, down: RingDown, column: int) -> None:
    time, d = down.values["time"], down.values["disc"] * TO_UM
    shown = slice(0, _end(down))
    step = 1 + len(time[shown]) // MOST_POINTS
    for k in (1 - down.pulse.axis, down.pulse.axis):
        axis = "xy"[k]
        line = {"color": AXIS_COLOURS[axis], "width": 1.4, "simplify": False}
        figure.add_trace(go.Scatter(x=compact(time[shown][::step]), y=compact(d[shown, k][::step]), mode="lines",
                                    name=f"disc {axis}", legendgroup=axis, legendrank=k,
                                    showlegend=column == 1, line=line,
                                    hovertemplate="%{y:.3g} µm at %{x:.4f} s<extra></extra>"), 2, column)  # fmt: skip
    if down.decay is None:
        return
    at = np.linspace(0, float(time[shown][-1]), 120)
    size = down.decay.amplitude * np.exp(-down.decay.rate * at) * TO_UM
    for sign in (1, -1):
        figure.add_trace(curve(at, sign * size, INK, "fitted envelope", 1.3, "dash", hoverinfo="skip",
                               legendgroup="fit", legendrank=2, showlegend=column == 1 and sign > 0),
                         2, column)  # fmt: skip


def _end(down: RingDown) -> int:
    """Samples drawn: until the fitted envelope has fallen to a fiftieth, or all."""
    time = down.values["time"]
    if down.decay is None or down.decay.rate <= 0:
        return len(time)
    return max(50, int(np.searchsorted(time, np.log(50) / down.decay.rate)))


def gain_caption(run: AnalysedRun, gains: list[Branches]) -> str:
    """Gains, and what departs from the line."""
    parts = []
    for g in gains:
        own, cross = g.gain[g.axis] * TO_UM, g.gain[1 - g.axis] * TO_UM
        a, b = "xy"[g.axis], "xy"[1 - g.axis]
        text = f"Reference {a} moves the disc by {quantity(own, 'µm/V')} along {a} and "
        text += f"{quantity(cross, 'µm/V', '.3f')} along {b}; "
        away = displacement(np.abs(g.deviation[:, g.axis]).max(), ".2g")
        text += f"the rests depart from the line by up to {away} along {a}"
        opening = g.opening[g.axis] * TO_UM
        text += (
            f", rising and falling branch by up to {quantity(opening, 'µm', '.2g')} from each other."
            if np.isfinite(opening)
            else "."
        )
        if g.other_moves:
            text += f" Reference {b} moves as well, so its share is in the line."
        parts.append(text)
    return " ".join(parts) + sensed(run)


@record_section("Static gain", lambda run: gains_of(run.holds), gain_caption)
def static_gain(run: AnalysedRun, gains: list[Branches]) -> go.Figure:
    """Rests of the disc [um] over the reference [V] of a staircase, with line and deviations.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steps = rs.experiments.staircase(plant, pressure=0.5e6, axis="x", step=1.0, hold=0.2)
    >>> figure = rs.report.static_gain(steps)
    """
    titles = [f"reference {'xy'[g.axis]}" for g in gains]
    figure = make_subplots(2, len(gains), shared_xaxes=True, shared_yaxes="rows", subplot_titles=titles,
                           vertical_spacing=0.06, horizontal_spacing=0.05, row_heights=[0.62, 0.38])  # fmt: skip
    for column, gain in enumerate(gains, 1):
        for k, axis in enumerate("xy"):
            _add_fit(figure, gain, k, axis, column)
            for row, values in ((1, gain.position - gain.offset), (2, gain.deviation)):
                for rising in (True, False):
                    figure.add_trace(_rests(gain, values[:, k] * TO_UM, rising, axis, row == column == 1), row, column)
        figure.update_xaxes(title_text=f"reference {'xy'[gain.axis]} [V]", row=2, col=column)
    figure.update_yaxes(title_text="disc at rest, from the<br>line's value at 0 V [µm]", row=1, col=1)
    figure.update_yaxes(title_text="deviation from<br>the line [µm]", row=2, col=1)
    figure.add_hline(y=0, line={"color": faint(INK, 0.5), "width": 1}, row=2)
    return style(figure, 600)


def _rests(gain: Branches, um: np.ndarray, rising: bool, axis: str, legend: bool) -> go.Scatter:
    chosen = gain.rising == rising
    return go.Scatter(
        x=compact(gain.reference[chosen]), y=compact(um[chosen]), mode="markers", showlegend=legend,
        name=f"disc {axis}, {'rising' if rising else 'falling'}", legendgroup=f"{axis}{rising}",
        marker={"color": AXIS_COLOURS[axis], "symbol": SYMBOLS[rising], "size": 8, "line": {"width": 1.2}},
        hovertemplate="%{y:.3g} µm at %{x:.3g} V<extra></extra>",
    )  # fmt: skip


def _add_fit(figure: go.Figure, gain: Branches, k: int, axis: str, column: int) -> None:
    ends = np.array([gain.reference.min(), gain.reference.max()])
    figure.add_trace(curve(ends, gain.gain[k] * ends * TO_UM, faint(AXIS_COLOURS[axis], 0.6), width=1.5,
                           hoverinfo="skip", showlegend=False), 1, column)  # fmt: skip


def _loops(run: AnalysedRun) -> list[HysteresisLoop]:
    need(run.holds.pin is not None, "The record has no pin positions.")
    found = loops_of(run.holds, gains_of(run.holds))
    need(bool(found), "The pins do not move.")
    return found


def loop_caption(run: AnalysedRun, loops: list[HysteresisLoop]) -> str:
    """Travel and opening of every loop."""
    parts = [
        f"pin {k.injector} travels {displacement(k.travel)}"
        + (f", its loop opens {displacement(k.opening, '.2g')} "
           f"({100 * k.opening / k.travel:.1f} % of the travel)"
           if np.isfinite(k.opening) else "")
        for k in loops
    ]  # fmt: skip
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}. The opening is the largest distance between the rising and falling branch."


@record_section("Hysteresis of the actuators", _loops, loop_caption)
def hysteresis_loops(run: AnalysedRun, loops: list[HysteresisLoop]) -> go.Figure:
    """Rests of the pins [um] over the reference [V] of a staircase.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steps = rs.experiments.staircase(plant, pressure=0.5e6, axis="x", step=1.0, hold=0.2)
    >>> figure = rs.report.hysteresis_loops(steps)
    """
    axes = sorted({loop.axis for loop in loops})
    figure = make_subplots(1, len(axes), shared_yaxes=True, horizontal_spacing=0.05,
                           subplot_titles=[f"pins driven by reference {'xy'[a]}" for a in axes])  # fmt: skip
    for loop in loops:
        figure.add_trace(_loop(loop), 1, axes.index(loop.axis) + 1)
    for column, axis in enumerate(axes, 1):
        figure.update_xaxes(title_text=f"reference {'xy'[axis]} [V]", row=1, col=column)
    figure.update_yaxes(title_text="pin at rest [µm]", row=1, col=1)
    return style(figure, 460)


def _loop(loop: HysteresisLoop) -> go.Scatter:
    colour = PIN_COLOURS[(loop.injector - 1) % len(PIN_COLOURS)]
    symbols = [SYMBOLS[bool(r)] for r in loop.rising]
    return curve(loop.reference, loop.pin * TO_UM, colour, f"pin {loop.injector}", 1.3, mode="lines+markers",
                 marker={"symbol": symbols, "size": 7},
                 hovertemplate=f"pin {loop.injector}: %{{y:.4g}} µm at %{{x:.3g}} V<extra></extra>")  # fmt: skip
