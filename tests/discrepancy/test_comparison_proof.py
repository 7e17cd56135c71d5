"""Discretisation error of the solver, taken where the plant has a solution."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.diagnosis import UNSETTLED, DiagnosisRun
from rotorsim.discrepancy.twin import NO_SOLUTION

LINES = 3
AWAY = ParameterPoint({FitParameter("shaft_damping", 0.1): 2.0})


def comparison(lost):
    """A comparison whose `lost` twin has no solution away from the machine file's numbers."""
    made = object.__new__(TwinComparison)
    made.twin = "own"
    sizes = {"own": 1e-6, "fine": 3e-6, "law": 7e-6}

    def response(point, twin, whole):
        away = point.values.get(next(iter(AWAY.values)), 0.0) != 0
        return np.full(LINES, NO_SOLUTION if away and twin == lost else sizes[twin] + 1e-7 * away)

    made._response = response
    return made


@pytest.mark.parametrize("lost", ["own", "fine", "law", None])
@pytest.mark.parametrize("point", [ParameterPoint(), AWAY])
def test_a_twin_without_solution_is_proven_at_the_machine_files_own_numbers(point, lost):
    c = comparison(lost)
    here = c._response(point, "own", False)
    assert c._error(point, "fine", here) == pytest.approx(np.full(LINES, 2e-6))
    assert c._law(point, "law", {FitParameter("own", 0.02): 0.1}, here) == pytest.approx(np.full(LINES, 6e-6))


@pytest.mark.parametrize(("floors", "noted"), [(4.0, False), (6.0, True)])
def test_a_motion_that_the_solver_does_not_settle_with_an_effect_at_work_is_noted(floors, noted):
    made, sigma, without = object.__new__(DiagnosisRun), np.full(LINES, 2e-9), np.full(LINES, 1e-9)
    made.parts = {"fit": SimpleNamespace(correction=without, sigma=sigma)}
    moved = made._moved_by_solver(SimpleNamespace(correction=without + floors * sigma))
    assert moved == pytest.approx(floors)
    assert (moved > UNSETTLED) == noted
