"""Published examples: Friswell et al. (2010), 5.9 and 6.9, Nelson & McVaugh (1976), Ward (1913), the program RAPPID,
measured frequencies of a rotor on leaf springs (script of Santos 2017).

Nelson & McVaugh's tables stand in ANSYS' verification manual too, as VM247 (equal bearings) and VM254 (coupled ones);
their input files say what the paper's table of stations leaves open: the shaft ends at 35.5 cm.

Cites: friswell_2010, nelson_1976, santos_2017.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eig, eigh
from scipy.optimize import brentq
from scipy.special import iv, jv

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement, steel
from rotorsim.machine.rotor_import import machine_of
from rotorsim.plant import shaft_rotor

pytestmark = pytest.mark.numerical

RPM_4000 = 4000 * np.pi / 30
HZ = 2 * np.pi


def two_discs(kxx: float, cxx: float = 0.0, kyy: float | None = None, cross: float = 0.0) -> Rotor:
    """Shaft 1.5 m x 50 mm in six elements, two discs 70 mm thick, equal bearings at the ends."""
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    discs = [DiskElement.from_geometry(n, steel, 0.07, 0.05, d) for n, d in ((2, 0.28), (4, 0.35))]
    return Rotor(shaft, discs, [BearingElement(n, kxx, cxx, kyy, cross, cross) for n in (0, 6)])


def printed(values: np.ndarray, expected: list[float], digit: float) -> None:
    """Assert equality to the last printed digit; one unit, since the book also cuts instead of rounding."""
    assert values[: len(expected)] == pytest.approx(expected, rel=0, abs=digit)


def test_friswell_5_9_1_isotropic_bearings():
    rotor = two_discs(1e6)
    printed(rotor.run_modal(0.0).wn, [86.66, 86.66, 274.31, 274.31, 716.78], 0.01)
    printed(rotor.run_modal(RPM_4000).wn, [85.39, 87.80, 251.78, 294.71, 600.18], 0.01)


def test_friswell_5_9_2_anisotropic_bearings():
    rotor = two_discs(1e6, kyy=0.8e6)
    printed(rotor.run_modal(0.0).wn, [82.65, 86.66, 254.52, 274.31, 679.49], 0.01)
    printed(rotor.run_modal(RPM_4000).wn, [82.33, 86.86, 239.64, 287.25, 583.49], 0.01)


def test_friswell_5_9_3_strongly_anisotropic_bearings():
    wn = two_discs(1e6, kyy=0.2e6).run_modal(RPM_4000).wn / HZ
    printed(wn, [8.545, 13.77, 22.35, 44.06, 78.76], 0.01)
    printed(wn[5:], [120.4], 0.1)


def test_friswell_5_9_4_cross_coupled_bearings():
    wn = two_discs(1e6, cross=0.5e6).run_modal(0.0).wn / HZ
    printed(wn, [11.66, 14.80, 33.97, 49.19, 97.97, 126.61], 0.01)


def test_friswell_5_9_5_damped_bearings():
    rotor = two_discs(1e6, cxx=3e3)
    at_rest, spinning = rotor.run_modal(0.0), rotor.run_modal(RPM_4000)
    printed(at_rest.wn[::2] / HZ, [13.91, 48.18, 137.06], 0.01)
    printed(at_rest.wd[::2] / HZ, [13.89, 46.54, 103.22], 0.01)
    printed(spinning.wd / HZ, [13.68, 14.07, 41.98, 50.65, 104.25], 0.01)


def test_friswell_5_9_9_overhung_disc():
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    disc = DiskElement.from_geometry(6, steel, 0.07, 0.05, 0.35)
    rotor = Rotor(shaft, [disc], [BearingElement(0, 10e6, 0.0), BearingElement(4, 10e6, 0.0)])
    printed(rotor.run_modal(0.0).wn[::2], [90.14, 630.73, 830.43], 0.01)
    spinning = rotor.run_modal(RPM_4000).wn
    printed(spinning, [76.19, 103.91, 565.99, 634.23, 647.75], 0.01)
    printed(spinning[5:], [1174.2], 0.1)


# Station positions [cm], outer radii [cm] and inner radii [cm] of the 18 elements.
STATIONS = "0 1.27 5.08 7.62 8.89 10.16 10.67 11.43 12.70 13.46 16.51 19.05 22.86 26.67 28.70 30.48 31.50 34.54 35.50"
OUTER = ".51 1.02 .76 2.03 2.03 3.30 3.30 2.54 2.54 1.27 1.27 1.52 1.52 1.27 1.27 3.81 2.03 2.03"
INNER = {6: 1.52, 7: 1.78, 17: 1.52}
CRITICAL = {  # whirl / spin: whirl speeds [rpm]
    1: [15470, 17159, 46612, 49983, 64752, 96547],
    2: [15858, 16700, 47520, 49204, 69640, 85552],
    4: [4 * 4015, 4 * 4120.2, 4 * 11989.25, 4 * 12200, 4 * 18184.25, 4 * 20162.25],
}


def nelson_mcvaugh(kxx: float, cross: float = 0.0) -> Rotor:
    """The rotor on equal bearings at 16.51 and 28.70 cm."""
    material = Material("Nelson", rho=7806.0, E=2.078e11, Poisson=0.3)
    z = np.array(STATIONS.split(), dtype=float) / 100
    outer = np.array(OUTER.split(), dtype=float) / 100
    shaft = [
        ShaftElement(L, 0.02 * INNER.get(i, 0.0), 2 * r, material=material, shear_effects=False)
        for i, (L, r) in enumerate(zip(np.diff(z), outer, strict=True))
    ]
    bearings = [BearingElement(n, kxx, 0.0, kxy=cross, kyx=cross) for n in (10, 14)]
    return Rotor(shaft, [DiskElement(4, 1.401, 0.00136, 0.0020)], bearings)


@pytest.mark.parametrize("ratio", CRITICAL)
def test_nelson_and_mcvaugh_rotor_has_the_published_critical_whirl_speeds(ratio):
    """Whirl w at spin w / ratio solves K q = w^2 (M - i G / ratio) q.

    Modes 1 to 5 within .3 %, mode 6 within .7 %: the sizes are published to .1 mm, and the last overhang alone moves
    modes 3 and 4 by .5 % a millimetre.
    """
    rotor = nelson_mcvaugh(4.378e7)
    squares = eig(rotor.K(), rotor.M() - 1j * rotor.G() / ratio, right=False).real
    rpm = np.sqrt(np.sort(squares[squares > 0])[:6]) * 30 / np.pi
    error = np.abs(rpm / CRITICAL[ratio] - 1)
    assert np.all(error[:5] < 0.003)
    assert error[5] < 0.007


def test_nelson_and_mcvaugh_rotor_on_coupled_bearings_whirls_as_published_at_100000_rpm():
    """35.03 MN/m, cross coupling -8.756 MN/m: 10747, 19665, 39077, 47549 rpm; .6 % for the rounded sizes as above."""
    modes = nelson_mcvaugh(3.503e7, -8.756e6).run_modal(100000 * np.pi / 30)
    assert modes.wn[:4] * 30 / np.pi == pytest.approx([10747, 19665, 39077, 47549], rel=0.006)
    assert modes.whirl[:2].tolist() == ["backward", "forward"]


def test_friswell_6_9_1_overhung_rotor_on_unequal_stiffnesses_has_the_printed_critical_speeds():
    """Shaft 1.5 m x 25 mm, bearings at 0 and 1 m with .2 MN/m along x and .4 along y, 15.3 kg at the end."""
    material = Material("steel", rho=7810.0, E=211e9, Poisson=0.3)
    shaft = [ShaftElement(0.25, 0.0, 0.025, material=material) for _ in range(6)]
    bearings = [BearingElement(n, 0.2e6, 0.0, kyy=0.4e6) for n in (0, 4)]
    rotor = Rotor(shaft, [DiskElement(6, 15.3, Id=0.062, Ip=0.120)], bearings)
    printed(rotor.run_critical_speed(count=5).wn * 30 / np.pi, [358.43, 389.35, 2123.79, 2659.10, 3118.14], 0.01)


STATIONS_RAPPID = [(1.91697, 5.9905e-4, 0.010284), (3.83395, 1.1981e-3, 0.020568), (36.4237, 0.33076, 0.19866)]
"""Mass [kg], polar and diametral inertia [kg m2] of the stations at 0, 1/6 and 1/3 of the shaft's length."""


