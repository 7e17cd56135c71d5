"""Progress of a diagnosis by stage."""

from __future__ import annotations

import sys
import time

from rotorsim.base.progress import end_line, line, on_terminal

STAGES = {
    "compile": "compiling the machine with all candidate effects, on three grids and laws: about 50 s, once",
    "check": "checking the records",
    "calibrate": "re-calibrating",
    "prove": "proving the solver",
    "screen": "screening candidates",
    "name": "re-fitting candidates",
    "show": "showing the gap",
    "plan": "planning the next experiment",
    "experiment": "waiting for the record of the experiment",
}


class Stages:
    """Progress by stage on a terminal; in a pipe only that kernels are compiled."""

    def __init__(self) -> None:
        self.stage, self.steps, self.begin = "", 0, time.monotonic()

    def show(self, stage: str) -> None:
        """Note one step of a stage."""
        self.steps = self.steps + 1 if stage == self.stage else 1
        new, self.stage = stage != self.stage, stage
        if not on_terminal():
            if stage == "compile":
                print(STAGES[stage], file=sys.stderr, flush=True)
            return
        elapsed = time.monotonic() - self.begin
        if new and elapsed > 0.5:
            end_line()
        number = list(STAGES).index(stage) + 1
        bar = "#" * number + "." * (len(STAGES) - number)
        line(f"[{bar}] {STAGES[stage]}: step {self.steps}, {elapsed:.0f} s")
