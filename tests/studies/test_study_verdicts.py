"""Verdict tables of a study: numbers, intervals and verdicts of every claim."""

import ast
import pkgutil
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import studies
from rotorsim.base.units import KRPM
from rotorsim.verify.runs import Run
from rotorsim.verify.transients import ring_down
from studies.thesis.claims import control_numbers, verdicts
from studies.thesis.claims.hysteresis import drift
from studies.thesis.claims.judge import VERDICTS
from studies.thesis.claims.rules import ClaimFigure, claims, first_claims, machines
from studies.thesis.control_cases import decrement, onset, peaks, two_modes
from studies.thesis.control_study import DESIGNS, ControlStudy
from studies.thesis.whole_study import layout

THESIS = {
    claim.number: {f.name: f.thesis for one in (*first_claims(), *claims()) if one.number == claim.number
                   for f in one.figures}
    for claim in claims()
}  # fmt: skip
"""The thesis' numbers of all figures, by the first rules and, over them, by those now."""
COUNT = ("20 met, 2 not comparable, 3 trivial; by the first rules 20 met, 1 near, 1 not comparable, 3 trivial; "
         "of those met I2, I3 by figures alone that the machines were fitted to; "
         "of claims added since 4 met, 1 trivial")  # fmt: skip
"""The first rules take C10's law to have 14 states."""


def test_the_thesis_own_numbers_leave_no_claim_open():
    found = verdicts.verdicts(THESIS)
    assert {one.verdict for one in found} == {"met", "trivial", "not comparable"}
    assert verdicts.lines(found)[-1] == COUNT


def test_a_study_without_numbers_meets_nothing():
    assert {one.verdict for one in verdicts.verdicts({})} == {"not met", "not comparable"}


def test_every_row_shows_both_numbers_both_intervals_and_the_verdict():
    ours = THESIS | {"I2": {"identification_x": 85.0}}
    table = verdicts.markdown(verdicts.verdicts(ours))
    assert "| fit, identification, x | 88.8 % (fitted) |  | 85 | 86.1 to 91.5 | 83.4 to 94.2 | near |  |" in table
    assert "| fit, second record, y | 84.1 % (fitted) |  | none | 80.7 to 87.5 | 77.3 to 90.9 | not met |  |" in table
    assert "| closed over open loop | 1.7 |  | 1.7 | from 1.7 | from 1.56 | met |  |" in table
    for claim in claims():
        assert f"### {claim.number}: " in table
        assert all(f"| {figure.words} | ".replace("|S|", r"\|S\|") in table for figure in claim.figures)


def test_a_figure_shows_the_first_rule_and_what_the_thesis_own_model_gives():
    ours = THESIS | {
        "C1": {"open": 0.05, "closed": 0.139, "lift": 8.74, "open_8": 0.016, "closed_8": 0.139, "lift_8": 8}
    }
    found = verdicts.verdicts(ours, "C")
    assert (found[0].verdict, found[0].old_verdict) == ("met", "not met")
    row = next(row for row in verdicts.markdown(found).splitlines() if row.startswith("| zeta_y without control"))
    assert "| 0.01297 (met) | 0.016 | 0.0106 to 0.0239 |" in row
    assert row.endswith("| met | 0.05; 0.0106 to 0.0239, 0.008 to 0.0318: not met |")
    hardening = next(row for row in verdicts.markdown(found).splitlines() if row.startswith("| hardening: peak"))
    assert "| 1.993 (near) |" in hardening


def test_claims_of_another_assembly_are_judged_by_its_numbers_and_by_the_study_s_own_by_the_first_rules():
    poor = {number: dict.fromkeys(figures, 1e9) for number, figures in THESIS.items()}
    found = verdicts.verdicts(poor, elsewhere=dict.fromkeys(machines(), THESIS))
    met = {one.claim.number for one in found if one.verdict == "met"}
    assert met == {"I9", "I10", "C1", "C3", "C4", "N3", "N5"}
    assert {one.old_verdict for one in found if one.claim.number in met} == {"not met", None}
    rows = verdicts.markdown(found).splitlines()
    row = next(row for row in rows if row.startswith("| slow pole, x | 3078 rad/s (fitted)"))
    assert "| 3078 | " in row and row.endswith("not met |")
    assert verdicts.plain(found)["I10"]["machine"] == "dtu_first_assembly"
    assert verdicts.plain(found)["C1"]["machine"] == "dtu_paper_a"
    assert verdicts.plain(found)["I8"]["machine"] is None
    alone = verdicts.verdicts(THESIS)
    assert {one.verdict for one in alone if one.claim.machine} == {"met", "not comparable"}