def test_a_rotor_of_lumped_stations_has_the_frequencies_of_a_transfer_matrix_program():
    """Frequencies [Hz] of RAPPID at 500 rpm, its output in discussion 911 of the repository petrobras/ross.

    A massless shaft 1.5 m x 50 mm with seven lumped stations, as that program has it: three pairs within 3e-4, which
    the five digits of the stations leave open, the fourth within 9e-4.
    """
    massless = Material("massless", rho=1e-9, E=211e9, G_s=81.2e9)
    end, plain, disc = STATIONS_RAPPID
    stations = [end, plain, disc, plain, disc, plain, end]
    discs = [DiskElement(n, m, Id=Id, Ip=Ip) for n, (m, Ip, Id) in enumerate(stations)]
    shaft = [ShaftElement(0.25, 0.0, 0.05, material=massless) for _ in range(6)]
    rotor = Rotor(shaft, discs, [BearingElement(n, 1e6, 0.0, kyy=0.8e6) for n in (0, 6)])
    theirs = [14.6152, 15.3284, 43.3459, 46.9251, 105.902, 112.760, 150.907, 155.810]
    found = rotor.run_modal(500 * np.pi / 30).wn[:8] / HZ
    assert found[:6] == pytest.approx(theirs[:6], rel=3e-4)
    assert found[6:] == pytest.approx(theirs[6:], rel=9e-4)


