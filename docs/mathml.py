"""Sphinx extension: equations as MathML, which browsers draw without scripts."""

from __future__ import annotations

from typing import Any

from docutils import nodes

from fmu import contents


def inline(writer: Any, node: nodes.Element) -> None:
    """Write an equation within a line."""
    writer.body.append(contents.inline(node.astext()))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.Element) -> None:
    """Write an equation of its own."""
    writer.body.append(f'<div style="overflow-x: auto">{contents.block(node.astext())}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
