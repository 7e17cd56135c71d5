"""Figures of a diagnosis: flagged line groups, gap by record, spectra with noise floor, waterfalls.

Figures of a diagnosis at a glance: probabilities of the leading explanations, gap before and after."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.discrepancy.verdict import LEAST_SHOWN, Explanation, shown_share
from rotorsim.report.theme import AXIS_COLOURS, INK, NEUTRAL, SPECTRUM_SCALE, compact, phase_axes, style

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis

COLOURS = {"nominal": "#8a949e", "re-calibrated": AXIS_COLOURS["y"], "with effect": AXIS_COLOURS["x"]}


def flag_map(diagnosis: Diagnosis) -> go.Figure:
    """Flagged groups of lines over operating points: size of the residual over the floor."""
    flags = diagnosis.localisation
    points = list(dict.fromkeys(f"{f.record}: {f.point}" for f in sorted(flags, key=lambda f: f.number)))
    groups = list(dict.fromkeys(f"{f.group}, {f.channel}" for f in sorted(flags, key=lambda f: (f.group, f.channel))))
    z = np.full((len(points), len(groups)), np.nan)
    texts = [[""] * len(groups) for _ in points]
    for f in flags:
        texts[points.index(f"{f.record}: {f.point}")][groups.index(f"{f.group}, {f.channel}")] = f.place
        z[points.index(f"{f.record}: {f.point}"), groups.index(f"{f.group}, {f.channel}")] = f.rms / f.floor
    figure = go.Figure(
        go.Heatmap(
            z=compact(z), x=groups, y=points, colorscale=SPECTRUM_SCALE, zmin=0,
            colorbar={"title": "residual<br>over floor"},
            text=texts, hovertemplate="%{y}<br>%{x}<br>%{z:.3g} times the floor<br>%{text}<extra></extra>",
        )
    )  # fmt: skip
    figure = style(figure, max(280, 160 + 34 * len(points)))
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_xaxes(automargin=True)
    return figure


def gap_bars(diagnosis: Diagnosis) -> go.Figure:
    """Gap of every record and both channels together: nominal, re-calibrated, with the effect, and the scatter."""
    gap = diagnosis.gap
    total = np.sqrt(np.nansum(gap["gap"].values ** 2, axis=1)) * TO_UM
    order = np.argsort([("fit", "held_out", "untouched").index(r) for r in gap["role"].values], kind="stable")
    names: list[str] = []
    for i in order:
        name = f"{gap['role'].values[i].replace('_', ' ')}: {gap['point'].values[i]}"
        again = sum(n.startswith(name) for n in names)
        names.append(f"{name}, again" + ("" if again == 1 else f" ({again})") if again else name)
    figure = go.Figure()
    for s, (stage, colour) in enumerate(COLOURS.items()):
        if stage == "with effect" and not diagnosis.effects:
            continue
        figure.add_bar(y=names, x=compact(total[order, s]), name=stage, marker_color=colour, orientation="h")
    figure.add_scatter(
        y=names, x=compact(total[order, 3]), name="scatter of repeats", mode="markers",
        marker={"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": INK}},
    )  # fmt: skip
    figure = style(figure, 120 + 34 * len(names), barmode="group")
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_xaxes(title="gap [µm rms]", rangemode="tozero")
    return figure


def spectra(shown: dict[str, Any], with_effect: bool) -> go.Figure:
    """Lines of one record: measured, residual re-calibrated and with the effect, floor."""
    channels = shown["channels"]
    titles = [f"disc, {channel}" for channel in channels]
    figure = make_subplots(rows=len(channels), cols=1, shared_xaxes=True, subplot_titles=titles, vertical_spacing=0.1)
    f = compact(shown["frequency"])
    for c in range(len(channels)):
        first = c == 0
        lines = [("measured", shown["measured"][c], "#8a949e", 1), ("re-calibrated", shown["stages"][1][c],
                 COLOURS["re-calibrated"], 1.4)]  # fmt: skip
        if with_effect:
            lines.append(("with effect", shown["stages"][2][c], COLOURS["with effect"], 1.4))
        lines.append(("floor", shown["floor"][c], NEUTRAL, 1.4))
        for name, y, colour, width in lines:
            figure.add_scatter(
                x=f, y=compact(y * TO_UM), name=name, showlegend=first, legendgroup=name, mode="lines",
                line={"color": colour, "width": width, "dash": "dot" if name == "floor" else "solid"}, row=c + 1, col=1,
            )  # fmt: skip
    figure = style(figure, 560 if len(channels) > 1 else 360)
    figure.update_yaxes(type="log", title="amplitude [µm 0-pk]", exponentformat="power")
    figure.update_xaxes(title="frequency [Hz]", row=len(channels), col=1)
    return figure


def bode(parts: list[dict[str, Any]], number: int, with_effect: bool) -> go.Figure:
    """Amplitude and phase lag of one order over the speed: measured and simulated, before and after.

    `parts` are the parts of one table, whose rows belong to different roles.
    """
    channels = parts[0]["channels"]
    titles = [f"{what}, disc, {channel}" for what in ("amplitude", "phase lag") for channel in channels]
    figure = make_subplots(rows=2, cols=len(channels), shared_xaxes=True, subplot_titles=titles, vertical_spacing=0.1)
    order = np.argsort(np.concatenate([p["speeds"] for p in parts]))
    speeds = np.concatenate([p["speeds"] for p in parts])[order] * TO_RPM

    def joined(vectors: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([v[:, number] for v in vectors], axis=1)[:, order]

    curves = [("measured", joined([p["measured_vectors"] for p in parts]), INK, "markers")]
    for stage, (name, colour) in enumerate(COLOURS.items()):
        if name != "with effect" or with_effect:
            curves.append((name, joined([p["simulated_vectors"][stage] for p in parts]), colour, "lines"))
    middle = [np.pi / 2, np.pi / 2]
    for name, values, colour, mode in curves:
        for c in range(len(channels)):
            lag = np.unwrap(-np.angle(values[c]))
            lag -= 2 * np.pi * np.round((np.median(lag) - middle[c]) / (2 * np.pi))
            middle[c] = float(np.median(lag)) if name == "measured" else middle[c]
            for row, y in ((1, np.abs(values[c]) * TO_UM), (2, np.degrees(lag))):
                figure.add_scatter(
                    x=compact(speeds), y=compact(y), name=name, mode=mode, legendgroup=name,
                    showlegend=row == 1 and c == 0, marker={"color": colour, "size": 4},
                    line={"color": colour, "width": 1.6}, row=row, col=c + 1,
                )  # fmt: skip
    figure = style(figure, 560)
    figure.update_yaxes(title="amplitude [µm 0-pk]", row=1, col=1)
    phase_axes(figure, 2)
    figure.update_xaxes(title="speed [rpm]", row=2)
    return figure


def waterfall(diagnosis: Diagnosis, with_effect: bool) -> go.Figure:
    """Residual spectra of all records over the speed, before and after, disc x."""
    every = sorted((s for part in diagnosis.spectra.values() for s in part), key=lambda s: s["speed"])
    columns = 2 if with_effect else 1
    titles = ("re-calibrated", "with effect")[:columns]
    figure = make_subplots(rows=1, cols=columns, shared_yaxes=True, subplot_titles=titles, horizontal_spacing=0.05)
    top = max(float(s["stages"][1].max()) for s in every) * TO_UM
    for k in range(columns):
        for n, s in enumerate(every):
            size = np.hypot(*s["stages"][k + 1]) * TO_UM
            height = n + 1.6 * size / top
            figure.add_scatter(
                x=compact(s["frequency"]), y=compact(height), mode="lines", showlegend=False, fill=None,
                line={"color": list(COLOURS.values())[k + 1], "width": 1}, hovertext=s["point"], row=1, col=k + 1,
            )  # fmt: skip
        figure.update_xaxes(title="frequency [Hz]", row=1, col=k + 1)
    figure = style(figure, 140 + 38 * len(every))
    figure.update_yaxes(
        tickvals=list(range(len(every))), ticktext=[f"{s['speed'] * TO_RPM:.0f}" for s in every], title="", col=1, row=1
    )
    figure.update_yaxes(title="speed [rpm]", col=1)
    return figure


MOST, ALIKE = 5, 2
"""Explanations with a bar of their own, and indistinguishable ones that are named with it."""
LINE = 26
"""Characters of a line of a bar's name."""
ROLES = {"fit": "fitted", "held_out": "held out", "untouched": "untouched"}


