"""Report of a verification: criteria, impact responses, run-up, safe speed."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import MPA, TO_RPM, TO_UM
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures.theme import AXIS_COLOURS, INK, NEUTRAL, SPECTRUM_SCALE, compact, style
from rotorsim.report.pages.study import Block, study_page
from rotorsim.verify import Verification
from rotorsim.verify.runs import Run
from rotorsim.verify.safe_speed import sentence

LOUD = 10.0
"""End [um] of a waterfall's colour scale: what is far into the whirl would hide all else."""
OPEN, CLOSED = "#8a949e", AXIS_COLOURS["x"]


def page(result: Verification) -> str:
    """The page's text."""
    words = {True: "pass", False: "FAIL", None: "not judged"}
    rows = [
        (
            r.check,
            f"{r.measured:.4g} {r.unit}",
            "" if r.bound is None else f"{r.bound:.4g} {r.unit}",
            words[r.passed],
            r.remark,
        )
        for r in result.rows
    ]
    verdict = "passed" if result.passed else "FAILED"
    remark = f" {result.remark[0].upper()}{result.remark[1:]}." if result.remark else ""
    blocks = [
        Block("Criteria", f"{result.law.name} on {result.machine}: {verdict}.{remark}{_edited(result)}",
              ("criterion", "measured", "bound", "verdict", "remark"), rows),
        Block("Impact responses", "Norm of the disc's response over the force's during 0.1 s, along x and along y, "
              "at every operating point; the imbalance is taken out by a twin run without the hit.",
              figure=responses_figure(result)),
    ]  # fmt: skip
    if result.alarms:
        blocks.append(_alarms_block(result))
    if "runup" in result.runs:
        text = "Distance of the disc from its moving mean, largest in each tenth of a second, up and down again."
        blocks.append(Block("Run-up and coast-down", text, figure=runup_figure(*result.runs["runup"])))
    if "safe_speed" in result.runs:
        alone, held = result.runs["safe_speed"]
        found = sentence(alone, held)
        text = (
            f"{found[0].upper()}{found[1:]}. Spectra of y over speed; one colour scale for both, which ends at "
            f"{quantity(LOUD, 'µm', 'g')}."
        )
        text += "".join(f" Beyond the range in which the model was checked: {one}." for one in held.beyond)
        blocks.append(Block("Run-up extension", text, figure=waterfall_figure(alone.run, held.run)))
    about = [row for key, value in result.law.about.items() for row in _about(str(key), value)]
    blocks.append(
        Block(
            "The law",
            "",
            ("quantity", "value"),
            [("order", result.law.order), ("fingerprint", result.law.hash), *about],
        )
    )
    return study_page(f"{result.law.name} on {result.machine}", "A control law on the nonlinear plant.", blocks)


def _alarms_block(result: Verification) -> Block:
    """Table of the law's alarms by run."""
    rows = [(a.run, "sound" if a.sound else "one hangs", f"{a.bad} of {a.samples}", a.sentence) for a in result.alarms]
    text = "Runs in which an alarm suspended the law; with sound sensors it is a finding about the law's limits."
    return Block("Alarms", text, ("run", "sensors", "samples", "alarm"), rows)


def _edited(result: Verification) -> str:
    """Bounds that were edited since the first verification in the folder; empty without any."""
    sentences = result.settings.get("edited", [])
    return f" Bounds were edited since: {'; '.join(sentences)}." if sentences else ""


def _about(key: str, value: object) -> list[tuple[str, str]]:
    """Rows of an entry of what a law states about itself; of a table, such as a specification, one for each of its."""
    if isinstance(value, dict):
        return [(f"{key}: {name}", f"{v:.6g}" if isinstance(v, float) else str(v)) for name, v in value.items()]
    return [(key, str(value))]


def responses_figure(result: Verification) -> go.Figure:
    """Open and closed impact responses by point, and the closed over the open one."""
    figure = make_subplots(1, 2, subplot_titles=["hits along x", "hits along y"], shared_yaxes=True)
    names = [
        [f"{e.speed / 1000 * TO_RPM:.3g} krpm" for e in result.open],
        [f"{e.pressure / MPA:.2f}" for e in result.open],
    ]
    for axis in range(2):
        for label, values, colour in (("open loop", result.open, OPEN), ("closed loop", result.closed, CLOSED)):
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
        figure.add_trace(go.Scatter(x=compact(run.time[: n * window : window]), y=compact(height), name=name,
                                    line={"color": colour}))  # fmt: skip
    speed = alone.column("speed")[::window] * TO_RPM
    figure.add_trace(go.Scatter(x=compact(alone.time[::window]), y=compact(speed), name="speed",
                                line={"color": NEUTRAL, "dash": "dot"}), secondary_y=True)  # fmt: skip
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
        figure.add_trace(go.Scatter(x=compact(speed / (2 * np.pi)), y=rpm, mode="lines", name="1X",
                                    showlegend=k == 0, line={"color": INK, "width": 1, "dash": "dot"}), 1,
                         k + 1)  # fmt: skip
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
