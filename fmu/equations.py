"""Equations and docstrings as HTML: equations become MathML, which browsers draw without scripts."""

from __future__ import annotations

import re
from html import escape
from itertools import pairwise

from latex2mathml.converter import convert

GAP = re.compile(r"\\q?quad(?![a-zA-Z])")
"""Space between the parts of an equation, at which a line may end."""
SYMBOL = re.compile(r"\\[A-Za-z]+(?:_\w)?")
"""Symbol of LaTeX within a sentence."""
DIRECTIVE = ".. math::"


def inline(latex: str) -> str:
    """An equation within a line."""
    return str(convert(latex))


def block(latex: str) -> str:
    """An equation of its own: a row for each of its lines, wrapped between its parts where the page is narrow."""
    whole = "begin{" in latex
    lines = [[latex]] if whole else [_parts(line.replace("&", "")) for line in latex.split(r"\\")]
    rows = ("".join(f"<span>{convert(part, display='block')}</span>" for part in parts) for parts in lines)
    return f'<div class="math">{"".join(f"<div>{row}</div>" for row in rows if row)}</div>'


def prose(docstring: str) -> str:
    """A docstring as HTML: paragraphs, and equations of the directive `math`."""
    return "\n".join(map(_paragraph, re.split(r"\n[ \t]*\n", docstring.strip())))


def _paragraph(text: str) -> str:
    before, directive, latex = text.partition(DIRECTIVE)
    head = f"<p>{_sentence(before)}</p>" if before.strip() else ""
    return head + (block(" ".join(latex.split())) if directive else "")


def _sentence(text: str) -> str:
    """Plain text, in which symbols of LaTeX are drawn."""
    words = " ".join(text.split())
    ends = [0, *(end for at in SYMBOL.finditer(words) for end in at.span()), len(words)]
    pieces = [words[a:b] for a, b in pairwise(ends)]
    return "".join(inline(piece) if k % 2 else escape(piece) for k, piece in enumerate(pieces))


def _parts(line: str) -> list[str]:
    """Parts of an equation between wide spaces that no bracket encloses."""
    parts, begin = [], 0
    for gap in GAP.finditer(line):
        before = line[: gap.start()]
        if before.count("{") == before.count("}") and before.count(r"\left") == before.count(r"\right"):
            parts.append(line[begin : gap.start()])
            begin = gap.end()
    return [part.strip() for part in [*parts, line[begin:]] if part.strip()]