WARD = [4.359, 10.573, 19.225, 30.339, 43.921]
"""Ward (1913), in Timoshenko, Vibration Problems in Engineering: f = a r sqrt(E / rho) / (2 pi L^2), base radius r."""


def test_a_cone_that_is_clamped_at_its_base_has_the_frequencies_of_ward():
    """v is 1/x times J2 and I2 of 2 sqrt(k x), so J2 I3 + I2 J3 = 0 at the base; a = k / 2.

    The table is within 2e-4 of it; 80 elements, which end at a thousandth of the base, are within 3e-4.
    """
    ends = np.linspace(1.0, 30.0, 3001)
    values = jv(2, ends) * iv(3, ends) + iv(2, ends) * jv(3, ends)
    roots = [
        brentq(lambda z: jv(2, z) * iv(3, z) + iv(2, z) * jv(3, z), ends[i], ends[i + 1])
        for i in np.flatnonzero(values[:-1] * values[1:] < 0)[:5]
    ]
    exact = (np.array(roots) / 2) ** 2 / 2
    assert np.array(WARD) / exact == pytest.approx(1.0, rel=2e-4)
    tip, base, L, E, rho = 1e-3, 4e-3, 10.0, 210e9, 7850.0
    outer = base * np.linspace(1.0, tip, 81)
    material = Material("steel", rho=rho, E=E, Poisson=0.3)
    plain = {"material": material, "shear_effects": False, "rotary_inertia": False}
    shaft = [ShaftElement(L * (1 - tip) / 80, 0.0, a, 0.0, b, **plain) for a, b in pairwise(outer)]
    rotor = Rotor(shaft, [], [BearingElement(0, 1.0, 0.0)])
    wn = np.sqrt(eigh(rotor.K()[4:, 4:], rotor.M()[4:, 4:], eigvals_only=True)[:10:2])
    assert wn / (base / 2 / L**2 * np.sqrt(E / rho)) == pytest.approx(exact, rel=3e-4)


MEASURED = {"x": [13.0, 33.6, 43.0], "y": [14.9, 46.0]}
"""Frequencies [Hz] at rest, horizontal and vertical."""
SCRIPT = [13.86305, 14.71076, 33.52579, 42.31866, 46.75595]
"""Frequencies [Hz] of the script's own matrices, Euler's elements with rotary inertia."""


