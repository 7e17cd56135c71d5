"""Modes that are counted and followed: pencils with known eigenvalues, tables that bring modes down and up again."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.linalg import eigh

from direct_search import crossings as searched
from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, critical, steel
from fe_shaft.critical import _forward_plane
from fe_shaft.crossings import ModesAt, crossings, first_loss
from fe_shaft.follower import follow
from fe_shaft.pencil import Quotient, Region, SecondOrder, nothing
from fe_shaft.spectrum import counted, everything, joined, mean_missing, missing_in, modes_in, tracked

pytestmark = pytest.mark.numerical

REGION = Region(reach=100.0, floor=0.01)


def oscillators(wn, zeta, mix=None):
    """Independent oscillators of given frequencies and damping ratios, in turned coordinates."""
    wn, zeta = np.asarray(wn, float), np.asarray(zeta, float)
    Q = np.eye(len(wn)) if mix is None else np.linalg.qr(mix)[0]
    return SecondOrder(np.eye(len(wn)), Q.T @ np.diag(2 * zeta * wn) @ Q, Q.T @ np.diag(wn**2) @ Q)


@pytest.mark.parametrize("seed", range(6))
def test_the_count_of_missing_modes_is_the_number_left_out(seed):
    """Pairs count twice, in the region only; damping ratios on both sides of its border, one mode double."""
    rng = np.random.default_rng(seed)
    wn, zeta = rng.uniform(1, 150, 20), rng.uniform(-0.2, 0.95, 20)
    wn[3], zeta[3] = wn[2], zeta[2]
    pencil = oscillators(wn, zeta, rng.standard_normal((20, 20)))
    every = -zeta * wn + 1j * wn * np.sqrt(1 - zeta**2)
    inside = REGION.holds(every)
    assert missing_in(REGION, Quotient(pencil, every)) == 0
    for left in (0, 2, 5):
        gone = np.flatnonzero(inside)[:left]
        assert missing_in(REGION, Quotient(pencil, np.delete(every, gone))) == 2 * len(gone)


@pytest.mark.parametrize("gone", [[0], [3], [5]])
def test_the_turn_of_the_determinant_is_at_a_missing_mode(gone):
    """The sums of the missing eigenvalue with its partner and of their squares, on steps that vary in length."""
    rng = np.random.default_rng(11)
    pencil = oscillators(rng.uniform(20, 90, 8), rng.uniform(0.0, 0.3, 8))
    every = everything(pencil)
    known = counted(pencil, every.take(np.delete(np.arange(8), gone)), REGION)
    assert known.missing == 2
    assert mean_missing(known, REGION) == pytest.approx(every.values[gone].tolist(), rel=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_a_mode_is_tracked_from_a_guess_with_an_error_that_is_cubed_at_each_new_shift(seed, monkeypatch):
    """An error of 3 % takes at most three shifts to rounding: 3e-2, 3e-5, 3e-14; Newton's method takes five."""
    rng, shifts = np.random.default_rng(seed), []
    pencil = oscillators([3.0, 5.0, 9.0, 20.0], [0.01, 0.05, 0.2, 0.3], rng.standard_normal((4, 4)))
    exact = everything(pencil)
    mode = exact.take([int(np.argmin(np.abs(np.abs(exact.values) - 9.0)))])
    noise = 0.03 * rng.standard_normal((2, 8, 1))
    guess = replace(mode, values=1.03 * mode.values, right=mode.right * (1 + noise[0]), left=mode.left * (1 + noise[1]))
    factor = SecondOrder.factor
    monkeypatch.setattr(SecondOrder, "factor", lambda self, s: (shifts.append(s), factor(self, s))[1])
    found, _ = tracked(pencil, guess)
    assert found.values == pytest.approx(mode.values, rel=1e-11) and len(shifts) <= 3
    assert (found.left.conj().T @ pencil.times_S(found.right)).item() == pytest.approx(1.0, rel=1e-12)


def test_a_count_over_other_known_modes_asks_hardly_a_point_again(monkeypatch):
    asked, slogdet = [], np.linalg.slogdet
    monkeypatch.setattr(np.linalg, "slogdet", lambda matrix: (asked.append(matrix), slogdet(matrix))[1])
    rng = np.random.default_rng(7)
    wn, zeta = rng.uniform(1, 150, 20), rng.uniform(-0.2, 0.95, 20)
    pencil, every = oscillators(wn, zeta), -zeta * wn + 1j * wn * np.sqrt(1 - zeta**2)
    assert missing_in(REGION, Quotient(pencil, every[REGION.holds(every)][1:])) == 2
    first = len(asked)
    assert missing_in(REGION, Quotient(pencil, every[REGION.holds(every)])) == 0
    assert first > 10 and len(asked) < 1.2 * first


