"""Report sections of a study of identification against physics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotorsim.report.page.page import Block
from rotorsim.study.figures import figures
from rotorsim.study.table import HEADS, rows, summary

if TYPE_CHECKING:
    from rotorsim.study.identification_vs_physics import Study


def identification_blocks(found: Study) -> list[Block]:
    """Sections of identification against physics."""
    errors = [(kind, name, value) for kind, table in summary(found).items() for name, value in table.items()]
    units = "Hz, um/V, ms, %. A delay of Model 3 holds actuators and film, the physics' the film alone."
    blocks = [
        Block("Identified models against the physics", "Errors over the grid in per cent. One lag for actuators and "
              "film lowers the damping and raises the gain of Model 3; Model 2 knows the pins.",
              ("model", "error", "%"), errors),
        *(Block(title, text, figure=figure) for title, text, figure in figures(found)),
        Block("Model 3, point by point", units, HEADS, rows(found)),
        Block("Model 2, point by point", "Hz, um/V, ms, %.", HEADS, rows(found, "2")),
    ]  # fmt: skip
    if found.failed:
        blocks.append(Block("Records that could not be identified", "", ("",), [(text,) for text in found.failed]))
    return blocks