def leading_odds(diagnosis: Diagnosis) -> go.Figure:
    """Probability [%] of the leading explanations; the rest together."""
    shown = [e for e in diagnosis.explanations if e.probability >= LEAST_SHOWN]
    rest = sum(e.probability for e in diagnosis.explanations) - sum(e.probability for e in shown[:MOST])
    bars = [(_name(e), e.probability, NEUTRAL if e.beyond or not e.effects else COLOURS["with effect"])
            for e in shown[:MOST]]  # fmt: skip
    bars += [("all others", rest, COLOURS["nominal"])] if rest >= 0.005 else []
    names, shares, colours = (list(column) for column in zip(*bars, strict=True))
    figure = go.Figure(
        go.Bar(
            x=[100 * share for share in shares], y=names, orientation="h", marker_color=colours, width=0.62,
            text=[f"<b>{shown_share(share)}</b>" for share in shares], textposition="outside", cliponaxis=False,
            hovertemplate="%{y}<br>%{x:.3g} %<extra></extra>",
        )
    )  # fmt: skip
    lines = sum(max(2, 1 + name.count("<br>")) for name in names)
    style(figure, max(170, 65 + 20 * lines))
    figure.update_layout(margin={"r": 72, "t": 8, "b": 42}, dragmode=False)
    figure.update_yaxes(autorange="reversed", automargin=True, ticks="", fixedrange=True)
    figure.update_xaxes(title="probability [%]", range=[0, 100], fixedrange=True)
    return figure