@pytest.mark.parametrize("step", [0.002, 0.01, 0.03])
def test_a_mode_that_comes_in_over_the_border_of_damping_is_not_hidden_by_its_former_place(step):
    """One of 80 oscillators; the seed holds those inside, its own place just outside was never met."""
    rng = np.random.default_rng(3)
    wn, zeta = rng.uniform(1, 150, 80), np.where(np.arange(80) < 6, 0.1, 0.9)
    wn[:7], zeta[6] = [3.0, 8.0, 20.0, 33.0, 51.0, 72.0, 18.0], 0.5 + step
    before = modes_in(oscillators(wn, zeta), REGION, wn[:6].tolist())
    before = before.take(REGION.holds(before.values))
    pencil = oscillators(wn, np.where(np.arange(80) == 6, 0.5 - step, zeta))
    before = replace(before, missing=0.0, quotient=Quotient(oscillators(wn, zeta), before.values))
    assert len(before.values) == 6
    found = modes_in(pencil, REGION, (), before)
    assert found.proven and REGION.holds(found.values).sum() == 7


def test_a_double_mode_is_two_modes_and_a_mode_that_is_met_twice_is_one():
    pencil = oscillators([10.0, 10.0, 30.0], [0.1, 0.1, 0.2], np.random.default_rng(1).standard_normal((3, 3)))
    found = modes_in(pencil, REGION)
    assert np.abs(found.values) == pytest.approx([10.0, 10.0, 30.0], rel=1e-10) and found.proven
    assert len(joined(pencil, found, found).values) == 3
    assert len(joined(pencil, nothing(pencil.size), found.take([0, 0, 2])).values) == 2


def test_large_pencils_give_every_mode_of_the_region():
    """One hundred oscillators: eigenvalues by Krylov spaces, their number by the count."""
    rng = np.random.default_rng(7)
    wn, zeta = rng.uniform(5, 400, 100), rng.uniform(0.0, 0.9, 100)
    wn[0], wn[1], zeta[0], zeta[1] = 50.0, 50.0 * (1 + 3e-10), 0.3, 0.3
    exact = -zeta * wn + 1j * wn * np.sqrt(1 - zeta**2)
    exact = exact[REGION.holds(exact)]
    found = modes_in(oscillators(wn, zeta, rng.standard_normal((100, 100))), REGION)
    inside = found.values[REGION.holds(found.values)]
    assert found.missing == 0
    assert np.sort(np.abs(inside)) == pytest.approx(np.sort(np.abs(exact)), rel=1e-8)


def test_modes_among_many_that_are_damped_are_found_where_the_count_misses_them():
    """Frequencies over three decades, most of them on either side of the border of damping."""
    rng = np.random.default_rng(5)
    wn, zeta = np.geomspace(0.15, 90.0, 90), rng.uniform(0.46, 0.75, 90)
    pencil, every = oscillators(wn, zeta), -zeta * wn + 1j * wn * np.sqrt(1 - zeta**2)
    found = modes_in(pencil, REGION)
    inside = np.sort_complex(found.values[REGION.holds(found.values)])
    assert found.proven and inside == pytest.approx(np.sort_complex(every[REGION.holds(every)]), rel=1e-9)


def test_a_mode_that_is_met_below_the_real_axis_is_its_partner_above():
    """From a neighbour's modes of which some are conjugated: none is missing, and all are among the modes."""
    rng = np.random.default_rng(8)
    wn, zeta, mixed = rng.uniform(5, 400, 100), rng.uniform(-0.1, 0.9, 100), rng.standard_normal((100, 100))
    seed = modes_in(oscillators(wn, zeta, mixed), REGION)
    flip = np.arange(len(seed.values)) % 3 == 0
    values, right, left = (np.where(flip, x.conj(), x) for x in (seed.values, seed.right, seed.left))
    seed = replace(seed, values=values, right=right, left=left)
    found = modes_in(oscillators(1.001 * wn, zeta, mixed), REGION, seed=seed)
    exact = 1.001 * wn * (-zeta + 1j * np.sqrt(1 - zeta**2))
    inside = found.values[REGION.holds(found.values)]
    assert found.proven
    assert np.sort(np.abs(inside)) == pytest.approx(np.sort(np.abs(exact[REGION.holds(exact)])), rel=1e-8)


