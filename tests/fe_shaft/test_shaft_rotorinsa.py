"""Rotors of Code_Aster's validation manual, with frequencies of ROTORINSA (V2.02.125, .129 and V2.06.103) and of Cadyro
(V2.02.127).

The first has bearings whose stiffness is not symmetric and a mode that they drive; the second has bearings given over
speed up to 14000 rpm, held beyond; the third, Cadyro's, is a hollow cone. E = 200 GPa, rho = 7800, nu = .3 throughout.

Cites: code_aster.
"""

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement

pytestmark = pytest.mark.numerical

STEEL = Material("steel", rho=7800.0, E=2e11, Poisson=0.3)
RPM = np.pi / 30


def shaft(stations_mm, inner_mm, outer_mm):
    """Elements between stations, one each."""
    pieces = zip(np.diff(stations_mm), inner_mm, outer_mm, strict=True)
    return [ShaftElement(L * 1e-3, i * 1e-3, o * 1e-3, material=STEEL) for L, i, o in pieces]


def driven() -> Rotor:
    """Two overhung discs on two bearings with cross coupling."""
    stations = [0, 17.5, 35, 45, 70, 102.5, 135, 167.5, 200, 225, 250, 275, 300]
    inner, outer = [0] * 2 + [10] * 10, [40, 40, 70, *[40] * 7, 70, 70]
    discs = [DiskElement(0, 3.5, 3.5e-3, 7e-3), DiskElement(12, 3.0, 3e-3, 6e-3)]
    bearings = [
        BearingElement(4, 1e8, 1.2e4, kyy=8e7, kxy=-6e7, kyx=-1e7, cyy=8e3, cxy=-3e3, cyx=-3e3),
        BearingElement(8, 7e7, 8e3, kyy=5e7, kxy=-4e7, kyx=-2e6, cyy=6e3, cxy=-1.5e3, cyx=-1.5e3),
    ]
    return Rotor(shaft(stations, inner, outer), discs, bearings)


DRIVEN = {
    0: ([216.212, 263.539, 383.210, 439.642], [0.0476544, 0.0787281, 0.0501438, 0.0602275]),
    60000: ([185.365, 296.078, 324.718, 472.541], [-0.0517463, 0.155245, 0.00157489, 0.159683]),
}


@pytest.mark.parametrize("rpm", DRIVEN)
def test_unsymmetric_bearings_give_the_published_frequencies_and_damping_and_drive_one_mode(rpm):
    """Frequencies within .12 % and damping within .001: what the manual's own finite elements differ by."""
    frequency, damping = DRIVEN[rpm]
    modes = driven().run_modal(rpm * RPM)
    assert modes.wd[:4] / (2 * np.pi) == pytest.approx(frequency, rel=1.2e-3)
    assert modes.damping_ratio[:4] == pytest.approx(damping, abs=1e-3)


SPEEDS = np.array([0, 5000, 6500, 8000, 10000, 14000]) * RPM
FIRST = {
    "kxx": [5e8, 5e8, 4e8, 3.5e8, 3.3e8, 3e8],
    "kyy": [0.9e8, 0.9e8, 1e8, 1.1e8, 1.15e8, 1.2e8],
    "kxy": [0.9e5, 0.9e5, 1.5e5, 2e5, 3.5e5, 7e5],
    "kyx": [-0.9e5, -0.9e5, -1.5e5, -2e5, -3.5e5, -7e5],
    "cxx": [4.5e5, 4.5e5, 3.3e5, 2.6e5, 2e5, 1.5e5],
    "cyy": [1.5e5, 1.5e5, 1.3e5, 1.1e5, 1e5, 0.7e5],
    "cxy": [-100, -100, -100, -200, -300, -400],
    "cyx": [100, 100, 100, 200, 200, 300],
}
SECOND = {
    "kxx": [1.5e8, 1.5e8, 1.4e8, 1.4e8, 1.4e8, 1.4e8],
    "kyy": [0.6e8, 0.6e8, 0.7e8, 0.8e8, 0.9e8, 1e8],
    "kxy": [0.8e5, 0.8e5, 1.3e5, 2e5, 3e5, 6e5],
    "kyx": [-0.8e5, -0.8e5, -1.3e5, -2e5, -3e5, -6e5],
    "cxx": [1.9e5, 1.9e5, 1.5e5, 1.3e5, 1e5, 0.8e5],
    "cyy": [1.2e5, 1.2e5, 1e5, 0.9e5, 0.8e5, 0.6e5],
    "cxy": [-100, -100, -100, -200, -200, -300],
    "cyx": [100, 100, 100, 200, 200, 300],
}


def over_speed() -> Rotor:
    """Three discs, hollow head, bearings from tables over speed that are held beyond their end."""
    stations = [0, 20, 55, 90, 115, 140, 170, 200, *range(250, 601, 50), 630, 670, 710, 750, 775, 800]
    inner, outer = [120] * 5 + [0] * 16, [160] * 6 + [90] * 9 + [60] * 6
    discs = [DiskElement(1, 20, 0.2, 0.4), DiskElement(3, 17, 0.17, 0.34), DiskElement(19, 10, 0.015, 0.03)]
    bearings = [
        BearingElement(n, frequency=SPEEDS, extrapolate="hold", **table) for n, table in ((7, FIRST), (16, SECOND))
    ]
    return Rotor(shaft(stations, inner, outer), discs, bearings)


