"""HTML page of a study: tables and figures in, self-contained page out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import plotly.io as pio
from plotly.offline import get_plotlyjs

from rotorsim.base.files import write_text
from rotorsim.report.pages.page import POLICY, TOOLS


@dataclass(frozen=True)
class Block:
    """A section: title, sentence, and a table (heads and rows) or a figure."""

    title: str
    text: str = ""
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    figure: go.Figure | None = None


def save_study_page(title: str, description: str, blocks: Sequence[Block], path: Path) -> None:
    """Write the page, complete or not at all; raises WriteError."""
    style = (files("rotorsim.report") / "page.css").read_text(encoding="utf-8")
    text = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(title)}</title><style>{style}</style><script>{get_plotlyjs()}</script></head><body>"
        f"<header><h1>{escape(title)}</h1><p>{escape(description)}</p></header>"
        f"{''.join(map(_section, blocks))}</body></html>\n"
    )
    write_text(path, text)


def _section(block: Block) -> str:
    inner = f"<p>{escape(block.text)}</p>" if block.text else ""
    if block.figure is not None:
        inner += pio.to_html(block.figure, full_html=False, include_plotlyjs=False, config=TOOLS)
    if block.rows:
        head = "".join(f"<th>{escape(h)}</th>" for h in block.heads)
        body = "".join("<tr>" + "".join(f"<td>{_cell(c)}</td>" for c in row) + "</tr>" for row in block.rows)
        inner += f'<div style="overflow-x:auto"><table><tr>{head}</tr>{body}</table></div>'
    return f"<section><h2>{escape(block.title)}</h2>{inner}</section>"


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else escape(str(value))


def figure_of(text: str | None) -> go.Figure | None:
    """The figure of its JSON, or None."""
    return None if text is None else pio.from_json(text)
