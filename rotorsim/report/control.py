"""Figures of identified models, and pages of a control law: its design on such a model, its verification."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.quantity import quantities
from rotorsim.base.units import MPA, TO_HZ, TO_MPA, TO_RPM, TO_UM, show
from rotorsim.control.catalogue import DESIGNS, make_spec
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
from rotorsim.report.page import (
    AXIS_COLOURS,
    INK,
    NEUTRAL,
    PIN_COLOURS,
    SPECTRUM_SCALE,
    Block,
    Page,
    compact,
    curve,
    page_of,
    style,
    write_page,
)
from rotorsim.report.units import quantity
from rotorsim.verify import Verification
from rotorsim.verify.runs import Run
from rotorsim.verify.transients import sentence

LOUD = 10.0
"""End [um] of a waterfall's colour scale: what is far into the whirl would hide all else."""
OPEN, CLOSED = "#8a949e", AXIS_COLOURS["x"]


def write_design(law: Law, model: Any, path: str | Path, units: str = "metric", figures: str | None = None) -> Path:
    """Write the page; raises WriteError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.write_design(law, lpv, "law.html").name
    'law.html'
    """
    return write_page(lambda: design_page(law, model), path, units, figures)


def design_page(law: Law, model: Any) -> Page:
    """Page of a design: sensitivities, damping over the operating range or modes at its only point, root locus."""
    speeds, pressures = fine_axes(law, model)
    corners = [(w, p) for w in {speeds[0], speeds[-1]} for p in {pressures[0], pressures[-1]}]
    rows = [_entry(key, value) for key, value in overview(law, model).items()]
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
    return Page(f"Design {law.name}", "A control law on its identified model.", blocks)


def _modes(law: Law, model: Any, point: tuple[float, float]) -> Block:
    """Frequencies and damping ratios without and with the law at one operating point."""
    plant = sampled_plant(model, *point, law.Ts)
    loops = (("open", np.linalg.eigvals(plant.A)), ("closed", closed_poles(plant, law_system(law, *point))))
    rows = [(name, float(abs(s) * TO_HZ), float(-s.real / abs(s))) for name, z in loops for s in oscillating(z, law.Ts)]
    heads = ("loop", "natural frequency [Hz]", "damping ratio")
    return Block("Modes", f"At {_point(*point)}, the point of the model, below 600 Hz.", heads, rows)


def _point(speed: float, pressure: float) -> str:
    """An operating point [rad/s], [Pa] in the units of the page."""
    return f"{speed * TO_RPM:.0f} rpm, {quantity(pressure / MPA, 'MPa')}"


def sensitivity_figure(law: Law, model: Any, points: list[tuple[float, float]]) -> go.Figure:
    """S, KS and GS over frequency."""
    figure = make_subplots(1, 3, subplot_titles=["S", "KS [V/µm]", "GS, G [µm/V]"])
    for k, (w, p) in enumerate(points):
        loop = loop_of(sampled_plant(model, w, p, law.Ts), law_system(law, w, p), law.Ts)
        name, colour = _point(w, p), PIN_COLOURS[k % len(PIN_COLOURS)]
        curves = ((1, loop.So, "solid"), (2, loop.KS, "solid"), (3, loop.GS, "solid"), (3, loop.G, "dot"))
        for column, matrices, dash in curves:
            figure.add_trace(curve(loop.frequency, largest(matrices), colour, name, 1.5, dash, mode=None,
                                   legendgroup=name, showlegend=column == 1), 1, column)  # fmt: skip
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
    figure.add_trace(curve(np.cos(turn), np.sin(turn), NEUTRAL, "unit circle", 1))
    for k in range(rows.shape[1]):
        figure.add_trace(go.Scatter(x=compact(rows[:, k].real), y=compact(rows[:, k].imag), mode="markers",
                                    marker={"size": 3, "color": AXIS_COLOURS["x"]}, showlegend=False))  # fmt: skip
    for index, symbol, name in ((0, "x", "open loop"), (40, "circle", "the law")):
        figure.add_trace(go.Scatter(x=compact(rows[index].real), y=compact(rows[index].imag), mode="markers", name=name,
                                    marker={"size": 8, "symbol": symbol, "color": AXIS_COLOURS["y"]}))  # fmt: skip
    figure.update_xaxes(range=[0.6, 1.05], title_text="Re z")
    figure.update_yaxes(range=[-0.3, 0.3], title_text="Im z")
    return style(figure, 460)


