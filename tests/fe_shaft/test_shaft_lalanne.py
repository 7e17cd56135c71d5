"""Lalanne & Ferraris, Rotordynamics Prediction in Engineering (1998): the rotor with three discs at 25000 rpm.

Shaft 1.3 m x 100 mm (elements between stations at 0, .2, .5, 1.0, 1.3 m), E = 200 GPa, rho = 7800, nu = .3; discs of
bore 100 mm: thickness 50, 50, 60 mm, diameter 240, 400, 400 mm; bearings at both ends kxx = 50, kyy = 70 MN/m,
cxx = 500, cyy = 700 N s/m.
"""

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement

pytestmark = pytest.mark.numerical

PUBLISHED = (55.408, 67.209, 157.90, 193.71, 249.90, 407.62, 446.62)  # Hz


def three_discs(parts: int = 1) -> Rotor:
    material = Material("steel", rho=7800.0, E=2e11, Poisson=0.3)
    lengths = [0.1] * 13
    shaft = [ShaftElement(L / parts, 0.0, 0.1, material=material) for L in lengths for _ in range(parts)]
    sizes = ((2, 0.05, 0.24), (5, 0.05, 0.40), (10, 0.06, 0.40))
    discs = [DiskElement.from_geometry(n * parts, material, w, 0.1, d) for n, w, d in sizes]
    bearings = [BearingElement(n, 5e7, 5e2, kyy=7e7, cyy=7e2) for n in (0, 13 * parts)]
    return Rotor(shaft, discs, bearings)


def test_lalanne_and_ferraris_rotor_has_the_published_frequencies_at_25000_rpm():
    """Within .1 %: their 13 Timoshenko elements take a shear coefficient of .9, which is Cowper's within 1.5 %."""
    wn = three_discs().run_modal(25000 * np.pi / 30).wn / (2 * np.pi)
    assert wn[:7] == pytest.approx(PUBLISHED, rel=1e-3)


def test_lalanne_and_ferraris_rotor_has_the_damping_that_rotorinsa_gives():
    """At rest and at 30000 rpm, frequency and damping ratio as in Code_Aster's validation manual, V2.02.124.

    Frequencies within .3 %, damping within 2 %: what the manual allows its own finite elements.
    """
    published = {
        0: ([60.6148, 63.026, 169.49, 185.563], [5.0328e-4, 3.9882e-4, 3.1232e-3, 2.8533e-3]),
        30000: ([54.112, 68.122, 154.65, 196.0], [2.6624e-4, 6.5256e-4, 3.0442e-3, 2.7612e-3]),
    }
    for rpm, (frequency, damping) in published.items():
        modes = three_discs().run_modal(rpm * np.pi / 30)
        assert modes.wd[:4] / (2 * np.pi) == pytest.approx(frequency, rel=3e-3)
        assert modes.damping_ratio[:4] == pytest.approx(damping, rel=0.02)