@dataclass(frozen=True)
class Crossed:
    """Two oscillators whose frequencies cross at 1 with a coupling; without one they pass through each other."""

    coupling: float

    def __call__(self, x):
        K = np.array([[(10 * x) ** 2, self.coupling], [self.coupling, (20 - 10 * x) ** 2]])
        return SecondOrder(np.eye(2), 0.01 * np.eye(2), K)


@pytest.mark.parametrize("count", [2, 3, 9])
@pytest.mark.parametrize(("coupling", "ends"), [(0.0, (18.0, 2.0)), (5.0, (2.0, 18.0))])
def test_branches_pass_through_a_crossing_and_turn_at_a_veering_whatever_the_grid(coupling, ends, count):
    """At the crossing itself, a node of the second grid, the two modes are one double mode without a coupling."""
    found = follow(Crossed(coupling), np.linspace(0.2, 1.8, count).tolist(), Region(40.0, 0.01))
    assert len(found.branches) == 2 and not found.uncertain
    last = [abs(found.values(branch)[1][-1]) for branch in found.branches]
    assert last == pytest.approx(ends, rel=0.05)


def rotor(k, speeds):
    shaft = [ShaftElement(0.25, 0.0, 0.1) for _ in range(6)]
    disc = [DiskElement.from_geometry(3, steel, 0.07, 0.1, 0.28)]
    bearings = [BearingElement(n, k, 20.0, kyy=np.multiply(k, 0.9), frequency=speeds) for n in (0, 6)]
    return Rotor(shaft, disc, bearings)


def test_stiffness_that_rises_over_the_speed_gives_critical_speeds_in_both_directions():
    """Against the signs of |lambda| - Omega in a sweep of all modes: each change is a critical speed, and no other."""
    tabled = rotor([1e6, 1e6, 1e8, 1e8], [0.0, 314.0, 419.0, 1200.0])
    found = tabled.run_critical_speed(limit=1000.0, count=50)
    speeds = np.unique([*np.linspace(1.0, 999.0, 40), *np.linspace(310.0, 332.0, 45)])
    gaps = np.array([tabled.run_modal(v).wn[:6] - v for v in speeds])
    falls = np.sum((gaps[:-1] > 0) & (gaps[1:] <= 0))
    rises = np.sum((gaps[:-1] <= 0) & (gaps[1:] > 0))
    assert (np.sum(~found.upward), np.sum(found.upward)) == (falls, rises) and rises > 0 and found.proven
    for speed in found.wn:
        assert np.abs(tabled.run_modal(speed).wn / speed - 1).min() < 1e-7


def on_steep_tables(seed):
    """Two stiffnesses of a random factor of up to 60 within 50 to 400 rad/s, or random ones at seven speeds."""
    rng, n = np.random.default_rng(seed), 5
    shaft = [ShaftElement(0.12, 0, 0.02 + 0.01 * rng.random(), material=steel) for _ in range(n)]
    discs = [
        DiskElement(int(k), 3 * rng.random() + 1, 0.01 + 0.02 * rng.random(), 0.02 + 0.03 * rng.random())
        for k in rng.choice(n + 1, 2, replace=False)
    ]
    if seed >= 200:
        start = rng.uniform(400, 1800)
        speeds, factor = [0.0, start, start + rng.uniform(50, 400), 3000.0], rng.uniform(5, 60)
    bearings = []
    for node in (0, n):
        if seed >= 200:
            k = 10 ** rng.uniform(4.8, 6.0) * np.array([1, 1, factor, factor])
            ratio, c, cross = rng.uniform(0.6, 1.6), 10 ** rng.uniform(1, 2.7), 0.0
        else:
            speeds, k = np.linspace(0, 3000.0, 7), 10 ** rng.uniform(4.5, 7.5, 7)
            c, cross, ratio = 10 ** rng.uniform(1, 3.2), rng.uniform(-0.3, 0.3), rng.uniform(0.5, 2)
        bearings.append(BearingElement(node, k, c * np.ones(len(k)), kyy=ratio * k, kxy=cross * k, kyx=-cross * k,
                                       frequency=speeds))  # fmt: skip
    return Rotor(shaft, discs, bearings)


