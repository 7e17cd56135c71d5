"""Contact of the journal with its sleeve: force law, and runs that continue through contact."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from reynolds.grid import cells
from rotorsim.effects.film.contact import contact

CLEARANCE, ASPERITY = 25e-6, 0.25e-6
GAP = CLEARANCE - ASPERITY
LAW = SimpleNamespace(stiffness=2e7, damping=1.0, friction=0.15, slip_speed=1e-3, asperity=ASPERITY)


def law(clearance, x, y, vx, vy, surface_speed, p):
    """The contact's law in a plain sleeve: one place, towards which the journal reaches by its eccentricity."""
    e = math.hypot(x, y)
    return contact.py_func(clearance, e, x / e, y / e, e, vx, vy, surface_speed, p)


def test_no_force_before_touch_and_none_at_neutral_stiffness():
    soft = SimpleNamespace(**{**vars(LAW), "stiffness": 0.0})
    assert law(CLEARANCE, 0.6 * GAP, 0.7 * GAP, 0.1, 0.0, 10.0, LAW) == (0.0,) * 6
    assert law(CLEARANCE, 2 * GAP, 0.0, 0.1, 0.0, 10.0, soft) == (0.0,) * 6


@pytest.mark.parametrize("angle", np.radians([0, 70, 200, 300]))
def test_the_sleeve_pushes_back_and_friction_drives_the_journal_backward(angle):
    """Shaft turning from x to y, journal at rest: N = k delta inwards, mu N against the surface (tanh 1e4 is 1)."""
    depth, n, t = 1e-7, np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    force = np.array(law(CLEARANCE, *((GAP + depth) * n), 0.0, 0.0, 10.0, LAW)[:2])
    assert force @ n == pytest.approx(-LAW.stiffness * depth, rel=1e-8)
    assert force @ t == pytest.approx(-LAW.friction * LAW.stiffness * depth, rel=1e-8)
    turned = np.array(law(CLEARANCE, *((GAP + depth) * n), 0.0, 0.0, -10.0, LAW)[:2])
    assert turned @ t == pytest.approx(-(force @ t), rel=1e-12)


def test_a_rebound_never_sticks_and_an_impact_is_harder_than_a_rest():
    def normal(speed):
        return -law(CLEARANCE, GAP + 1e-7, 0.0, speed, 0.0, 0.0, LAW)[0]

    assert normal(-2.0) == 0.0
    assert normal(0.5) == pytest.approx(1.5 * normal(0.0), rel=1e-12)


@pytest.mark.parametrize("surface_speed", [12.0, 5e-4, -12.0])
def test_the_stiffness_handed_to_the_step_is_the_derivative_of_the_force(surface_speed):
    """Central differences of 10 pm on 100 nm of depth, journal at rest: truncation and round-off leave 1e-6."""
    place, step = (GAP + 1e-7) * np.array([math.cos(0.7), math.sin(0.7)]), 1e-11

    def at(x):
        return np.array(law(CLEARANCE, x[0], x[1], 0.0, 0.0, surface_speed, LAW))

    differences = np.column_stack([(at(place - e) - at(place + e))[:2] / (2 * step) for e in step * np.eye(2)])
    stiffness = at(place)[2:].reshape(2, 2)
    assert stiffness == pytest.approx(differences, abs=1e-5 * np.abs(stiffness).max())


def run_in_pieces(plant, inputs, speed):
    """Table of a run that starts at the equilibrium, and the simulation."""
    run = plant.start(speed, inputs[0, 1])
    return run.advance(inputs), run


@pytest.mark.parametrize("n_z", [8, pytest.param(16, marks=pytest.mark.slow)])
@pytest.mark.parametrize("force", [(700.0, 0.0), (0.0, -700.0)])
def test_a_hard_hit_touches_rebounds_and_settles(rig, held, n_z, force):
    """2 ms of 700 N on the disc: a penetration of a few microns, no NaN, and rest 1 s later.

    The bound of 8 um is the impact's energy at the journal in a spring of 20 MN/m, several times over.
    """
    plant = rig(n_z=n_z)
    inputs = held(5000, 300.0, 0.5e6)
    inputs[10:20, 4:] = force
    table, run = run_in_pieces(plant, inputs, 300.0)
    assert np.all(np.isfinite(table)) and np.all(np.isfinite(run.w))
    touching, h_min = table[:, 11] > 0, table[:, 9]
    assert -8e-6 < h_min.min() < 0.25e-6
    assert touching.any() and not touching[-2500:].any()
    assert run.counters["substeps"] > 0
    assert table[-1, :2] == pytest.approx(plant.equilibrium(300.0, 0.5e6).disc, abs=1e-8)


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.0])
def test_a_step_near_contact_is_as_small_as_its_error_asks(rig, held, angle):
    """2 ms of 500 N and what follows for 6 ms, steps of .2 ms against 5 us.

    The journal is .04 to .12 um off on the mean; whole steps were 1.8 to 2.5 um off, and .23 to .36 where only the
    step at whose pace it meets its sleeve is parted, not the blow's first one.
    """
    inputs = held(50, 300.0, 0.5e6)
    inputs[10:20, 4:] = 500.0 * np.cos(angle), 500.0 * np.sin(angle)

    def run(dt):
        run = rig(dt=dt).start(300.0, 0.5e6)
        return run.advance(inputs)[:, 2:4], run.counters["substeps"]

    exact, _ = run(5e-6)
    journal, parts = run(2e-4)
    assert np.hypot(*(journal - exact).T)[10:].mean() < 0.2e-6
    assert 0 < parts < 64 * 40


