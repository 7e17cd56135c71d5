"""Rules for the claims of the thesis, tested with synthetic numbers on both sides of every interval."""

import math
from dataclasses import replace

import pytest

from rotorsim.machine import load_machine, shipped_machines
from rotorsim.study.identify_records import StudyGrid
from rotorsim.verify.transients import POINTS as TWENTY
from studies.thesis.claims.judge import (
    MET,
    NEAR,
    NOT_COMPARABLE,
    NOT_MET,
    NOT_RUN,
    TRIVIAL,
    VERDICTS,
    count,
    judge,
    judge_claim,
    judge_figure,
)
from studies.thesis.claims.rules import AMENDED, _file, as_run, as_run_why, claims, first_claims, machines, points
from studies.thesis.weight_search import POINTS as CHOSEN_AT

ADDED = [f"N{n}" for n in range(1, 6)]
FIRST = [f"I{n}" for n in range(1, 14)] + [f"C{n}" for n in range(1, 13)]
EVERY = (*claims(), *(claim for claim in first_claims() if claim not in claims()))
"""Claims by the rules as they are now, and those by the first rules that were amended."""
FIGURES = {f"{claim.number}.{figure.name}": figure for claim in EVERY[::-1] for figure in claim.figures}
NUMBERS = {key: figure for key, figure in FIGURES.items() if figure.kind != NOT_COMPARABLE}
of_each_claim = pytest.mark.parametrize("claim", EVERY, ids=lambda claim: claim.number)


def beyond(limit, towards):
    """A number a little further out than a limit."""
    return limit + towards * 1e-6 * max(abs(limit), 1.0)


def comparable(claim):
    return [figure for figure in claim.figures if figure.kind != NOT_COMPARABLE]


def test_every_claim_has_rules_and_the_first_ones_stay():
    assert [claim.number for claim in first_claims()] == FIRST
    assert [claim.number for claim in claims()] == FIRST + ADDED
    assert all(claim.figures and claim.source and claim.why and points(claim.points) for claim in EVERY)


def test_an_amended_rule_states_lines_reason_what_was_known_and_which_figure_it_replaces():
    first = {claim.number: claim for claim in first_claims()}
    changed = [claim for claim in claims() if claim.amendment]
    assert [claim.number for claim in changed] == ["I5", "I7", *(f"C{n}" for n in (1, 2, 3, 4, 5, 7, 8, 10)), *ADDED]
    for claim in changed:
        assert claim.amendment.lines and claim.amendment.why and claim.amendment.seen
        assert claim.added == (claim.number in ADDED)
        if claim.added:
            continue
        old = {figure.name: figure for figure in first[claim.number].figures}
        assert len(claim.figures) == len(old)
        for figure in claim.figures:
            same = figure.old or replace(old[figure.name], fitted=figure.fitted) == figure
            assert (figure.old in old) if figure.old else same
            was = old.get(figure.old, figure)
            changes = figure.old and (figure.name, figure.met, figure.kind) != (figure.old, was.met, was.kind)
            assert bool(changes) == bool(figure.old), figure.name
    for claim in claims():
        assert claim.amendment or claim.moved or _unmarked(claim) == _unmarked(first[claim.number])


def _unmarked(claim):
    return replace(claim, figures=tuple(replace(figure, fitted=False) for figure in claim.figures))


def test_the_rig_as_it_was_run_is_a_valid_machine_with_the_stated_values_and_what_they_are_fitted_to():
    """Each figure that a value is fitted to is marked; the machines differ in these values alone."""
    machine = load_machine("dtu_gas_bearing")
    ran = as_run(machine)
    assert ran.effects["noise"] == machine.effects["noise"] and ran.effects["speed_wander"][0].sd == 0.005
    steady, growing = ran.effects["broadband_force"]
    assert (steady.exponent, growing.exponent) == (0.0, 2.0) and steady.corner == growing.corner
    assert set(ran.effects) - set(machine.effects) == {"speed_wander", "broadband_force"}
    assert ran.with_({"effects": machine.effects}).hash == machine.hash
    marked = {f"{claim.number}.{figure.name}" for claim in claims() for figure in claim.figures if figure.fitted}
    assert {"I2.identification_x", "I3.validation_y", "I4.before", "I5.ahead_rise", "C11.open"} <= marked
    assert as_run_why().seen and as_run_why().why


def test_claims_of_papers_a_to_d_are_measured_on_their_assemblies_by_the_same_intervals():
    first = {claim.number: claim for claim in first_claims()}
    moved = [claim for claim in claims() if claim.moved]
    assert [claim.number for claim in moved] == ["I9", "I10", "C1", "C2", "C3", "C4", "N3", "N5"]
    assert {claim.machine for claim in moved} == machines().keys() <= set(shipped_machines())
    assert {claim.number for claim in moved if claim.machine == "dtu_paper_a"} == {"C1", "N5"}
    assert all(points(grid) for grid in machines().values())
    for claim in moved:
        assert claim.moved.lines and claim.moved.why and claim.moved.seen
        if not claim.amendment:
            assert replace(claim, figures=(), machine="", moved=None) == replace(first[claim.number], figures=())
            kept = [replace(figure, fitted=False) for figure in claim.figures]
            assert kept == [replace(figure, fitted=False) for figure in first[claim.number].figures]
    assert not any(claim.machine for claim in (*first_claims(), *(one for one in claims() if not one.moved)))
    fitted = {f"{claim.number}.{f.name}" for claim in moved for f in claim.figures if f.fitted}
    assert fitted == {name for one in _file(AMENDED)["machines"].values() for name in one["fitted"]}