@page_of(Verification)
def verification_page(result: Verification) -> Page:
    """Page of a verification: criteria, impact responses, run-up, safe speed."""
    words = {True: "pass", False: "FAIL", None: "not judged"}
    rows: list[tuple[Any, ...]] = [
        (r.check, f"{r.measured:.4g} {r.unit}", "" if r.bound is None else f"{r.bound:.4g} {r.unit}", words[r.passed],
         r.remark)
        for r in result.rows
    ]  # fmt: skip
    verdict = "passed" if result.passed else "FAILED"
    remark = f" {result.remark[0].upper()}{result.remark[1:]}." if result.remark else ""
    edited = result.settings.get("edited", [])
    remark += f" Bounds were edited since: {'; '.join(edited)}." if edited else ""
    blocks = [
        Block("Criteria", f"{result.law.name} on {result.machine}: {verdict}.{remark}",
              ("criterion", "measured", "bound", "verdict", "remark"), rows),
        Block("Impact responses", "Norm of the disc's response over the force's during 0.1 s, along x and along y, "
              "at every operating point; the imbalance is taken out by a twin run without the hit.",
              figure=responses_figure(result)),
    ]  # fmt: skip
    if result.alarms:
        rows = [
            (a.run, "sound" if a.sound else "one hangs", f"{a.bad} of {a.samples}", a.sentence) for a in result.alarms
        ]
        text = "Runs in which an alarm suspended the law; with sound sensors it is a finding about the law's limits."
        blocks.append(Block("Alarms", text, ("run", "sensors", "samples", "alarm"), rows))
    if "runup" in result.runs:
        text = "Distance of the disc from its moving mean, largest in each tenth of a second, up and down again."
        blocks.append(Block("Run-up and coast-down", text, figure=runup_figure(*result.runs["runup"])))
    if "safe_speed" in result.runs:
        alone, held = result.runs["safe_speed"]
        found = sentence(alone, held)
        text = f"{found[0].upper()}{found[1:]}. Spectra of y over speed; one colour scale for both, which ends at "
        text += f"{quantity(LOUD, 'µm', 'g')}."
        text += "".join(f" Beyond the range in which the model was checked: {one}." for one in held.beyond)
        blocks.append(Block("Run-up extension", text, figure=waterfall_figure(alone.run, held.run)))
    rows = [("order", result.law.order), ("fingerprint", result.law.hash)]
    rows += _about(result.law)
    blocks.append(Block("The law", "", ("quantity", "value"), rows))
    head = f"A control law on the nonlinear plant: {verdict}{_failed(result)}."
    return Page(f"{result.law.name} on {result.machine}", head, blocks)


def _failed(result: Verification) -> str:
    """The criteria that failed, with measured value and bound, for the head of a page; empty where none did."""
    stated = [f"{r.check} {r.measured:.4g} {r.unit}".strip() + f" (bound {r.bound:.4g})"
              for r in result.rows if r.passed is False and r.bound is not None]  # fmt: skip
    return f": {'; '.join(stated)}" if stated else ""


def _entry(key: str, value: object) -> tuple[str, str]:
    """Row of a number, word or choice that a law states about itself."""
    words: dict[object, str] = {True: "yes", False: "no", None: "none"}
    name = key.replace("_", " ").removesuffix(" deg") + " [deg]" * key.endswith("_deg")
    if isinstance(value, bool) or value is None:
        return name, words[value]
    return name, f"{value:.5g}" if isinstance(value, float) else str(value)


def _about(law: Any) -> list[tuple[str, str]]:
    """Rows of what a law states about itself, its specification field by field with units."""
    rows = [_entry(key, value) for key, value in law.about.items() if not isinstance(value, dict)]
    spec = law.about.get("spec")
    if not isinstance(spec, dict):
        return rows
    design = str(law.about.get("design", law.name))
    return rows + list(_fields(spec, make_spec(design) if design in DESIGNS else None, "spec."))