def test_claims_that_the_first_rules_do_not_have_show_no_verdict_by_them():
    (added,) = (one for one in verdicts.verdicts(THESIS, "N") if one.claim.number == "N2")
    assert added.old_verdict is None
    assert verdicts.plain([added])["N2"]["verdict_old_rules"] is None
    assert verdicts.tally(verdicts.verdicts(THESIS))["old_rules"]["met"] == 20


def of_page(text):
    """Anchors, verdicts and headings of the claims in Markdown."""
    rows = re.findall(r"^\| \[([ICN]\d+)\]\(#([a-z0-9-]+)\) \| ([a-z ]+) \|", text, re.M)
    return rows, re.findall(r"^### ([ICN]\d+): ([a-z ]+)$", text, re.M)


@pytest.mark.parametrize(
    ("text", "judged"),
    [
        ((Path(__file__).parents[2] / "studies" / "thesis" / "README.md").read_text(encoding="utf-8"), claims()),
        (verdicts.markdown(verdicts.verdicts({}, left_out={"C7"})), claims()),
    ],
    ids=["docs", "claims.md"],
)
def test_every_claim_stands_in_a_table_that_links_to_its_heading_with_the_same_verdict(text, judged):
    rows, headings = of_page(text)
    assert [number for number, _, _ in rows] == [claim.number for claim in judged]
    assert [(number, verdict) for number, _, verdict in rows] == headings
    assert [anchor for _, anchor, _ in rows] == [f"{n} {v}".lower().replace(" ", "-") for n, v in headings]


def test_the_page_counts_claims_and_figures():
    overview, figures, notes = verdicts.claims_blocks(verdicts.verdicts(THESIS))
    assert overview.text.startswith(f"{COUNT}.")
    assert len(overview.rows) == len(claims())
    assert len(figures.rows) == sum(len(claim.figures) for claim in claims())
    assert any("one-sided" in note for _, note in notes.rows)


def test_plain_values_hold_what_a_script_needs():
    row = verdicts.plain(verdicts.verdicts(THESIS, "C"))["C11"]
    gain = next(one for one in row["figures"] if one["name"] == "gain")
    assert (row["verdict_old_rules"], gain["thesis"], gain["ours"], gain["met"]) == ("met", 1.7, 1.7, [1.7, None])


OTHER_WORDS = {
    "edited.py": {"met", "near"},  # fields of a figure's rule
    "measures.py": {"met"},  # a word of the calibration's targets
}
"""Words that are verdicts' too and mean something else in a file."""


def verdicts_in(source):
    """Verdicts among the texts of a source file, whatever their case."""
    texts = {node.value.lower() for node in ast.walk(ast.parse(source))
             if isinstance(node, ast.Constant) and isinstance(node.value, str)}  # fmt: skip
    return texts & set(VERDICTS)


def test_no_verdict_is_written_into_code_outside_the_judge():
    root = Path(studies.__file__).parent / "thesis"
    sources = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8") for path in root.rglob("*.py")}
    assert verdicts_in(sources.pop("claims/judge.py")) == set(VERDICTS)
    modules = {one.name for one in pkgutil.walk_packages([str(root)], "studies.thesis.") if not one.ispkg}
    seen = {f"studies.thesis.{name.removesuffix('.py').replace('/', '.')}" for name in sources}
    assert modules - seen == {"studies.thesis.claims.judge"} and len(modules) > 20
    found = {Path(name).name: words for name, text in sources.items() if (words := verdicts_in(text))}
    assert found == OTHER_WORDS and OTHER_WORDS["edited.py"] <= {field.name for field in fields(ClaimFigure)}


def test_every_figure_of_control_has_a_part_that_makes_it(monkeypatch):
    """Laws that were not made leave their figures out; those that need none are there."""
    bare = {number for number, needed, _ in control_numbers._PARTS if not needed}
    monkeypatch.setattr(
        control_numbers, "_PARTS", tuple((n, laws, lambda *_: {"one": 1.0}) for n, laws, _ in control_numbers._PARTS)
    )
    known = control_numbers.control_numbers(ControlStudy(), None)
    assert list(known) == [f"C{n}" for n in range(1, 13)] + ["N2", "N3", "N4", "N5"]
    assert {number for number, figures in known.items() if figures} == bare


def test_claims_on_laws_that_a_quick_study_leaves_out_are_not_run_unless_one_was_refused():
    quick = ControlStudy(left_out=("lpv", "lpv thesis"))
    assert control_numbers.control_left_out(quick) == {"C6", "C7", "C8", "C9"}
    assert control_numbers.control_left_out(ControlStudy()) == set()
    quick.refused["hinf"] = "unstable"
    assert control_numbers.control_left_out(quick) == {"C6", "C8", "C9"}
    found = {one.claim.number: one for one in verdicts.verdicts({}, "C", {"C7", "C9"})}
    assert found["C7"].verdict == found["C9"].verdict == "not run" and found["C4"].verdict == "not met"
    assert verdicts.lines(list(found.values()))[-1].startswith("8 not met, 2 not run, 2 not comparable; by the first")