@pytest.mark.parametrize("seed", [15, *(pytest.param(k, marks=pytest.mark.slow) for k in (7, 205, 208))])
def test_critical_speeds_on_steep_tables_are_those_of_a_search_that_follows_nothing(seed):
    """Pairs between nodes, and modes that exchange their shapes between nodes: none missed, none invented."""
    tabled = on_steep_tables(seed)
    found = tabled.run_critical_speed(limit=3000.0, count=60)
    direct = searched(lambda v: tabled.run_modal(v).eigenvalues, 3.0, 3000.0)
    light = (found.damping_ratio < 0.5) & (found.wn > 3.0)
    assert found.proven and found.wn[light] == pytest.approx(direct[:, 0], rel=1e-6)
    assert (found.upward[light] == (direct[:, 2] > 0)).all()


def test_bearings_without_stiffness_at_rest_lose_no_critical_speed():
    soft = rotor([0.0, 6e6], [0.0, 600.0])
    found = soft.run_critical_speed(limit=600.0, count=50)
    below = [np.sum(soft.run_modal(v).wn < v) for v in (600.0, 1e-3)]
    assert found.proven and np.sum(~found.upward) - np.sum(found.upward) == below[0] - below[1]
    for speed in found.wn:
        assert np.abs(soft.run_modal(speed).wn / speed - 1).min() < 1e-7


def test_branches_say_where_they_begin_and_end():
    """An oscillator that rises through the reach, one that is damped away."""

    def family(x):
        return oscillators([50.0 + 60 * x, 20.0], [0.1, 0.2 + 0.5 * x])

    found = follow(family, [0.0, 1.0], REGION)
    assert sorted((b.begins, b.ends) for b in found.branches) == [("first value", "damping"), ("first value", "reach")]
    lines, lost = crossings(lambda x: family(x / 100), follow(lambda x: family(x / 100), [0.0, 100.0], REGION), (1.0,))
    assert not lost and [c.at for c in lines] == pytest.approx([20.0], rel=1e-12) and not lines[0].upward


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("jump", [0.2, 1e-4])
def test_where_a_frequency_jumps_over_the_line_it_crosses_at_the_jump_in_either_sense(jump, sense):
    """An oscillator at 20 that falls by a part at the speed 20 (1 - jump / 3): above the line before, below behind."""
    at = 20.0 * (1 - jump / 3)

    def family(x):
        return oscillators([20.0 if abs(x) < at else 20.0 * (1 - jump), 70.0], [0.1, 0.2])

    found = follow(family, sorted((sense * 5.0, sense * 45.0)), REGION)
    (crossing,), lost = crossings(family, found, (1.0,))
    assert not lost and not crossing.upward and crossing.at == pytest.approx(sense * at, rel=2e-11)
    assert abs(crossing.modes.values[0]) == pytest.approx(20.0, rel=1e-12)  # the nearer side


@dataclass(frozen=True)
class Jumping:
    """A rigid rotor on two equal isotropic bearings whose stiffness jumps at a speed, to other vectors of all modes.

    Coordinates: x, y of the centre, tilts in the xz and yz plane, motions of films, which creep; over the roots of
    their masses, and turned at random behind the jump. Either stiffness is that of both motions, or of each.
    """

    first: float | tuple[float, float]
    second: float | tuple[float, float]
    at: float = 7.0
    m: float = 2.0
    Id: float = 1.5
    Ip: float = 1.0
    films: int = 20

    def __call__(self, speed):
        behind, n = abs(speed) > self.at, 4 + self.films
        k, D = np.array(self.second if behind else self.first), np.zeros((n, n))
        K = np.diag([*np.repeat(2 * k / np.array([self.m, self.Id]), 2), *self.films * [100.0]])
        D[2, 3], D[3, 2] = self.Ip / self.Id * speed, -self.Ip / self.Id * speed
        D[range(4, n), range(4, n)] = np.linspace(100.0, 400.0, self.films)
        Q = np.linalg.qr(np.random.default_rng(2).standard_normal((n, n)))[0] if behind else np.eye(n)
        return SecondOrder(np.eye(n), Q.T @ D @ Q, Q.T @ K @ Q)

    @property
    def criticals(self):
        """Speeds of the double line of translation and of both cones, each on its side of the jump."""
        for k, behind in ((self.first, False), (self.second, True)):
            k = np.repeat(np.broadcast_to(k, 2), 2)
            speeds = np.sqrt(2 * k / np.array([self.m, self.m, self.Id - self.Ip, self.Id + self.Ip]))
            yield from (v for v in speeds.tolist() if (v > self.at) == behind)