def test_a_rotor_whose_bearing_housings_stand_on_leaf_springs_has_the_measured_frequencies():
    """FreeShaft.m of jacoboesterby/RotorDynamics (Santos 2017): shaft 435 mm x 5 mm, two aluminium discs, ball bearings
    in housings of .407 kg on two leaves each, 75 mm x 28.5 mm x 1 mm, clamped at both ends.

    Four within 2 %. The lowest, 13.86 Hz, is 6.6 % above the measured 13.0 Hz in the script's own model too: `SCRIPT`.
    Neither its springs explain that (30 % less stiffness lowers it by 2.7 % and the next horizontal one by 13 %) nor
    its discs: 5 % more mass lowers it by 2.1 %, and the vertical ones below the measured ones.
    """
    material, width, thick, long = Material("steel", rho=7800.0, E=2e11, Poisson=0.3), 28.5e-3, 1e-3, 75e-3
    soft, stiff = 2 * 2e11 * width * thick**3 / long**3, 2 * 2e11 * width * thick / long
    mass = 2770 * np.pi * 0.06**2 * 0.011
    Id = mass * (0.06**2 / 4 + 0.011**2 / 12)
    lengths = [0.140 / 3] * 3 + [0.205 / 6] * 6 + [0.090 / 3] * 3
    rotor = Rotor(
        [ShaftElement(one, 0.0, 0.005, material=material) for one in lengths],
        [DiskElement(n, mass, Id, mass * 0.06**2 / 2) for n in (3, 9)],
        [BearingElement(n, soft, 0.0, kyy=stiff, mxx=0.40698, myy=0.40698) for n in (0, 12)],
    )
    modes = rotor.run_modal(0.0)
    assert modes.wn[:5] / HZ == pytest.approx(SCRIPT, rel=6e-4)
    for axis, measured in enumerate(MEASURED.values()):
        own, other = (np.abs(modes.shapes[k::4]).max(axis=0) for k in (axis, 1 - axis))
        found = modes.wn[own > other][: len(measured)] / HZ
        assert found[1 - axis :] == pytest.approx(measured[1 - axis :], rel=0.02)


# Friswell's examples as the documentation of ROSS prints them (docs/user_guide of github.com/petrobras/ross).

TUBE = Material("steel", rho=7800.0, E=200e9, Poisson=0.27)
HUBS = {  # elements (length, outer diameter) and discs (node, width, bore) [m]: frequencies [Hz] at 3000 rpm
    "disc at a node": (
        [(0.2, 0.08)] * 6, [(3, 0.08, 0.08)], [53.6381, 53.7015, 261.6727, 326.3376, 736.6157, 737.8977]
    ),
    "hub with the disc at its middle": (
        [(0.2, 0.08)] * 2 + [(0.16, 0.08), (0.04, 0.16), (0.04, 0.16), (0.16, 0.08)] + [(0.2, 0.08)] * 2,
        [(4, 0.08, 0.16)], [58.6241, 58.6904, 278.2302, 337.0536, 826.5594, 827.9640],
    ),
    "hub with the disc in three parts": (
        [(0.2, 0.08)] * 2 + [(0.16, 0.08), (0.04, 0.16), (0.04, 0.16), (0.16, 0.08)] + [(0.2, 0.08)] * 2,
        [(3, 0.02, 0.16), (4, 0.04, 0.16), (5, 0.02, 0.16)],
        [58.6354, 58.7020, 276.8475, 334.4568, 827.8520, 829.3194],
    ),
    "disc as a piece of shaft": (
        [(0.2, 0.08)] * 2 + [(0.16, 0.08), (0.08, 0.4), (0.16, 0.08)] + [(0.2, 0.08)] * 2,
        [], [58.9916, 59.0582, 279.3234, 337.7512, 835.2375, 836.6597],
    ),
}  # fmt: skip


@pytest.mark.parametrize("hub", HUBS)
def test_a_hollow_shaft_with_a_disc_on_a_hub_has_the_printed_frequencies(hub):
    """Friswell 5.8.3, four models of the hub, example 16 of ROSS; pins stand for its springs of 1e20 N/m."""
    elements, discs, frequencies = HUBS[hub]
    shaft = [ShaftElement(length, 0.03, outer, material=TUBE) for length, outer in elements]
    wheels = [DiskElement.from_geometry(n, TUBE, width, bore, 0.4) for n, width, bore in discs]
    modes = Rotor(shaft, wheels, pinned=[0, len(shaft)]).run_modal(3000 * np.pi / 30)
    printed(modes.wd / HZ, frequencies, 1e-4)


LOADED = {  # axial force [N], tension above 0: frequencies [Hz] at 4000 rpm
    10e3: [13.739728, 14.111493, 40.330147, 47.154123, 96.087639, 132.403364],
    100e3: [14.867629, 15.156882, 42.570013, 49.325073, 100.969101, 139.063735],
    -10e3: [13.434622, 13.829336, 39.813547, 46.654356, 94.950323, 130.856441],
}