def test_the_claims_points_off_the_grid_get_records_of_their_own():
    extra = [(round(w / KRPM, 3), p) for w, p in layout().extra_points()]
    assert extra == [(5.3, 300000), (4.05, 500000), (4.2, 700000)]
    names = [name for name, _ in layout().texts()]
    assert [sum(name.startswith(kind) for name in names) for kind in ("grid-", "centres-", "extra-")] == [7, 6, 3]
    assert len(set(names)) == len(names) == 16


def test_no_two_records_of_a_speed_or_of_neighbouring_ones_share_a_random_sequence():
    found = [re.findall(r"^sequence = (\d+)", text, re.M) for _, text in layout().texts()]
    numbers = [number for some in found for number in some]
    assert len(numbers) == len(set(numbers)) == 7 * 2 + 6 + 3 * 2


def test_no_design_of_the_study_was_chosen_on_judged_points():
    assert "mild" not in {preset for _, preset, _ in DESIGNS.values()}


def test_frequency_and_damping_of_a_ring_down_are_found():
    t = np.arange(500) * 2e-4
    for zeta in (0.02, 0.1, 0.3):
        p = np.exp(-zeta * 750 * t) * np.sin(np.sqrt(1 - zeta**2) * 750 * t)
        assert ring_down(np.column_stack([p, 0 * t])) == (pytest.approx(750, rel=0.08), pytest.approx(zeta, rel=0.2))
    assert all(np.isnan(ring_down(np.full((500, 2), np.nan))))


TIME = np.arange(500) * 2e-4


def decay(w, zeta):
    """A free decay from one micrometre over TIME."""
    s = w * (-zeta + 1j * np.sqrt(1 - zeta**2))
    return 1e-6 * np.exp(s * TIME).real


@pytest.mark.parametrize("zeta", [(0.03, 0.02), (0.4, 0.3), (0.66, 0.45)])
def test_both_modes_of_added_answers_are_found_however_damped(zeta):
    motion = np.column_stack([decay(600, zeta[0]), decay(720, zeta[1])])
    wn, found = two_modes(TIME, motion)
    assert wn == pytest.approx([600, 720], rel=1e-3) and found == pytest.approx(zeta, rel=1e-2)
    assert np.isnan(two_modes(TIME, motion * np.nan)[1]).all()


@pytest.mark.parametrize("zeta", [0.016, 0.14, 0.6])
def test_the_damping_of_y_is_its_decrement_or_that_of_the_mode_it_shows(zeta):
    motion = np.column_stack([decay(600, 0.05), decay(720, zeta)])
    assert decrement(TIME, motion) == pytest.approx(zeta, rel=0.05)
    assert np.isnan(decrement(TIME, motion * np.nan))


def run_of(disc, speed):
    table = np.zeros((len(speed), 64))
    made = Run(table, np.zeros((len(speed), 6)))
    made.pair("disc")[:], made.column("speed")[:] = disc, speed
    return made


def test_peaks_of_a_run_up_are_found_along_each_axis():
    f = np.linspace(0, 100, 300_000)
    angle = np.cumsum(2 * np.pi * f * 2e-4)
    bumps = [sum(np.exp(-((f - at) ** 2)) for at in pair) for pair in ((38, 61), (44, 67))]
    found = peaks(run_of(1e-6 * np.column_stack(bumps) * np.cos(angle)[:, None], 2 * np.pi * f))
    assert found["third"] == [pytest.approx(38, abs=0.5), pytest.approx(44, abs=0.5)]
    assert found["half"] == [pytest.approx(61, abs=0.5), pytest.approx(67, abs=0.5)]
    assert np.isnan(peaks(run_of(np.zeros((5000, 2)), np.zeros(5000)))["half"]).all()


def test_whirl_is_measured_where_it_sets_on_and_not_at_the_end():
    t = np.arange(100_000) * 2e-4
    speed = np.linspace(1000, 2000, len(t))
    turn = np.cumsum(speed * 2e-4)
    share = np.where(speed < 1500, 0.45, 0.30)
    whirl = (speed > 1200) * 5.0 * np.sin(np.cumsum(share * speed * 2e-4))
    found = onset(np.column_stack([0 * t, np.sin(turn) + whirl]), speed)
    assert found == (pytest.approx(1200, rel=0.02), pytest.approx(0.45, rel=0.05))
    assert onset(np.column_stack([0 * t, np.sin(turn)]), speed) is None


def test_drift_is_the_change_after_a_step_has_settled():
    travel = np.concatenate([[0.0], np.full(1000, 2.0), np.full(49_000, 2.2)])
    assert drift(travel) == pytest.approx(0.1)