def asked_at_most(family, times):
    """The family, which fails where it is asked more often."""
    asked = []

    def counted(speed):
        asked.append(speed)
        assert len(asked) <= times
        return family(speed)

    return counted


@pytest.mark.parametrize(("rotor", "count", "sure"), [
    (Jumping(50.0, 60.0, at=6.0), 4, True), (Jumping(50.0, 60.0), 4, False), (Jumping(50.0, 40.0), 2, False),
    (Jumping((50.0, 10.0), (40.0, 70.0)), 4, False),
])  # fmt: skip
@pytest.mark.parametrize("around", [1.0, 1e-6, 1e-10, 1e-13])
def test_a_jump_to_other_modes_ends_the_halving_above_the_rounding_of_the_speed(around, rotor, count, sure):
    """No mode before the jump is one of those behind it, and all lines are double or a rotor's cones.

    Where all lie above the order line on both sides of the jump, the crossings are those of the closed form. Where some
    lie below it the jump is listed: as many of the same sense, or two more on softer bearings, or those of translation
    in the place of both cones, which leap up as they leap down.
    """
    family, ends = asked_at_most(rotor, 500), [rotor.at - 5.0 * around, rotor.at + 24.0 * around]
    found = follow(family, ends, REGION)
    lines, lost = crossings(family, found, (1.0,))
    exact = sorted(v for v in rotor.criticals if ends[0] < v < ends[1])
    assert len(exact) == (count if around == 1.0 else 0) and len(found.uncertain) == 1
    assert [line.at for line in lines] == pytest.approx(exact, rel=1e-9)
    assert len(lost) == (not sure) and all(a <= rotor.at < b and b - a < 2e-10 for a, b in lost)


def whirling(speeds, k, c, cross):
    """A disc between two bearings with tables of stiffness, damping and cross-coupling."""
    shaft, disc = [ShaftElement(0.25, 0.0, 0.1) for _ in range(2)], DiskElement(1, 50.0, 0.0, 1.0)
    k, c, cross = (np.broadcast_to(np.asarray(x, float), len(speeds)) for x in (k, c, cross))
    return Rotor(shaft, [disc], [BearingElement(n, k, c, kxy=cross, kyx=-cross, frequency=speeds) for n in (0, 2)])


def test_damping_that_is_lost_between_two_speeds_only_is_an_onset():
    """At a kink of the tables; and between two kinks, where c omega bends below a straight line of the coupling."""
    peak, grid = [0.0, 430.0, 450.0, 470.0, 1000.0], np.linspace(0.0, 900.0, 10)
    assert np.isnan(whirling(peak, 1e6, 200.0, 0.0).run_stability(grid).onset)
    found = whirling(peak, 1e6, 200.0, [0.0, 0.0, 1e5, 0.0, 0.0]).run_stability(grid)
    assert (found.log_dec > 0).all() and 430.0 < found.onset < 450.0
    ends, k, c = [0.0, 1000.0], np.array([2.5e5, 4e6]), np.array([50.0, 800.0])
    omega = [whirling(ends, k, c, 0.0).run_modal(v).wn[0] for v in ends]
    found = whirling(ends, k, c, 0.9 * c * omega).run_stability(ends)
    assert (found.log_dec > 0).all() and 0.0 < found.onset < 500.0


@pytest.mark.parametrize(("least", "slopes", "loss", "decided"), [
    (-0.01, True, True, True), (0.01, True, False, True), (-0.01, False, False, False), (2e-7, True, False, False),
])  # fmt: skip
def test_a_step_is_decided_only_where_tangents_are_known_and_halving_ends(least, slopes, loss, decided):
    """A damping ratio is a parabola with its least value between two speeds: below zero, well above it, unknown, or so
    near to it that tangents of the shortest steps cross it still."""

    def place(x):
        zeta, slope = least + (x - 0.37) ** 2, 2 * (x - 0.37) if slopes else np.nan
        return ModesAt(x, (zeta, 1.0), np.array([zeta]), lambda towards: np.array([slope]))

    found, sure = first_loss(place, [place(0.0), place(1.0)], xtol=1e-12, rtol=1e-12)
    assert (found is not None, sure) == (loss, decided)
    assert found is None or found[0] == pytest.approx(0.27, rel=1e-6)


