"""Frame and parts of an HTML page that loads nothing from elsewhere: sections, tables, figures, key numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape, unescape
from importlib.resources import files
from typing import Any

import plotly.graph_objects as go
import plotly.io as pio
from plotly.offline import get_plotlyjs

from rotorsim.report.export.display_units import in_shown_units, is_imperial, label, micrometres, unit_in
from rotorsim.report.export.figure_units import imperial_figure

POLICY = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content policy by which the browser fetches nothing at all."""
FAR = 20_000
"""Characters before a figure in which the title of its section stands."""
PRINTING = """
const PAPER = {width: 660, height: 810, scale: 0.7}, COLUMN = {width: 318, height: 810, scale: 1};
const drawn = () => [...document.querySelectorAll('.plotly-graph-div')].filter(plot => plot.layout);
addEventListener('beforeprint', () => drawn().forEach(plot => {
  plot.onScreen = plot.onScreen || {height: plot.layout.height};
  const room = plot.closest('.first') ? COLUMN : PAPER;
  const height = Math.min(room.scale * plot.onScreen.height, room.height);
  Plotly.relayout(plot, {autosize: false, width: room.width, height: height});
}));
addEventListener('afterprint', () => drawn().forEach(plot => {
  Plotly.relayout(plot, {autosize: true, width: null, height: plot.onScreen.height});
}));
"""
"""Figures have the width of an A4 page, or of its columns, while it is printed, and none is higher than a page."""
TOOLS = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["select2d", "lasso2d"]}


def document(title: str, heading: str, introduction: str, body: str) -> str:
    """Text of a page; title, heading and introduction are plain text, the body is HTML."""
    style = (files("rotorsim.report") / "page.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(title)}</title><style>{style}</style><script>{get_plotlyjs()}</script>"
        f"<script>{PRINTING}</script></head><body>"
        f"<header><h1>{escape(heading)}</h1><p>{escape(introduction)}</p></header>{micrometres(body)}</body></html>\n"
    )


def section(title: str, inner: str) -> str:
    """A section of HTML under a plain title."""
    return f"<section><h2>{escape(title)}</h2>{inner}</section>"


def figure_section(title: str, caption: str, figure: go.Figure, after: str = "") -> str:
    """A section with a caption, an interactive figure and further HTML."""
    return section(title, f"<p>{escape(caption)}</p>{drawn(figure)}{after}")


def drawn(figure: go.Figure, tools: bool = True) -> str:
    """An interactive figure as HTML, with a toolbar in a strip of its own above it or without one."""
    config = TOOLS | ({} if tools else {"displayModeBar": False})
    shown: Any = imperial_figure(json.loads(figure.to_json())) if is_imperial() else figure
    text = pio.to_html(shown, full_html=False, include_plotlyjs=False, config=config, validate=False)
    return f'<div class="figure{"" if tools else " plain"}">{text}</div>'


@dataclass(frozen=True)
class Drawn:
    """A figure in a page: title of its section, data and layout, and where these stand in the page's text."""

    title: str
    figure: dict[str, Any]
    begin: int
    end: int


def figures_of(page: str) -> list[Drawn]:
    """Every figure that `drawn` put into a page, in order."""
    found = []
    for at in re.finditer(r'Plotly\.newPlot\(\s*"[^"]*",\s*', page):
        data, end = json.JSONDecoder().raw_decode(page, at.end())
        layout, end = json.JSONDecoder().raw_decode(page, page.index("{", end))
        titles = re.findall(r"<h2>(.*?)</h2>", page[max(0, at.start() - FAR) : at.start()], re.DOTALL)
        title = unescape(titles[-1]) if titles else "figure"
        found.append(Drawn(title, {"data": data, "layout": layout}, at.end(), end))
    return found


def table(rows: Iterable[Sequence[str]], heads: Iterable[Sequence[str]] = ()) -> str:
    """Table of plain text below one or more rows of heads."""
    lines = list(heads)
    units = [unit_in(h) for h in lines[-1]] if lines else []
    top = "".join("<tr>" + "".join(f"<th>{escape(label(h))}</th>" for h in line) + "</tr>" for line in lines)
    body = "".join("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in _shown(row, units)) + "</tr>" for row in rows)
    return f"<table>{top}{body}</table>"


def _shown(row: Sequence[str], units: Sequence[str | None]) -> Sequence[str]:
    """Cells below heads with these units, in the units of the page."""
    if len(units) != len(row):
        return row
    return [in_shown_units(cell, unit) for cell, unit in zip(row, units, strict=True)]


def coloured(text: str, colour: str) -> str:
    """Plain text behind a patch of the colour that it has in a figure."""
    return f'<span class="coloured"><i style="background:{colour}"></i>{escape(text)}</span>'


def key_numbers(pairs: Iterable[tuple[str, str]]) -> str:
    """Cards of the first numbers that a reader looks for, each with its name."""
    return f'<div class="key">{"".join(f"<div><b>{a}</b><span>{b}</span></div>" for a, b in pairs)}</div>'
