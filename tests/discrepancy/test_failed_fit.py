"""Fits of candidates that do not help: they fail, and are never worse than the fit without the candidate."""

import numpy as np
import pytest

from rotorsim.base.errors import NoAnswerError
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.hypotheses import EffectSearch, share_gone

GAIN, SIZE = FitParameter("gain", 0.1), FitParameter("size", 0.1)
FORM = Form("runout", "runout.roughness", (SIZE,))


class ShiftedResponse:
    """Measured ones; a size of the candidate moves every number away from them, in either direction."""

    def __init__(self, worst=0.0):
        self.worst = worst

    def residual(self, point):
        size = abs(point.values.get(SIZE, 0.0))
        return np.full(4, 2.0 + self.worst * size)

    def predict(self, point):
        return -self.residual(point)

    def jacobian(self, point, parameters, here=None, progress=None, central=False):
        return np.ones((4, len(parameters)))


def search(comparison, monkeypatch):
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.table", lambda comparison, residual: residual)
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.excess", lambda r: float(r @ r) - 4)
    base = ParameterFit((GAIN,), ParameterPoint({GAIN: 0.0}), np.full(4, 2.0), np.zeros((4, 1)), 16.0)
    return EffectSearch(comparison, None, base, (FORM,), {FORM.label: np.ones((4, 1))}, 12.0, 0.0)


def test_a_fit_that_only_gets_worse_is_a_failed_fit_of_size_zero(monkeypatch):
    h = search(ShiftedResponse(1e4), monkeypatch).hypothesis((FORM,), np.array([30.0]))
    assert h.failed and h.gone == 0.0 and h.fit.cost == 16.0
    assert SIZE not in h.fit.point.values


def test_a_fit_whose_linear_algebra_has_no_answer_is_a_failed_fit(monkeypatch):
    def refuse(self, forms, start):
        raise NoAnswerError("linear algebra: singular")

    monkeypatch.setattr(EffectSearch, "_fitted", refuse)
    assert search(ShiftedResponse(), monkeypatch).hypothesis((FORM,), np.array([1.0])).failed


@pytest.mark.parametrize(("left", "before", "gone"), [(1.0, 4.0, 0.75), (0.0, 0.0, 1.0), (8.0, 0.0, 0.0)])
def test_the_share_gone_is_no_huge_number_where_nothing_was_flagged(left, before, gone):
    assert share_gone(left, before) == gone
