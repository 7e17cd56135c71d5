"""Display of results: a short text, a small HTML table for notebooks from the same rows, the HTML report of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

CELL = "text-align:left;padding:1px 12px 1px 0;vertical-align:top"


class Card(NamedTuple):
    """Title of one line and rows (name, text) that display a value."""

    title: str
    rows: list[tuple[str, str]]


class Shown:
    """Base of values with a short `repr` and a table in notebooks; `card` has the rows."""

    def card(self) -> Card:
        """Title and rows."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return text(self.card())

    def _repr_html_(self) -> str:
        return html(self.card())


def text(card: Card) -> str:
    """One line: the title, and the rows that fit."""
    line = f"<{card.title}"
    for name, value in card.rows:
        more = f"{line}; {name} {value}"
        if len(more) > 160:
            break
        line = more
    return f"{line}>"


def html(card: Card) -> str:
    """Table with the title above; its colours are those of the notebook."""
    head = f'<th style="{CELL};font-weight:normal;opacity:.7">'
    cell = f'<td style="{CELL}">'
    rows = "".join(f"<tr>{head}{escape(name)}</th>{cell}{escape(value)}</td></tr>" for name, value in card.rows)
    return f"<div><strong>{escape(card.title)}</strong><table>{rows}</table></div>"


def several(values: Iterable[Any], form: str = ".4g", scale: float = 1.0, most: int = 4) -> str:
    """The first numbers of many, with commas."""
    numbers = list(values)
    shown = ", ".join(format(scale * float(one), form) for one in numbers[:most])
    return f"{shown}, ... ({len(numbers)})" if len(numbers) > most else shown


class Reported:
    """Base of results that `rotorsim.report.write` makes a page of."""

    writer: ClassVar[Callable[[Any, str | Path], Path]]

    def report(self, path: str | Path) -> Path:
        """Write the HTML report, complete or not at all; raises WriteError."""
        return Reported.writer(self, path)
