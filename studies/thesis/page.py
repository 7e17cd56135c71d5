"""Report sections of the study of control, and of the aims of identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.io as pio

from rotorsim.base.units import TO_HZ
from rotorsim.machine import load_machine
from rotorsim.report.page import Block
from studies.thesis.claims.judge import MET, NOT_MET
from studies.thesis.claims.rules import as_run_values, as_run_why
from studies.thesis.claims.targets import FigureTarget
from studies.thesis.control_study import ControlStudy
from studies.thesis.figures import ratios_figure, reach_figure, sizes_figure, waterfalls_figure

VERDICTS = {True: "pass", False: "FAIL", None: "not judged"}


def as_run_block() -> Block:
    """Section of the changes to the machine files that make them the thesis' rig as it was run."""
    why = as_run_why()
    text = f"{why.why} (lines {why.lines}). Known before: {why.seen}."
    return Block("The rig as it was run", text, ("field", "value"), _values())


def _values() -> list[tuple[str, str]]:
    """Fields and values of the rig as it was run, a row for each of an effect's tables."""
    rows = []
    for path, value in as_run_values().items():
        tables = value if isinstance(value, list) else [value]
        rows += [(path, ", ".join(f"{k} {v}" for k, v in one.items()) if isinstance(one, dict) else str(one))
                 for one in tables]  # fmt: skip
    return rows


def aims_block(reached: Sequence[FigureTarget]) -> Block:
    """Section of the aims of identification."""
    aims = [
        (t.figure, f"{t.value:.3g} {t.unit}", f"{t.bound:g} {t.unit}", MET if t.met else NOT_MET, t.remark)
        for t in reached
    ]
    return Block("Aims of identification", "", ("figure", "value", "bound", "verdict", "remark"), aims)


def control_blocks(found: ControlStudy) -> list[Block]:
    """Sections of the study of control."""
    ratios = {name: found.ratio(name) for name in found.impacts if name != "open loop"}
    runs = {"open loop": found.safe["open loop"]} | found.safe
    blocks = [
        Block("Hits", "Norms of the responses to hits of 20 N over those of the open loop: twenty operating points, "
              "two directions.", figure=ratios_figure(ratios)),
        Block("Hits in numbers", "Mean of the twenty points, the worst, how many of them got worse, control effort.",
              ("law", "x", "y", "worst", "above 1", "effort x, y [V/N]", "smallest damping"), _responses(found)),
        Block("Hits at points held out", "Neither the twenty nor those that the weights were chosen at.",
              ("law", "x", "y", "worst", "above 1", "effort x, y [V/N]"), _held_out(found)),
        Block("Hits of other sizes", "A linear loop would draw level lines.", figure=sizes_figure(found.by_size)),
        Block("How far a run-up reaches", "At 0.3 MPa, 2000 rpm in a second, up to 600 Hz: where the disc leaves a "
              "circle of 20 um about its equilibrium for three samples, and from where on whirl below 0.7 of the "
              "shaft's speed stays the largest part.", figure=reach_figure(runs)),
        Block("Safe speed and whirl", _checked(),
              ("law", "circle left", "gain", "onset of whirl", "postponed by", "end"), _reach(found)),
        Block("Waterfalls", "Spectra of y over shaft speed; the colour scale ends at 5 um.",
              figure=waterfalls_figure(runs)),
        Block("Loops on the model", "Over the model's range; sensitivity and margins at the law's own point.",
              ("law", "order", "gamma", "unstable", "smallest damping", "peak of S", "disk margin"), _loops(found)),
    ]  # fmt: skip
    for name, result in found.verified.items():
        rows = [(r["check"], f"{r['measured']:.4g} {r['unit']}", "" if r["bound"] is None else f"{r['bound']:.4g}",
                 VERDICTS[r["passed"]], r["remark"]) for r in result["rows"]]  # fmt: skip
        text = "Passed." if result["passed"] else "FAILED."
        blocks.append(Block(f"Verification of {name}", text, ("criterion", "measured", "bound", "", "remark"), rows))
    if found.refused:
        blocks.append(Block("Refused designs", "", ("design", "why"), list(found.refused.items())))
    return blocks


def _responses(found: ControlStudy) -> list[tuple[str, ...]]:
    return [(*_response_row(name, found.ratio(name), found.effort(name)), f"{found.damping(name):.3f}")
            for name in found.impacts if name != "open loop"]  # fmt: skip


def _held_out(found: ControlStudy) -> list[tuple[str, ...]]:
    return [_response_row(name, found.held_ratio(name), found.held_effort(name)) for name in found.held_out
            if name != "open loop"]  # fmt: skip


def _response_row(name: str, ratio: np.ndarray, effort: np.ndarray) -> tuple[str, ...]:
    above = np.count_nonzero(~(ratio.max(axis=1) <= 1))
    return (name, f"{ratio[:, 0].mean():.3f}", f"{ratio[:, 1].mean():.3f}", f"{ratio.max():.3f}",
            f"{above} of {len(ratio)}", f"{effort[0]:.3f}, {effort[1]:.3f}")  # fmt: skip


def _reach(found: ControlStudy) -> list[tuple[str, ...]]:
    alone = found.safe["open loop"]
    rows: list[tuple[str, ...]] = []
    for name, result in ({"open loop": alone} | found.safe).items():
        mark, first, own = "" if result["left"] else "> ", alone["onset"], result["onset"]
        onset = "none" if own is None else f"{own * TO_HZ:.0f} Hz"
        later = "" if first is None else "beyond the end" if own is None else f"{(own - first) * TO_HZ:+.0f} Hz"
        rows.append((name, f"{mark}{result['speed'] * TO_HZ:.0f} Hz", f"{mark}{result['speed'] / alone['speed']:.2f}",
                     onset, later, result["why"]))  # fmt: skip
    return rows


def _checked() -> str:
    """A sentence about the speeds at which the rig's model was compared with measurements."""
    checked = load_machine("dtu_gas_bearing").checked
    assert checked is not None
    return (
        f"The rig's model was compared with measurements up to {checked.highest_speed * TO_HZ:.0f} Hz "
        f"({checked.against}); speeds above it are what the model computes, and nothing has checked them."
    )


def _loops(found: ControlStudy) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for name, result in found.overview.items():
        if result:
            gamma = f"{result['gamma']:.4g}" if "gamma" in result else ""
            damping = f"{result['smallest_damping_open']:.3f} -> {result['smallest_damping_closed']:.3f}"
            rows.append((name, str(found.laws[name].order), gamma, str(result["unstable_points"]), damping,
                         f"{result['peak_sensitivity']:.2f}", f"{result['disk_margin']:.2f}"))  # fmt: skip
    return rows


def plain_blocks(blocks: Sequence[Block]) -> list[dict[str, Any]]:
    """Blocks of title, text, table and figure as plain JSON, in metric units; `blocks_of` makes them again."""
    return [
        {"title": b.title, "text": b.text, "heads": list(b.heads), "figure": b.figure and b.figure.to_json(),
         "rows": [[v if isinstance(v, (str, int, float)) else str(v) for v in row] for row in b.rows]}
        for b in blocks
    ]  # fmt: skip


def blocks_of(stored: Sequence[Mapping[str, Any]]) -> list[Block]:
    """Blocks from plain JSON."""
    return [Block(**{**one, "figure": one["figure"] and pio.from_json(one["figure"])}) for one in stored]