def test_delays_of_e2_are_judged_by_the_scatter_that_the_thesis_prints():
    (claim,) = (claim for claim in claims() if claim.number == "I7")
    scatter = {"x": 0.088, "y": 0.041}
    for figure in claim.figures:
        if figure.name.startswith("tau"):
            one = scatter[figure.name[4]]
            for share, interval in ((1, figure.met), (2, figure.near)):
                assert interval == pytest.approx((figure.thesis - share * one, figure.thesis + share * one), abs=1e-9)


@of_each_claim
def test_intervals_surround_the_thesis_number_or_show_why_they_do_not(claim):
    for figure in claim.figures:
        (low, high), (lowest, highest) = figure.met, figure.near
        assert lowest <= low <= figure.thesis <= high <= highest, figure.name
        assert math.isfinite(low + lowest), figure.name
        assert math.isfinite(high + highest) or figure.one_sided, figure.name
        assert math.isfinite(high) == math.isfinite(highest), figure.name
        assert figure.near != figure.met, figure.name
        assert figure.kind in ("", TRIVIAL, NOT_COMPARABLE), figure.name
        assert bool(figure.kind) == bool(figure.because), figure.name


@of_each_claim
def test_numbers_inside_are_met_and_outside_are_not(claim):
    for figure in comparable(claim):
        (low, high), (lowest, highest) = figure.met, figure.near
        for value in (low, figure.thesis, *((high, (low + high) / 2) if math.isfinite(high) else (low + 1, 1e9))):
            assert judge_figure(figure, value) == (figure.kind or MET), figure.name
        assert judge_figure(figure, beyond(low, -1)) == (NEAR if lowest < low else NOT_MET), figure.name
        assert judge_figure(figure, beyond(lowest, -1)) == NOT_MET, figure.name
        if math.isfinite(high):
            assert judge_figure(figure, beyond(high, 1)) == (NEAR if highest > high else NOT_MET), figure.name
            assert judge_figure(figure, beyond(highest, 1)) == NOT_MET, figure.name
        for value in (lowest, highest):
            if math.isfinite(value) and not low <= value <= high:
                assert judge_figure(figure, value) == NEAR, figure.name


@of_each_claim
def test_no_number_is_not_met(claim):
    for figure in comparable(claim):
        assert {judge_figure(figure, value) for value in (None, math.nan, math.inf, -math.inf)} == {NOT_MET}


def test_a_figure_far_better_than_the_thesis_is_not_met_by_that():
    assert judge_figure(FIGURES["I2.identification_x"], 99.0) == NOT_MET
    assert judge_figure(FIGURES["C7.lpv_x"], 0.01) == NOT_MET
    assert judge_figure(FIGURES["I11.w_1"], 0.01) == NEAR


def test_what_cannot_be_compared_is_never_met():
    for key in FIGURES.keys() - NUMBERS.keys():
        assert {judge_figure(FIGURES[key], value) for value in (FIGURES[key].thesis, 0.0, None)} == {NOT_COMPARABLE}


def test_a_claim_is_as_good_as_its_worst_figure():
    assert judge_claim([MET, NEAR, MET]) == NEAR
    assert judge_claim([MET, NEAR, NOT_MET, TRIVIAL]) == NOT_MET
    assert judge_claim([MET, TRIVIAL, NOT_COMPARABLE]) == MET
    assert judge_claim([TRIVIAL, TRIVIAL]) == TRIVIAL
    assert judge_claim([TRIVIAL, NOT_COMPARABLE]) == NOT_COMPARABLE


@of_each_claim
def test_one_missing_figure_spoils_a_claim(claim):
    whole = {figure.name: figure.thesis for figure in claim.figures}
    assert judge(claim, whole).verdict in (MET, TRIVIAL, NOT_COMPARABLE)
    for figure in claim.figures:
        rest = {name: value for name, value in whole.items() if name != figure.name}
        expected = judge(claim, whole).verdict if figure.kind == NOT_COMPARABLE else NOT_MET
        assert judge(claim, rest).verdict == expected


def test_figures_that_a_quick_study_leaves_out_are_not_run_and_counted_apart():
    claim = next(claim for claim in claims() if claim.number == "C8")
    whole = {figure.name: figure.thesis for figure in claim.figures}
    some = {name: value for name, value in whole.items() if "lpv" not in name}
    assert judge(claim, some, {"C7"}).verdict == NOT_MET
    found = judge(claim, some, {"C8"})
    assert found.verdict == NOT_RUN and found.verdicts.count(NOT_RUN) == 2
    assert judge(claim, whole, {"C8"}).verdict == judge(claim, whole).verdict
    bad = some | {"table_hinf_x": math.nan}
    assert judge(claim, bad, {"C8"}).verdict == NOT_MET
    assert count([NOT_RUN, MET, NOT_MET, NOT_RUN]) == "1 met, 1 not met, 2 not run"


def test_verdicts_are_counted_in_one_order():
    assert count([NEAR, MET, NEAR, TRIVIAL]) == "1 met, 2 near, 1 trivial"
    assert set(VERDICTS) == {MET, NEAR, NOT_MET, NOT_RUN, NOT_COMPARABLE, TRIVIAL}


def test_held_out_points_were_used_for_nothing_else():
    layout = StudyGrid()
    grid = [(w, p) for w in layout.speeds for p in layout.pressures]
    for name in ("held_out", "realisations"):
        for speed, pressure in points(name):
            for other in (*CHOSEN_AT, *TWENTY, *grid, *points("nominal"), *points("reduced_design")):
                apart = max(abs(speed - other[0]) / 30.0, abs(pressure - other[1]) / 10e3)
                assert apart > 0.5, (name, speed, pressure)


def test_the_twenty_points_are_those_of_the_verification():
    assert list(points("impacts")) == [pytest.approx(q, rel=1e-12) for q in TWENTY]
