"""HTML page of a study: tables and figures in, self-contained page out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import plotly.io as pio

from rotorsim.report.export.display_units import in_shown_units, label, unit_in
from rotorsim.report.export.page_files import write_page
from rotorsim.report.pages import html


@dataclass(frozen=True)
class Block:
    """A section: title, sentence, and a table (heads and rows) or a figure.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.Block("Modes", "Natural frequencies.", heads=("speed", "wn"), rows=[(100.0, 630.0)]).title
    'Modes'
    """

    title: str
    text: str = ""
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    figure: go.Figure | None = None


def save_study_page(title: str, description: str, blocks: Sequence[Block], path: str | Path, units: str = "metric",
                    figures: str | None = None) -> None:  # fmt: skip
    """Write the page, complete or not at all; raises WriteError.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> table = rs.report.Block("Modes", heads=("speed", "wn"), rows=[(100.0, 630.0)])
    >>> rs.report.save_study_page("Study", "Modes of a rotor.", [table], Path("study.html"))
    """
    write_page(lambda: study_page(title, description, blocks), path, units, figures)


def study_page(title: str, description: str, blocks: Sequence[Block]) -> str:
    """The page's text."""
    return html.document(title, title, description, "".join(map(_section, blocks)))


def _section(block: Block) -> str:
    inner = f"<p>{escape(block.text)}</p>" if block.text else ""
    if block.figure is not None:
        inner += html.drawn(block.figure)
    if block.rows:
        head = "".join(f"<th>{escape(label(h))}</th>" for h in block.heads)
        units = [unit_in(h) for h in block.heads]
        body = "".join(_row(row, units) for row in block.rows)
        inner += f'<div style="overflow-x:auto"><table><tr>{head}</tr>{body}</table></div>'
    return html.section(block.title, inner)


def _row(row: Sequence[Any], units: Sequence[str | None]) -> str:
    """A row of cells below heads with these units; one of another length has none."""
    own = units if len(units) == len(row) else [None] * len(row)
    return "<tr>" + "".join(f"<td>{_cell(c, unit)}</td>" for c, unit in zip(row, own, strict=True)) + "</tr>"


def _cell(value: Any, unit: str | None) -> str:
    if isinstance(value, float):
        return in_shown_units(f"{value:.4g}", unit) if isfinite(value) else "-"
    return escape(in_shown_units(str(value), unit))


def figure_of(text: str | None) -> go.Figure | None:
    """The figure of its JSON, or None."""
    return None if text is None else pio.from_json(text)
