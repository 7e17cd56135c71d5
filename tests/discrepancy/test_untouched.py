"""Confirmation of a name by records that took no part in it."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy import judge
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.hypotheses import Hypothesis
from rotorsim.discrepancy.judge import AllEvidence, fitted_gone, judged, objection, untouched_gone
from rotorsim.discrepancy.verdict import SearchVerdict


def group(rms, name="2X", floor=1e-8, n=50):
    return Misfit("a", "1500 rpm", "x", name, n, n * (rms / floor) ** 2, rms, floor, 0.0, 0)


def gone(monkeypatch, before, after):
    monkeypatch.setattr(judge, "table", lambda comparison, residual: before if residual[0] == 0 else after)
    return untouched_gone(None, np.zeros(1), np.ones(1))


def test_the_share_is_that_of_groups_beyond_their_floor(monkeypatch):
    quiet = group(1e-8, "1X")
    assert gone(monkeypatch, [group(1e-6), quiet], [group(2e-7), quiet]) == pytest.approx(0.8, abs=1e-3)
    assert gone(monkeypatch, [quiet], [quiet]) is None
    assert gone(monkeypatch, [quiet], [group(1e-6, "1X")]) == -np.inf


@pytest.mark.parametrize(
    ("status", "share", "refused"),
    [("named", 0.2, True), ("tie", 0.0, True), ("partial", -0.78, True), ("named", 0.69, False),
     ("partial", 0.3, False), ("named", None, False), ("partial", -np.inf, True)],
)  # fmt: skip
def test_a_name_that_untouched_records_do_not_confirm_is_refused_in_a_sentence(status, share, refused):
    sentence = objection(status, "internal_damping.time", share)
    assert bool(sentence) == refused
    assert not refused or "untouched records" in sentence


@pytest.mark.parametrize(
    ("status", "share", "astray", "found"),
    [("partial", -2.3, (), "unknown"), ("partial", 0.05, (), "unknown"), ("partial", 0.2, (), "partial"),
     ("partial", None, (), "partial"), ("named", 0.2, (), "named"), ("named", 0.2, ("damping",), "partial"),
     ("named", -2.3, ("damping",), "unknown")],
)  # fmt: skip
def test_a_partial_explanation_has_to_leave_less_of_the_fitted_gap_where_no_record_is_untouched(
    status, share, astray, found
):
    """Also where it was a name whose calibration is not believed."""
    best = Hypothesis((SimpleNamespace(key="rub.stiffness"),), None, 0.0, 0.0, 0.9)
    evidence = AllEvidence(SearchVerdict(status, best), (), gone=share, by_fitted=True, astray=astray)
    assert judged(evidence).verdict.status == found
    assert judged(evidence).verdict.best is (None if found == "unknown" else best)
    assert any("fitted records" in note for note in judged(evidence).notes) == (found == "unknown")


def test_a_whole_gap_that_grows_counts_against_fitted_groups_that_shrink(monkeypatch):
    """2.6 um become 8.7 um in a group within its floor, while one beyond it loses four fifths."""
    monkeypatch.setattr(judge, "table", lambda c, residual: [group(1e-6 if residual[0] == 2.6 else 2e-7)])
    monkeypatch.setattr(judge, "rms", lambda c, vector: np.abs(vector))
    comparison = SimpleNamespace(sigma=np.array([1e-6]))
    assert fitted_gone(comparison, np.array([2.6]), np.array([8.7])) == pytest.approx(1 - 8.7 / 2.6)
    assert fitted_gone(comparison, np.array([2.6]), np.array([2.5])) == pytest.approx(0.8, abs=1e-3)
