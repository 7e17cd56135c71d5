"""Linear algebra of a diagnosis: one error where there is no answer, which ends a fit and not the diagnosis."""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from rotorsim import discrepancy
from rotorsim.base.errors import NoAnswerError
from rotorsim.base.rounding import answer
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.fit import ParameterFit, fit_parameters

PARAMETER = FitParameter("a", 0.1)


@pytest.mark.parametrize(
    ("function", "matrix"),
    [
        (np.linalg.inv, np.zeros((2, 2))),
        (np.linalg.eigvals, np.full((2, 2), np.nan)),
        (np.linalg.cholesky, -np.eye(2)),
        (expm, np.array([[0.0, 1e200], [1e200, 0.0]])),
    ],
)
def test_a_matrix_without_answer_is_one_error(function, matrix):
    with pytest.raises(NoAnswerError, match="linear algebra"):
        answer(function, matrix)


def test_an_answer_is_handed_through():
    x, *_ = answer(np.linalg.lstsq, np.eye(2), np.array([1.0, 2.0]), rcond=None)
    np.testing.assert_array_equal(x, [1.0, 2.0])


def test_every_decomposition_of_a_diagnosis_is_answered_for():
    """A direct call of numpy.linalg or scipy's expm outside of `answer` would end a diagnosis in a traceback."""
    direct = []
    for file in Path(discrepancy.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                if called == "expm" or (called.startswith("np.linalg.") and not called.startswith("np.linalg.norm")):
                    direct.append(f"{file.name}: {called}")
    assert not direct


def test_a_fit_without_a_step_ends_where_it_began():
    class Flat:
        def residual(self, point):
            return np.ones(3)

    found = fit_parameters(Flat(), ParameterPoint(), [PARAMETER], np.full((3, 1), np.nan))
    assert isinstance(found, ParameterFit) and found.cost == 3.0
