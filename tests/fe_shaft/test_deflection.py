"""Deflection within an element against the shape functions of a uniform Timoshenko beam."""

import numpy as np
import pytest

from fe_shaft import Material, ShaftElement
from fe_shaft.elements import deflection, section, stiffness_matrix


@pytest.mark.parametrize("share", [0.1, 0.37, 0.5, 0.93])
def test_the_deflection_within_an_element_is_that_of_the_timoshenko_shape_functions(share):
    """Przemieniecki (1968), with phi = 12 E I / (kappa G A L^2); a thick element, so that shear counts."""
    steel = Material("steel", 7850.0, 210e9, Poisson=0.3)
    element = ShaftElement(0.1, 0.0, 0.06, material=steel)
    cut = section(element)
    phi = 12 * cut.EI[0] * cut.shear_flexibility[0] / element.L**2
    assert phi > 0.2
    s, L = share, element.L
    left = (1 - 3 * s**2 + 2 * s**3 + phi * (1 - s)) / (1 + phi)
    turned_left = L * (s - 2 * s**2 + s**3 + phi * (s - s**2) / 2) / (1 + phi)
    right = (3 * s**2 - 2 * s**3 + phi * s) / (1 + phi)
    turned_right = L * (-(s**2) + s**3 - phi * (s - s**2) / 2) / (1 + phi)
    rows = deflection([element], share * L)
    assert rows[0, [0, 3, 4, 7]] == pytest.approx([left, turned_left, right, turned_right], rel=1e-9)
    assert rows[1, [1, 2, 5, 6]] == pytest.approx([left, -turned_left, right, -turned_right], rel=1e-9)
    assert np.count_nonzero(np.abs(rows) > 1e-15) == 8


def test_a_cone_deflects_at_its_quarter_as_two_elements_do():
    steel = Material("steel", 7850.0, 210e9, Poisson=0.3)
    cone = ShaftElement(0.2, 0.0, 0.03, 0.0, 0.06, material=steel)
    halves = (ShaftElement(0.05, 0.0, 0.03, 0.0, 0.0375, material=steel),
              ShaftElement(0.15, 0.0, 0.0375, 0.0, 0.06, material=steel))  # fmt: skip
    K = np.zeros((12, 12))
    K[:8, :8] += stiffness_matrix(halves[0])
    K[4:, 4:] += stiffness_matrix(halves[1])
    tip = np.linalg.solve(K[4:, 4:], np.eye(8)[:, 4])
    assert deflection([cone], 0.05)[0, 4:] @ tip[4:] == pytest.approx(tip[0], rel=1e-9)