OVER_SPEED = {  # frequencies [Hz] and damping ratios: ROTORINSA; the manual's direct finite elements
    0: (
        ([130.695, 227.925, 313.311, 381.529, 390.802], [0.637866, 0.0958757, 0.227364, 0.652812, 0.177361]),
        ([131.547, 227.716, 313.935, 375.305, 390.241], [0.637613, 0.0949991, 0.227701, 0.661825, 0.174485]),
    ),
    20000: (
        ([123.683, 200.581, 286.743, 308.624, 370.338, 409.861, 813.124, 997.312],
         [0.124817, 0.217961, 0.181652, 0.432727, 0.254912, 0.558764, 0.473230, 0.493828]),
        ([123.706, 200.728, 286.912, 309.825, 369.917, 412.422, 824.952, 1006.17],
         [0.124678, 0.217632, 0.181388, 0.431714, 0.254178, 0.563110, 0.470031, 0.508301]),
    ),
}  # fmt: skip


@pytest.mark.parametrize("rpm", OVER_SPEED)
def test_bearings_from_tables_over_speed_give_the_published_frequencies_and_damping(rpm):
    """The direct elements within .15 % and .001, ROTORINSA within 2 % and .02.

    The manual too finds its direct solution so far from ROTORINSA, and one on a base of modes nearer to it.
    """
    modes = over_speed().run_modal(rpm * RPM)
    order = np.argsort(modes.wd)
    for (frequency, damping), near, like in zip(OVER_SPEED[rpm], (0.02, 1.5e-3), (0.02, 1e-3), strict=True):
        first = order[: len(frequency)]
        assert modes.wd[first] / (2 * np.pi) == pytest.approx(frequency, rel=near)
        assert modes.damping_ratio[first] == pytest.approx(damping, abs=like)


FORCED = {  # axes of force and motion: amplitudes [m] and phases [deg] at 1, 25 and 250 Hz
    ("y", "y"): ([1.032e-7, 1.047e-7, 3.047e-8], [0.003, 0.0862, -111.742]),
    ("y", "x"): ([4.141e-8, 4.261e-8, 1.648e-7], [-0.2134, -5.3164, 92.018]),
    ("x", "x"): ([8.334e-8, 8.426e-8, 7.843e-8], [-179.994, -179.83, 113.87]),
    ("x", "y"): ([2.631e-9, 4.480e-9, 1.047e-7], [-176.977, -127.484, 30.268]),
}
"""V2.06.103 at 60000 rpm, 1 N at the second disc; its axes X and Z are y and x here, its force along Z is -1 N."""


@pytest.mark.parametrize("axes", FORCED)
def test_a_force_on_the_overhung_disc_is_answered_with_the_published_amplitude_and_phase(axes):
    """Amplitudes within .3 % and phases within .6 degrees at 250 Hz, within .12 % and .05 below.

    250 Hz lies on the flank of a mode at 296 Hz whose frequency differs by .1 %; of the four digits .12 % are missed by
    the motion across the force alone, a thirtieth of that along it, where Code_Aster has our 2.634e-9.
    """
    push, along = ("xy".index(axis) for axis in axes)
    disc, sense = 4 * 12, 1 if axes[0] == "y" else -1
    answer = driven().run_freq_response(
        2 * np.pi * np.array([1.0, 25.0, 250.0]), speed=60000 * RPM, inputs=[disc + push], outputs=[disc + along]
    )
    found, (amplitude, phase) = sense * answer.response[0, 0], FORCED[axes]
    for near, degrees, at in ((1.2e-3, 0.05, slice(2)), (3e-3, 0.6, slice(2, 3))):
        assert np.abs(found[at]) == pytest.approx(amplitude[at], rel=near)
        assert np.degrees(np.angle(found[at])) == pytest.approx(phase[at], abs=degrees)


CONE = [331.51, 334.10, 1196.30, 1202.05, 2304.73, 2312.08, 3516.43, 3524.02]
"""V2.02.127 at 4000 rpm [Hz]. Its printed values at rest lie .2 to .8 % below ours in six modes; why is open."""


def test_a_hollow_cone_on_pins_has_the_pairs_of_cadyro():
    """1 m long, 200 mm to 100 mm wide, its wall 20 mm thick throughout.

    Modelling A has discrete bearings (DIS_TR), whose stiffness is not known here; pins stand for them. Springs of
    1e12 N/m would put the first pair 5e-5 lower. 80 cones: the first pair within 3e-5, the next two within 3e-4, the
    fourth within 8e-4, which is not explained: the element's own error in it is 5e-5 (order 2).
    """
    outer = np.linspace(0.2, 0.1, 81)
    inner = outer - 0.04
    shaft = [ShaftElement(1 / 80, inner[k], outer[k], inner[k + 1], outer[k + 1], material=STEEL) for k in range(80)]
    found = Rotor(shaft, pinned=[0, 80]).run_modal(4000 * RPM).wn[:8] / (2 * np.pi)
    assert found[:2] == pytest.approx(CONE[:2], rel=3.5e-5)
    assert found[2:6] == pytest.approx(CONE[2:6], rel=3e-4)
    assert found[6:] == pytest.approx(CONE[6:], rel=8e-4)