@pytest.mark.parametrize("force", LOADED)
def test_a_rotor_that_is_pulled_or_pressed_has_the_printed_frequencies(force):
    """Friswell 5.9.7, the rotor of 5.9.1 under axial loads, example 22 of ROSS."""
    plain = two_discs(1e6)
    loaded = [ShaftElement(one.L, 0.0, 0.05, axial_force=force) for one in plain.shaft_elements]
    rotor = Rotor(loaded, plain.disk_elements, plain.bearing_elements)
    printed(rotor.run_modal(RPM_4000).wd / HZ, LOADED[force], 1e-6)


SUPPORTS = {1: (10e6, 10e6, 0.0), 2: (10e6, 20e6, 0.0), 3: (10e6, 20e6, 60e3), 4: (10e6, 20e6, 400e3),
            5: (0.2e6, 0.4e6, 0.0)}  # fmt: skip
"""Stiffness along x and y [N/m], damping along both [N s/m]."""
ROOTS = {  # speed [rpm], supports at 0 and 1 m: eigenvalues [1/s]
    (0, 1, 1): [44.322j, 44.322j, 397.537j, 397.537j],
    (0, 2, 2): [44.322j, 44.408j, 397.537j, 400.142j],
    (0, 2, 3): [-0.038 + 44.332j, -0.010 + 44.409j, -1.219 + 400.564j, -0.850 + 401.182j],
    (0, 2, 4): [-0.066 + 44.438j, -0.038 + 44.442j, -0.211 + 401.037j, -0.209 + 401.849j],
    (0, 5, 5): [37.630j, 40.664j, 226.242j, 281.853j],
    (1000, 1, 1): [42.250j, 46.404j, 389.801j, 402.327j],
    (1000, 2, 3): [-0.020 + 42.292j, -0.028 + 46.460j, -0.617 + 391.899j, -1.358 + 406.609j],
    (2000, 2, 3): [-0.017 + 40.243j, -0.033 + 48.539j, -0.189 + 377.688j, -1.607 + 410.454j],
    (3000, 2, 3): [-0.014 + 38.241j, -0.039 + 50.592j, 356.968j, -1.788 + 413.175j],
}


@pytest.mark.parametrize("case", ROOTS)
def test_an_overhung_rotor_on_damped_supports_has_the_printed_eigenvalues(case):
    """Friswell 6.8.1 with the supports of its table 6.3, example 25 of ROSS, as a machine."""
    rpm, *kinds = case
    material = Material("steel", rho=7810.0, E=211e9, Poisson=0.3)
    supports = [
        BearingElement(n, SUPPORTS[k][0], SUPPORTS[k][2], kyy=SUPPORTS[k][1], cyy=SUPPORTS[k][2])
        for n, k in zip((0, 4), kinds, strict=True)
    ]
    shaft = [ShaftElement(0.25, 0.0, 0.025, material=material) for _ in range(6)]
    machine = machine_of(Rotor(shaft, [DiskElement(6, 15.3, Id=0.062, Ip=0.120)], supports), "overhung")
    found = shaft_rotor(machine).run_modal(rpm * np.pi / 30).eigenvalues
    found = found[found.imag > 0]
    found = found[np.argsort(np.abs(found))][:4]
    printed(found.real, np.real(ROOTS[case]).tolist(), 1e-3)
    printed(found.imag, np.imag(ROOTS[case]).tolist(), 1e-3)


CROSSED = {  # nodes of the discs of 280 and 350 mm: critical speeds [rad/s]
    (4, 6): [86.10505193, 86.60492546, 198.93259257, 207.97165539, 244.95609413, 250.53522782],
    (5, 10): [61.52110644, 63.72862198, 117.49491374, 118.55829416, 233.83724523, 236.40346235],
}


@pytest.mark.parametrize("nodes", CROSSED)
def test_a_rotor_that_overhangs_its_bearings_has_the_printed_critical_speeds(nodes):
    """2.5 m x 50 mm in ten elements on bearings at .5 and 2 m, one disc overhung in the second; ross/tests."""
    discs = [DiskElement.from_geometry(n, steel, 0.07, 0.05, d) for n, d in zip(nodes, (0.28, 0.35), strict=True)]
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(10)]
    rotor = Rotor(shaft, discs, [BearingElement(n, 1e6, 0.0) for n in (2, 8)])
    printed(rotor.run_critical_speed(count=6).wn, CROSSED[nodes], 1e-7)