def test_without_contact_nearby_no_bit_depends_on_it(rig, held):
    """30 N for 2 ms move the journal by 5 um: the same bits with a contact of any stiffness, also none."""
    inputs = held(60, 300.0, 0.5e6)
    inputs[10:20, 4] = 30.0
    tables = []
    for stiffness in ("0 N/m", "200 MN/m"):
        table, run = run_in_pieces(rig({"effects.contact.stiffness": stiffness}), inputs, 300.0)
        assert run.counters["substeps"] == 0
        tables.append(table)
    assert np.ptp(tables[0][:, 2]) > 3e-6
    assert np.array_equal(*tables)


def test_the_film_keeps_its_floor_while_the_journal_is_in_the_sleeve(rig, held):
    plant, floor = rig(), 2.5e-7
    inputs = held(60, 300.0, 0.5e6)
    inputs[10:20, 4] = 700.0
    run = plant.start(300.0, 0.5e6)
    L, thinnest, deepest = plant.assembly.film, [], []
    for row in inputs:
        deepest.append(run.advance(row[None])[0, 9])
        thinnest.append(run.w[L.h + cells(L)].min())
    assert min(deepest) < 0
    assert floor <= min(thinnest) < 2 * floor


@pytest.mark.parametrize(
    ("rpm", "unbalance"),
    [(6000, "200 g*mm"), (20000, "6.5 g*mm")],
    ids=["thirty times the unbalance", "past the whirl threshold"],
)
@pytest.mark.parametrize("n_z", [8, pytest.param(16, marks=pytest.mark.slow)])
def test_motions_as_large_as_the_clearance_run_to_their_end(rig, held, rpm, unbalance, n_z):
    """Half a second at .3 MPa: the film thins below a twentieth of the clearance, the numbers stay finite.

    Whether the surfaces touch (at .25 um) or a film of half a micron still carries is the grid's choice.
    """
    speed = rpm * np.pi / 30
    table, run = run_in_pieces(rig({"effects.unbalance.me": unbalance}, n_z=n_z), held(2500, speed, 0.3e6), speed)
    assert np.all(np.isfinite(table)) and np.all(np.isfinite(run.w))
    assert -2e-6 < table[:, 9].min() < 1.25e-6
    assert np.ptp(table[-500:, 0]) > 50e-6


OVAL = {
    "effects.out_of_round.sleeve": "9 um",
    "effects.contact.stiffness": "20 MN/m",
    "effects.contact.friction": 0.15,
    "effects.contact.asperity": "0.25 um",
}
"""Sleeve that is 9 um wider along x and 9 um narrower along y."""


@pytest.mark.parametrize(("axis", "force"), [(4, 1500.0), (5, 300.0)])
def test_contact_acts_where_the_gap_closes_and_only_there(neutral, held, axis, force):
    """An oval sleeve: room for 34 um along x and 16 um along y, not for 25 um.

    2 ms of a force on the disc: where the gap of a sample is 0.1 um below the asperities there was contact, also within
    24 um along y, and beyond 25.5 um along x there are samples without any. The steps are small enough to be solved at
    once: halved ones at the hit move a gap by half a micron.
    """
    inputs = held(60, 300.0, 0.5e6)
    inputs[10:20, axis] = force
    table, _ = run_in_pieces(neutral(OVAL, dt=1e-5), inputs, 300.0)
    gap, touched, moved = table[:, 9], table[:, 11] > 0, np.hypot(table[:, 2], table[:, 3])
    closed = gap < 0.15e-6
    assert closed.any() and touched[closed].all()
    assert ((moved > 25.5e-6) & ~touched if axis == 4 else closed & (moved < 24e-6)).any()


def test_contact_brakes_the_shaft_by_its_friction_at_the_journal(neutral, held):
    """J d(Omega) = -mu R int N dt, N = k delta of the samples' gaps; the drag of the film is that of a run without mu.

    Samples of 0.2 ms see a penetration of a few ms: 5 %.
    """
    values = {"effects.contact.stiffness": "20 MN/m", "effects.contact.friction": 0.0}
    inputs = held(60, 300.0, 0.5e6)
    inputs[:, 0] = np.nan
    inputs[10:40, 4] = 500.0
    lost = []
    for friction in (0.0, 0.05):
        plant = neutral(values | {"effects.contact.friction": friction})
        table, _ = run_in_pieces(plant, inputs, 300.0)
        lost.append(table[0, 5] - table[-1, 5])
        depth = np.maximum(plant.machine.effects["contact"][0].asperity - table[:, 9], 0.0)
    expected = 0.05 * 0.02 * 2e7 * depth.sum() * plant.assembly.sampling_time / plant.assembly.P.inertia
    assert depth.any() and lost[1] - lost[0] == pytest.approx(expected, rel=0.05)
