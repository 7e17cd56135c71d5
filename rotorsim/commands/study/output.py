"""Printed output of `rotorsim study`: progress counter, JSON numbers, report."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from rotorsim.base.progress import line
from rotorsim.reproduction.claims.edited import edited_block, edited_markdown
from rotorsim.reproduction.claims.judge import Judged
from rotorsim.reproduction.claims.targets import Target
from rotorsim.reproduction.claims.verdicts import claims_blocks, lines, plain
from rotorsim.reproduction.identification_vs_physics import Study
from rotorsim.reproduction.pool import Progress
from rotorsim.reproduction.table import HEADS, rows, summary


def numbers_of(found: Study, claims: list[Judged], reached: list[Target]) -> dict[str, Any]:
    """Everything in the report as numbers and text."""
    return {
        "errors": summary(found), "claims": plain(claims), "targets": [asdict(t) for t in reached],
        "heads": HEADS, "rows": rows(found), "rows_model_2": rows(found, "2"), "failed": found.failed,
    }  # fmt: skip


def write_page(
    found: Study, claims: list[Judged], reached: list[Target], path: Path, machine: str, edited: list[str]
) -> None:
    """Write the HTML report."""
    from rotorsim.report.pages.study import save_study_page
    from rotorsim.reproduction.page import identification_blocks

    tables = claims_blocks(claims, "Claims on identification")
    blocks = [*edited_block(edited), *tables, *identification_blocks(found, reached)]
    save_study_page("Identification against physics", f"{machine}, virtual records only. This is a simulation.",
                    blocks, path)  # fmt: skip


def stage_bar() -> Progress:
    """One-line progress of the stages."""
    return lambda name, done, of: line(f"{done} of {of}: {name}", done == of)


def print_claims(claims: list[Judged], edited: list[str]) -> None:
    """Print which rules were edited since the first run, the verdicts, the figures behind them and their count."""
    print(edited_markdown(edited) + "\n".join(lines(claims)))
