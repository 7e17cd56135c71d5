"""Sphinx extension: equations as MathML, which browsers draw without scripts."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert


def inline(writer: Any, node: nodes.Element) -> None:
    """Write an equation within a line."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.Element) -> None:
    """Write an equation of its own, its lines below each other."""
    text = node.astext()
    lines = [text] if "begin{" in text else [line.replace("&", "") for line in text.split(r"\\")]
    equations = "".join(f"<div>{convert(line, display='block')}</div>" for line in lines if line.strip())
    writer.body.append(f'<div class="math" style="overflow-x: auto">{equations}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
