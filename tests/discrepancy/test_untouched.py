"""Confirmation of a name by records that took no part in it."""

import numpy as np
import pytest

from rotorsim.discrepancy import judge
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.judge import objection, untouched_gone


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