def _fields(values: Mapping[str, Any], spec: Any, above: str = "") -> Iterator[tuple[str, str]]:
    """Rows of a stored specification; `spec` is one of the same class, from which units follow, or None."""
    units = quantities(spec) if is_dataclass(spec) else {}
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _fields(value, getattr(spec, name, None), f"{above}{name}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool) and name in units:
            number, _, unit = show(float(f"{value:.9g}"), units[name].unit).partition(" ")
            yield f"{above}{name}", quantity(float(number), unit, ".6g") if unit else number
        else:
            yield f"{above}{name}", _entry(name, value)[1]


def responses_figure(result: Verification) -> go.Figure:
    """Open and closed impact responses by point, and the closed over the open one."""
    figure = make_subplots(1, 2, subplot_titles=["hits along x", "hits along y"], shared_yaxes=True)
    order = sorted(range(len(result.open)), key=lambda k: (result.open[k].speed, result.open[k].pressure))
    opened, closed = ([values[k] for k in order] for values in (result.open, result.closed))
    names = [[f"{e.speed / 1000 * TO_RPM:.3g} krpm" for e in opened], [f"{e.pressure / MPA:.2f}" for e in opened]]
    for axis in range(2):
        for label, values, colour in (("open loop", opened, OPEN), ("closed loop", closed, CLOSED)):
            heights = [e.response[axis] for e in values]
            figure.add_trace(go.Bar(x=names, y=heights, name=label, marker_color=colour, legendgroup=label,
                                    showlegend=axis == 0), 1, axis + 1)  # fmt: skip
    figure.update_xaxes(title_text="pressure [MPa], speed", tickfont={"size": 10})
    figure.update_yaxes(title_text="response norm [µm/N]", col=1)
    return style(figure, 460, barmode="group")


def runup_figure(alone: Run, held: Run) -> go.Figure:
    """Vibration over time, with the speed."""
    figure = make_subplots(specs=[[{"secondary_y": True}]])
    window = alone.count(0.1)
    for name, run, colour in (("open loop", alone, OPEN), ("closed loop", held, CLOSED)):
        n = len(run.table) // window
        disc = run.disc[: n * window].reshape(n, window, 2)
        height = np.linalg.norm(disc - disc.mean(axis=1, keepdims=True), axis=2).max(axis=1) * TO_UM
        figure.add_trace(curve(run.time[: n * window : window], height, colour, name, mode=None))
    speed = alone.column("speed")[::window] * TO_RPM
    figure.add_trace(curve(alone.time[::window], speed, NEUTRAL, "speed", dash="dot", mode=None), secondary_y=True)
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text="vibration [µm]", secondary_y=False)
    figure.update_yaxes(title_text="speed [rpm]", secondary_y=True, showgrid=False, dtick=1000)
    return style(figure, 420)


def waterfall_figure(alone: Run, held: Run, highest: float = 400.0) -> go.Figure:
    """Spectra of y over speed for both runs."""
    figure = make_subplots(1, 2, subplot_titles=["open loop", "closed loop"], shared_xaxes=True, shared_yaxes=True)
    spectra = [spectra_of(run, highest) for run in (alone, held)]
    top = min(max(float(np.percentile(s[2], 99.8)) for s in spectra), LOUD)
    for k, (speed, frequency, heights) in enumerate(spectra):
        rpm = compact(speed * TO_RPM)
        figure.add_trace(go.Heatmap(x=compact(frequency), y=rpm, z=compact(heights, 3), zmin=0, zmax=top,
                                    colorscale=SPECTRUM_SCALE, showscale=k == 1, colorbar={"title": "µm"}),
                         1, k + 1)  # fmt: skip
        figure.add_trace(curve(speed / (2 * np.pi), rpm, INK, "1X", 1, "dot", showlegend=k == 0), 1, k + 1)
    figure.update_xaxes(title_text="frequency [Hz]", range=[0, highest])
    figure.update_yaxes(title_text="speed [rpm]", col=1)
    return style(figure, 520)


