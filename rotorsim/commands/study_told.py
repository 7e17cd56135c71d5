"""What `rotorsim study` says: a counter, the numbers for programs, the report."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.study.claims import Claim
    from rotorsim.study.identification_vs_physics import Study
    from rotorsim.study.pool import Told
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
    from rotorsim.report.study_page import save_study_page
    from rotorsim.study.page import claims_block, identification_blocks

    blocks = [claims_block(told), *identification_blocks(found, reached)]
    save_study_page("Identification against physics", f"{machine}, virtual records only. This is a simulation.",
                    blocks, path)  # fmt: skip


def stage_bar() -> Told:
    """Tells what ended and how many of how many, on one line of a terminal; silent in a pipe."""

    def told(name: str, done: int, of: int) -> None:
        if sys.stderr.isatty():
            end = "\n" if done == of else ""
            print(f"\r\x1b[2K{done} of {of}: {name}", end=end, file=sys.stderr, flush=True)

    return told


def print_claims(claims: list[Claim]) -> None:
    """One line for each."""
    for c in claims:
        print(f"{c.number:4s} {c.verdict:8s} {c.claim}: {c.ours}")
