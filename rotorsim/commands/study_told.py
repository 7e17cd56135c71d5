"""What `rotorsim study` says: a counter, the numbers for programs, the report."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.study.claims import Claim
    from rotorsim.study.identification_vs_physics import Study
    from rotorsim.study.targets import Target


class Counter:
    """Counts records on a terminal, is silent in a pipe."""

    def __init__(self, total: int) -> None:
        self.total, self.done = total, 0

    def __call__(self) -> None:
        self.done += 1
        if sys.stderr.isatty():
            end = "\n" if self.done == self.total else ""
            print(f"\r{self.done} of {self.total} operating points", end=end, file=sys.stderr, flush=True)


def numbers_of(found: Study, told: list[Claim], reached: list[Target]) -> dict[str, Any]:
    """Everything in the report as numbers and words."""
    from rotorsim.study.table import HEADS, rows, summary

    return {
        "errors": summary(found), "claims": [asdict(c) for c in told], "targets": [asdict(t) for t in reached],
        "heads": HEADS, "rows": rows(found), "rows_model_2": rows(found, "2"), "failed": found.failed,
    }  # fmt: skip


def write_page(found: Study, told: list[Claim], reached: list[Target], path: Path, machine: str) -> None:
    """The HTML report."""
    from rotorsim.report.study_page import Block, save_study_page
    from rotorsim.study.figures import figures
    from rotorsim.study.table import HEADS, rows, summary

    claims = [(f"{c.number} {c.claim}", c.thesis, c.ours, c.verdict, c.why) for c in told]
    aims = [
        (t.figure, f"{t.value:.3g} {t.unit}", f"{t.bound:g} {t.unit}", "met" if t.met else "not met", t.remark)
        for t in reached
    ]
    errors = [(kind, name, value) for kind, table in summary(found).items() for name, value in table.items()]
    says = "Hz, um/V, ms, %. A delay of Model 3 holds actuators and film, the physics' the film alone."
    blocks = [
        Block("Claims of the thesis", "", ("claim", "thesis", "here", "verdict", "why"), claims),
        Block("Aims", "", ("figure", "value", "bound", "verdict", "remark"), aims),
        Block("Identified models against the physics", "Errors over the grid in per cent. One lag for actuators and "
              "film lowers the damping and raises the gain of Model 3; Model 2 knows the pins.",
              ("model", "error", "%"), errors),
        *(Block(title, text, figure=figure) for title, text, figure in figures(found)),
        Block("Model 3, point by point", says, HEADS, rows(found)),
        Block("Model 2, point by point", "Hz, um/V, ms, %.", HEADS, rows(found, "2")),
    ]  # fmt: skip
    if found.failed:
        blocks.append(Block("Records that could not be identified", "", ("",), [(text,) for text in found.failed]))
    save_study_page("Identification against physics", f"{machine}, virtual records only. This is a simulation.",
                    blocks, path)  # fmt: skip
