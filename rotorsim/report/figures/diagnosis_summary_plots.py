"""Figures of a diagnosis at a glance: probabilities of the leading explanations, gap before and after."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go

from rotorsim.base.constants import TO_UM
from rotorsim.discrepancy.explanation import LEAST_SHOWN, Explanation, shown_share
from rotorsim.report.figures.diagnosis_plots import COLOURS
from rotorsim.report.figures.theme import INK, NEUTRAL, compact, style

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis

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


__all__ = ["gap_by_role", "leading_odds", "stages_of"]