def _name(one: Explanation) -> str:
    """Name in lines, with the explanations that no record distinguishes from it."""
    alike = [" with ".join(keys) for keys in one.alike]
    texts = [one.name, *(f"or {name}" for name in alike[:ALIKE])]
    texts += [f"or {len(alike) - ALIKE} more"] if len(alike) > ALIKE else []
    return "<br>".join(line for text in texts for line in wrap(text, LINE, break_on_hyphens=False))


def stages_of(diagnosis: Diagnosis) -> dict[str, str]:
    """Stages of the gap that a diagnosis has, with their colours."""
    return {name: colour for name, colour in COLOURS.items() if name != "with effect" or diagnosis.effects}


def gap_by_role(diagnosis: Diagnosis) -> go.Figure:
    """Gap [um rms] of the records of each role: file as given, re-calibrated, with the effect, and the scatter."""
    gap = diagnosis.gap
    squares = np.nansum(gap["gap"].values ** 2, axis=1)
    own = {role: squares[gap["role"].values == role] for role in ROLES}
    own = {role: of_role for role, of_role in own.items() if len(of_role)}
    names = [f"{len(of_role)} {ROLES[role]}" for role, of_role in own.items()]
    size = np.array([np.sqrt(of_role.mean(axis=0)) for of_role in own.values()]).reshape(len(own), -1) * TO_UM
    figure = go.Figure()
    for stage, (name, colour) in enumerate(COLOURS.items()):
        if name in stages_of(diagnosis):
            figure.add_bar(
                y=names, x=compact(size[:, stage]), name=name, orientation="h",
                marker_color=colour, texttemplate="%{x:.2g}", textposition="outside", cliponaxis=False,
                textfont={"size": 11}, constraintext="none",
            )  # fmt: skip
    figure.add_scatter(
        y=names, x=compact(size[:, 3]), name="scatter", mode="markers",
        marker={"symbol": "line-ns", "size": 34, "line": {"width": 2, "color": INK}},
    )  # fmt: skip
    style(figure, 66 + 47 * len(names), barmode="group", bargap=0.12, dragmode=False)
    figure.update_layout(margin={"r": 45, "t": 6, "b": 42}, showlegend=False)
    figure.update_yaxes(autorange="reversed", automargin=True, ticks="", fixedrange=True)
    figure.update_xaxes(title="gap [µm rms]", rangemode="tozero", fixedrange=True)
    return figure