@pytest.mark.parametrize("disc", [(0.07, 0.28), (0.01, 0.8)])
def test_undamped_critical_speeds_are_as_many_as_the_signs_of_a_determinant_say(disc):
    """Every change of sign of det(K - omega^2 M) in a fine sweep is one of them; a flat disc has fewer."""
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(4)]
    some = Rotor(shaft, [DiskElement.from_geometry(1, steel, disc[0], 0.05, disc[1])],
                 [BearingElement(n, 1e7, 0.0) for n in (0, 4)])  # fmt: skip
    found = some.run_ucs((1e6, 1e9), num=4, num_modes=3)
    assert (found.missing == 0).all()
    M, K, plane = _forward_plane(some, True)
    for k, wn in zip(found.stiffness, found.wn.T, strict=True):
        held = K + np.diag(k * np.isin(plane, [some.layout.place(n) for n in (0, 4)]))
        sweep = np.linspace(1.0, 1.001 * np.nanmax(wn), 4000)
        signs = [np.linalg.slogdet(held - v * v * M)[0] for v in sweep]
        assert np.count_nonzero(np.diff(signs)) == np.isfinite(wn).sum()


FLAT = Rotor(
    [ShaftElement(0.05, 0.0, 0.05) for _ in range(24)],
    [DiskElement(k, 5.0, 0.02, 0.2) for k in range(1, 24, 2)],
    [BearingElement(n, 1e7, 0.0) for n in (0, 24)],
)
"""A shaft with twelve flat discs, as many negative 1 / omega^2 of which are larger than the wanted positive ones."""


@pytest.mark.parametrize(("ends", "num_modes", "rel"), [((1e6, 1e11), 4, 1e-9), ((1e2, 1e12), 20, 1e-6)])
def test_flat_discs_take_no_critical_speed_from_the_map_but_their_own(ends, num_modes, rel):
    """The positive eigenvalues of M x = mu K x, 25 of 50, against LAPACK; the 20th is 3e7 times below the first."""
    found = FLAT.run_ucs(ends, num=12, num_modes=num_modes)
    M, K, plane = _forward_plane(FLAT, True)
    for k, wn in zip(found.stiffness, found.wn.T, strict=True):
        held = K + np.diag(k * np.isin(plane, [FLAT.layout.place(n) for n in (0, 24)]))
        assert wn == pytest.approx(eigh(M, held, eigvals_only=True)[: -num_modes - 1 : -1] ** -0.5, rel=rel)
    assert (found.missing == 0).all()


def test_a_map_says_nan_missing_where_its_search_has_not_ended(monkeypatch):
    monkeypatch.setattr(critical, "_ITERATIONS", 4)
    found = FLAT.run_ucs(num=12)
    assert found.missing[0] == 0 and np.isnan(found.missing[1:]).all()


@pytest.mark.parametrize("rate", [6e3, 14e3, 3e5])
def test_growth_without_oscillation_is_found_however_far_beyond_the_region(rate):
    """One negative stiffness among 75 oscillators: a real root far beyond the reach of a large pencil."""
    rng = np.random.default_rng(3)
    wn, zeta, Q = rng.uniform(5, 400, 75), rng.uniform(0.01, 0.9, 75), np.linalg.qr(rng.standard_normal((75, 75)))[0]
    stiffness, damping = wn**2, 2 * zeta * wn
    stiffness[0], damping[0] = -(rate**2), 0.0
    found = modes_in(SecondOrder(np.eye(75), Q.T @ np.diag(damping) @ Q, Q.T @ np.diag(stiffness) @ Q), REGION)
    real = np.abs(found.values.imag) <= 1e-6 * np.abs(found.values)
    assert found.proven and found.values.real[real].max() == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("top", [1e-4, 0.1, 1.0, 100.0])
def test_planes_that_part_by_less_than_rounding_tells_take_no_steps(top):
    """Two planes of frequency 1 that gyroscopics alone part, from equal to distinct: eleven nodes.

    Closed form: M = K = 1, D = 2 g v [[0, 1], [-1, 0]] with g = 1e-7, wn = 1 -+ g v.
    """
    one, turn = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    found = follow(lambda v: SecondOrder(one, 0.02 * one + 2e-7 * v * turn, one), [0.0, top], Region(10.0, 1e-3))
    assert len(found.nodes) == 11 and len(found.branches) == 2 and not found.uncertain
    for branch in found.branches:
        v, s = found.values(branch)
        assert np.abs(s) == pytest.approx(np.ones(len(v)), rel=2e-7 * top + 1e-9)
        assert {branch.begins, branch.ends} == {"first value", "last value"}
