"""Benchmarks of the diagnosis judge every status, re-calibrated numbers too, and no status that they do not know."""

from types import SimpleNamespace

import pytest

from rotorsim.discrepancy.judge import VERDICTS
from studies.benchmarks import diagnose_foreign, diagnose_ross
from studies.benchmarks.verdicts import STATUSES, judged


def found(status):
    """A diagnosis of a status that names nothing."""
    return SimpleNamespace(status=status, effects=(), ties=())


JUDGES = {
    "benchmark": lambda d: judged("single", ("bow",), d, {"bow"}),
    "ross": lambda d: diagnose_ross.verdict(("shaft_bow",), d),
    "foreign": lambda d: diagnose_foreign.verdict("noise 1", d),
}


@pytest.mark.parametrize(
    ("kind", "hidden", "verdict"),
    [("none", (), "right"), ("law", (), "right"), ("foreign", (), "wrong"), ("single", ("bow",), "wrong"),
     ("left_out", ("bow",), "wrong"), ("noise", ("bow",), "wrong")],
)  # fmt: skip
def test_numbers_are_far_off_only_where_nothing_else_is(kind, hidden, verdict):
    assert judged(kind, hidden, found("recalibrated"), {"bow"}) == verdict


@pytest.mark.parametrize(("alike", "verdict"), [((), "wrong"), (("withheld",), "class")])
def test_a_tie_that_holds_what_was_left_out_is_no_wrong_name(alike, verdict):
    one = SimpleNamespace(form="bow", tie_class=("bow", *alike))
    tie = SimpleNamespace(status="tie", effects=(one,), ties=())
    assert judged("left_out", ("withheld",), tie, {"bow", "withheld"}) == verdict


@pytest.mark.parametrize(("hidden", "verdict"), [((), "right"), (("shaft_bow",), "wrong")])
def test_re_calibrated_records_of_another_program(hidden, verdict):
    assert diagnose_ross.verdict(hidden, found("recalibrated")) == verdict


@pytest.mark.parametrize(
    ("case", "verdict"), [("off the grid", "right"), ("noise 1", "wrong"), ("cubic stiffness", "wrong")]
)
def test_re_calibrated_foreign_rotors(case, verdict):
    assert diagnose_foreign.verdict(case, found("recalibrated")) == verdict


@pytest.mark.parametrize("name", JUDGES)
def test_every_status_is_judged_and_an_unknown_one_raises(name):
    assert set(VERDICTS) == STATUSES
    assert all(JUDGES[name](found(status)) for status in VERDICTS)
    with pytest.raises(ValueError, match="beyond"):
        JUDGES[name](found("beyond"))
