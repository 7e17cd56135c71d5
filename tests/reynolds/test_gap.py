"""Gap between journal and sleeve: geometry by hand over a fine circle, and directions in which it closes."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from reynolds import FilmError, GasBearing, kernels
from reynolds.grid import PLACE, cells
from reynolds.sleeve import Foil, Grooves, Lobes, Sleeve, Steps

R, L, C = 0.02, 0.04, 20e-6
CIRCLE = np.linspace(0, 2 * np.pi, 200001)
JOURNALS = [(0.0, 0.0), (7e-6, 0.0), (0.0, -11e-6), (-9e-6, 9e-6), (3e-6, 16e-6)]


def arcs(theta, count, preload, offset, first):
    """Distance of lobes from the middle by the geometry of one arc, whose centre lies m c_p opposite its middle."""
    arc = 2 * np.pi / count
    number = np.floor((theta - first) / arc + offset)
    wide = C / (1 - preload)
    return wide - preload * wide * np.cos(theta - first - number * arc)


def pockets(theta, count, arc, depth, first):
    apart = np.abs(np.angle(np.exp(1j * count * (theta - first)))) / count
    return np.where(apart < arc / 2, depth, 0.0)


FORMS = {
    "plain": (Sleeve(), lambda t: C + 0 * t),
    "lobes": (Sleeve(lobes=Lobes(3, 0.5, first_angle=0.2)), lambda t: arcs(t, 3, 0.5, 0.5, 0.2)),
    "jumps": (Sleeve(lobes=Lobes(3, 0.5, 0.3, 0.2)), lambda t: arcs(t, 3, 0.5, 0.3, 0.2)),
    "oval": (Sleeve(lobes=Lobes(2, 0.4)), lambda t: arcs(t, 2, 0.4, 0.5, 0.0)),
    "pockets": (
        Sleeve(steps=(Steps(3, 10e-6, 0.7, first_angle=0.1),)), lambda t: C + pockets(t, 3, 0.7, 10e-6, 0.1)
    ),
    "wide shallow pockets": (
        Sleeve(steps=(Steps(5, 0.4e-6, 1.1, first_angle=-1.0),)), lambda t: C + pockets(t, 5, 1.1, 0.4e-6, -1.0)
    ),
    "lands at the ends": (Sleeve(steps=(Steps(3, 10e-6, 0.7, 0.02),)), lambda t: C + 0 * t),
    "grooves": (Sleeve(grooves=Grooves(20e-6, 0.5, 0.5)), lambda t: C + 0 * t),
    "lobes with pockets": (
        Sleeve(lobes=Lobes(3, 0.5), steps=(Steps(3, 3e-6, 0.5),)),
        lambda t: arcs(t, 3, 0.5, 0.5, 0.0) + pockets(t, 3, 0.5, 3e-6, 0.0),
    ),
}  # fmt: skip


def bearing(sleeve, n_theta=32, **changes):
    return GasBearing(R, L, C, n_theta=n_theta, n_z=8, sleeve=sleeve, **changes)


def at(one, journal):
    """Smallest gap of a film at rest round a journal, its workspace and layout."""
    layout, w, _ = one.model.build()
    w[layout.journal : layout.journal + 2] = journal
    return float(kernels.least_gap(w, one.model.record()[0], layout)), w, layout


def by_hand(radius, journal):
    return (radius(CIRCLE) - journal[0] * np.cos(CIRCLE) - journal[1] * np.sin(CIRCLE)).min()


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("n_theta", [16, 36])
def test_the_smallest_gap_is_that_of_the_sleeve_drawn_by_hand(name, n_theta):
    """Whatever the grid: forms are exact between its lines. Steps of 31 urad by hand miss an edge by 1 nm at most."""
    sleeve, radius = FORMS[name]
    for journal in JOURNALS:
        gap, _, _ = at(bearing(sleeve, n_theta), journal)
        assert gap == pytest.approx(by_hand(radius, journal), abs=1e-9)
        assert gap <= by_hand(radius, journal) + 1e-13


def test_a_plain_sleeve_leaves_what_the_eccentricity_does_to_the_last_bit():
    for journal in JOURNALS:
        for sleeve in (Sleeve(), FORMS["grooves"][0]):
            assert at(bearing(sleeve), journal)[0] == C - np.sqrt(journal[0] ** 2 + journal[1] ** 2)


@pytest.mark.parametrize("name", ["plain", "lobes", "jumps", "oval", "pockets", "lobes with pockets"])
def test_the_gap_closes_in_the_direction_of_its_place(name):
    """d h_min / d X = -n, as for any smallest distance, and the place moves by dX . t / h'': central differences."""
    one, journal, step = bearing(FORMS[name][0]), np.array([4.1e-6, 2.3e-6]), 1e-9
    layout, w, _ = one.model.build()
    F = one.model.record()[0]

    def place(x):
        w[layout.journal : layout.journal + 2] = x
        kernels.least_gap(w, F, layout)
        found = w[layout.places : layout.places + PLACE * layout.n_theta].reshape(-1, PLACE)
        found = found[np.hypot(found[:, 2], found[:, 3]) > 0.5]
        return found[np.argmin(found[:, 0] - found[:, 1])].copy()

    w[layout.places : layout.places + PLACE * layout.n_theta] = 0.0
    here = place(journal)
    ends = [[place(journal + sign * e) for sign in (1, -1)] for e in step * np.eye(2)]
    closing = [((a[0] - a[1]) - (b[0] - b[1])) / (2 * step) for a, b in ends]
    turned = [(b[2] * a[3] - b[3] * a[2]) / (2 * step) for a, b in ends]
    assert closing == pytest.approx(-here[2:4], abs=1e-6)
    assert turned == pytest.approx(np.array([-here[3], here[2]]) / here[4], abs=1e-4 / C)


def test_an_oval_sleeve_touches_a_wide_journal_on_both_sides():
    """A journal in the middle is closest at both lobes at once: two places, each with its own distance."""
    one = bearing(FORMS["oval"][0])
    layout, w, _ = one.model.build()
    w[layout.journal : layout.journal + 2] = (1e-9, 0.0)
    kernels.least_gap(w, one.model.record()[0], layout)
    places = w[layout.places : layout.places + 2 * PLACE].reshape(2, PLACE)
    order = np.argsort(-places[:, 2])
    assert places[order, 2] == pytest.approx([1.0, -1.0], abs=1e-6)
    assert places[order, 0] - places[order, 1] == pytest.approx([C - 1e-9, C + 1e-9], abs=1e-13)


def test_a_foil_leaves_what_its_pressure_bends_it_by():
    """c + (p - p_a) / k less the journal's part, the smallest over all rows; a spline between the lines for 0.2 nm."""
    stiffness = 5e9
    one = bearing(Sleeve(foil=Foil(stiffness)), n_theta=64)
    journal = (13e-6, -6e-6)
    film = one.steady(journal, 3000.0)
    layout = one.model.build()[0]
    solved, _, _ = one._solve(journal, 3000.0, 0.0, None)
    p = solved[layout.p + cells(layout)]
    bent = C + np.minimum((p - 101325.0).min(axis=1), 0.0) / stiffness
    theta = np.linspace(0, 2 * np.pi, 65)
    spline = CubicSpline(theta, np.append(bent, bent[0]), bc_type="periodic")
    assert film.h_min == pytest.approx(by_hand(spline, journal), abs=3e-8)
    assert film.h_min < C - np.hypot(*journal) or film.h_min == pytest.approx(C - np.hypot(*journal), abs=1e-12)


def test_a_journal_may_go_where_the_sleeve_is_wide_and_not_where_it_is_narrow():
    """Three arcs of preload 0.5: 25 um of room between them, 20 um at their middles."""
    one = bearing(FORMS["lobes"][0])
    between, middle = 0.2 + np.pi / 3, 0.2
    film = one.steady(22e-6 * np.array([np.cos(between), np.sin(between)]), 500.0)
    assert film.h_min == pytest.approx(
        by_hand(FORMS["lobes"][1], 22e-6 * np.array([np.cos(between), np.sin(between)])), abs=1e-9
    )
    with pytest.raises(FilmError):
        one.steady(20.5e-6 * np.array([np.cos(middle), np.sin(middle)]), 500.0)