def spectra_of(run: Run, highest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean speeds (k,) [rad/s], frequencies (f,) [Hz], amplitudes (k, f) [um] of y in stretches of 0.2 s."""
    window = run.count(0.2)
    n = max(len(run.table) // window, 1)
    y = run.disc[: n * window, 1].reshape(n, -1) * TO_UM
    y = (y - y.mean(axis=1, keepdims=True)) * np.hanning(y.shape[1])
    heights = np.abs(np.fft.rfft(y, axis=1)) * 4 / y.shape[1]
    frequency = np.fft.rfftfreq(y.shape[1], run.Ts)
    keep = frequency <= highest
    return run.column("speed")[: n * window].reshape(n, -1).mean(axis=1), frequency[keep], heights[:, keep]


LINE = 60
MARKS = (("circle", 7), ("x-thin-open", 8), ("diamond-open", 7))


@dataclass(frozen=True)
class ComparedQuantity:
    """A quantity: title, values (k,) by the name of where they come from, surface f(speed, pressure) or None."""

    title: str
    values: dict[str, np.ndarray]
    surface: Callable[[float, float], float] | None = None


def over_speed(points: np.ndarray, panels: Sequence[ComparedQuantity]) -> go.Figure:
    """A panel per quantity over speed [rpm], a colour per pressure, a mark per source; points (k, 2) [rad/s, Pa]."""
    columns = 2
    count = -(-len(panels) // columns)
    figure = make_subplots(count, columns, subplot_titles=[p.title for p in panels], vertical_spacing=0.25 / count,
                           horizontal_spacing=0.09)  # fmt: skip
    for number, panel in enumerate(panels):
        at = {"row": number // columns + 1, "col": number % columns + 1}
        for k, pressure in enumerate(np.unique(np.round(points[:, 1], -3))):
            chosen = np.abs(points[:, 1] - pressure) < 1500
            colour = PIN_COLOURS[k % len(PIN_COLOURS)]
            for trace in _traces(panel, points, chosen, float(pressure), colour, number == 0):
                figure.add_trace(trace, **at)
    figure.update_xaxes(title_text="speed [rpm]", row=count)
    return style(figure, 240 * count + 160)


def _traces(
    panel: ComparedQuantity, points: np.ndarray, chosen: np.ndarray, pressure: float, colour: str, first: bool
) -> list[go.Scatter]:
    rpm, name, made = points[chosen, 0] * TO_RPM, f"{quantity(pressure * TO_MPA, 'MPa', '.2f')}", []
    for (label, values), (symbol, size) in zip(panel.values.items(), MARKS, strict=False):
        marker = {"color": colour, "symbol": symbol, "size": size, "line": {"color": colour, "width": 1.5}}
        made.append(go.Scatter(x=compact(rpm), y=compact(np.asarray(values)[chosen]), mode="markers", marker=marker,
                               name=f"{label}, {name}", legendgroup=name, showlegend=first))  # fmt: skip
    if panel.surface is not None and chosen.any():
        grid = np.linspace(points[chosen, 0].min(), points[chosen, 0].max(), LINE)
        heights = np.array([panel.surface(float(w), pressure) for w in grid])
        made.append(curve(grid * TO_RPM, heights, colour, name, 1, legendgroup=name, showlegend=False,
                          hoverinfo="skip"))  # fmt: skip
    return made


def fits_by_model(rows: Sequence[tuple[str, dict[str, np.ndarray]]]) -> go.Figure:
    """Validation fits [%], mean of x and y, by model; a line per operating point."""
    figure = go.Figure()
    for k, (at, fits) in enumerate(rows):
        means, colour = [100 * float(np.mean(f)) for f in fits.values()], PIN_COLOURS[k % len(PIN_COLOURS)]
        figure.add_trace(go.Scatter(x=list(fits), y=means, name=at, mode="lines+markers", line={"color": colour}))
    figure.update_yaxes(title_text="fit on the second record [%]")
    return style(figure, 420)
