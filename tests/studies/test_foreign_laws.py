"""Generator of laws on the independent rotor: what it solves, what it draws, and its judge."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from studies.benchmarks.foreign_laws import (
    DISC_NODES,
    FLOOR,
    FORCE_LINES,
    HIGHEST,
    LAWS,
    PAIRS,
    PERIOD,
    PLACES,
    HiddenLaw,
    LawCase,
    change,
    drawn,
    drawn_pair,
    excitation,
    in_lines,
    in_time,
    judged,
    machine_of_laws,
    nonlinear,
    points,
    receptance,
    repeated,
)
from studies.benchmarks.foreign_rotor import BEARINGS, UNBALANCE, TwoDiscRig

RIG = TwoDiscRig(tuple(own for _, *own in BEARINGS), tuple((me, 0.3) for me in UNBALANCE))
BY_NAME = {law.name: law for law in LAWS}


def test_there_are_fourteen_laws_and_a_wander_of_six_speeds_two_amplitudes_and_two_repeats():
    assert len(LAWS) == len(BY_NAME) == 15 and len(points()) == 6 * 2 * 2
    assert sum(law.kind == "stochastic" for law in LAWS) == 5
    assert "gravity" not in machine_of_laws().effects


def test_a_law_that_is_a_stiffness_is_the_rotor_with_that_stiffness():
    """Solved at its place by the receptances without it, against the matrices with it."""
    case = LawCase(BY_NAME["softening with speed"], "right bearing", 0.3, RIG, 1)
    lines = np.arange(0.0, HIGHEST, 1 / PERIOD)
    found = repeated(case, 40, 1.0, case.size, {})
    more = receptance(case.rig, 40, lines, (DISC_NODES[0],), DISC_NODES,
                      lambda omega: case.size * case.law.stiffness(omega, 2 * np.pi * 40), case.node)  # fmt: skip
    assert found == pytest.approx(np.einsum("lij,lj->li", more, held_force(case, lines)), rel=1e-9, abs=1e-16)


def held_force(case, lines):
    """Lines of the forces at 40 Hz, whose samples are held."""
    held = np.ones(len(lines), complex)
    f = excitation(case.rig, 40, 1.0, lines)
    at = np.abs(f[:, 0]) > 0
    at[lines == 40] = False
    held[at] = np.sinc(lines[at] / 5000) * np.exp(-1j * np.pi * lines[at] / 5000)
    f[:, :2] *= held[:, None]
    return f


SPRING = HiddenLaw("spring", "spring", force=lambda u, v, angle, speed: -u)


@pytest.mark.parametrize("place", ["disc 1", "right bearing"])
@pytest.mark.parametrize("two", [(SPRING, BY_NAME["softening with speed"]), (BY_NAME["softening with speed"], SPRING),
                                 (SPRING, SPRING)])  # fmt: skip
def test_two_laws_at_once_are_the_rotor_with_both_of_them(two, place):
    """A spring in the time domain and a stiffness of lines, at one place or at two, against the matrices with both."""
    other = LawCase(two[1], "disc 1", -0.1 if two[1] is not SPRING else 3e4, RIG, 1)
    case = LawCase(two[0], place, 0.2 if two[0] is not SPRING else 2e4, RIG, 1, other)
    lines = np.arange(0.0, HIGHEST, 1 / PERIOD)
    found = repeated(case, 40, 1.0, case.size, {})
    nodes = [PLACES[one.place] for one in case.acting]
    K = [one.size * (1.0 if one.law is SPRING else -((2 * np.pi * 40) ** 2)) for one in case.acting]
    H = receptance(RIG, 40, lines, (DISC_NODES[0], *nodes), (*DISC_NODES, *nodes))
    Z = np.kron(np.diag(K), np.eye(2))
    f = held_force(case, lines)
    there = np.linalg.solve(np.eye(4) + H[:, 2:, 4:] @ Z, np.einsum("lij,lj->li", H[:, 2:, :4], f)[:, :, None])
    expected = np.einsum("lij,lj->li", H[:, :2, :4], f) - (H[:, :2, 4:] @ Z @ there)[:, :, 0]
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-12)


def test_steep_friction_next_to_a_cubic_force_has_a_periodic_motion():
    """At half the force simple steps have no end; the motion found obeys both laws, moment by moment."""
    case = drawn_pair("cubic and dry", 2)
    lines, known, speed = np.arange(0.0, HIGHEST, 1 / PERIOD), {}, 2 * np.pi * 16
    repeated(case, 16, 0.5, case.size, known)
    held = excitation(case.rig, 16, 0.5, lines)
    held[np.isin(lines, FORCE_LINES), :2] *= (np.sinc(lines / 5000) * np.exp(-1j * np.pi * lines / 5000))[
        np.isin(lines, FORCE_LINES), None]  # fmt: skip
    there, inner = np.einsum("lij,lj->li", known[16][:, 2:, :4], held), known[16][:, 2:, 4:]
    force = nonlinear(case.acting, there, inner, lines, speed)
    moved = there + np.einsum("lij,lj->li", inner, force)
    u, v = in_time(moved[:, :2]), in_time(2j * np.pi * lines[:, None] * moved[:, 2:])
    for own, expected in ((force[:, :2], -case.size * u**3), (force[:, 2:], -case.other.size * np.tanh(v / 3e-5))):
        np.testing.assert_allclose(own, in_lines(expected, len(lines)), atol=1e-7 * np.abs(force).max())


@pytest.mark.parametrize(("name", "factor"), [("dry", 1.0), ("moving unbalance", 1.0), ("dry", 1 / 3)])
def test_the_size_changes_the_response_by_three_to_ten_floors(name, factor):
    case = drawn(BY_NAME[name], 2, factor)
    assert 2.9 * FLOOR < change(case, case.size, {}) / factor < 10.1 * FLOOR


@pytest.mark.parametrize("name", PAIRS)
def test_each_law_of_a_pair_changes_the_response_by_three_to_ten_floors_alone(name):
    case = drawn_pair(name, 1)
    first, second = case.acting
    assert case.name == name and (first.place == second.place) == PAIRS[name][2] and first.rig is second.rig
    for one in (replace(case, other=None), second):
        assert 2.9 * FLOOR < change(one, one.size, {}) < 10.1 * FLOOR


@pytest.mark.parametrize(
    ("law", "found", "outcome"),
    [
        ("cubic", {"status": "unknown"}, "silent"), ("cubic", {"status": "named"}, "WRONG name"),
        ("line", {"status": "discovered", "kinds": ("cubic",)}, "WRONG law"),
        ("cubic", {"status": "discovered", "kinds": ("dry",)}, "WRONG law"),
        ("cubic", {"status": "discovered", "kinds": ("cubic",)}, "right"),
        ("cubic", {"status": "stochastic"}, "WRONG stochastic"), ("line", {"status": "stochastic"}, "right"),
        ("broadband", {"status": "stochastic"}, "WRONG kind"),
    ],
)  # fmt: skip
def test_a_verdict_is_right_by_form_and_place(law, found, outcome, monkeypatch):
    case = LawCase(BY_NAME[law], "left bearing", 2.0, RIG, 1)
    place = f"the bearing {case.place.split()[0]}"
    monkeypatch.setattr("studies.benchmarks.foreign_laws.reduction", lambda gap: 1.0)
    own = SimpleNamespace(place=place, near=(), tied=(), kinds=found.get("kinds", ()), places=(),
                          terms={"cubic": (1.05 * case.size, 0.0)})  # fmt: skip
    force = SimpleNamespace(kind="line", place=place, others=())
    verdict = SimpleNamespace(status=found["status"], gap=None, stochastic=force,
                              discovered=own if found["status"] == "discovered" else None)  # fmt: skip
    seen = judged(case, verdict)
    assert seen["outcome"] == outcome
    if outcome == "right" and law == "cubic":
        assert seen["error"] == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("kinds", "place", "outcome"),
    [
        (("cubic", "drag"), "disc 1", "right"), (("drag",), "disc 1", "right, one of two"),
        (("radial cubic",), "disc 1", "right, one of two"), (("cubic", "dry"), "disc 1", "WRONG law"),
        (("cubic",), "disc 0", "WRONG place"),
    ],
)  # fmt: skip
def test_of_two_laws_at_a_place_one_or_both_may_be_found(kinds, place, outcome, monkeypatch):
    monkeypatch.setattr("studies.benchmarks.foreign_laws.reduction", lambda gap: 1.0)
    case = LawCase(BY_NAME["cubic"], "disc 1", 2.0, RIG, 1, LawCase(BY_NAME["drag"], "disc 1", 3.0, RIG, 1))
    sizes = {"cubic": 2.1, "radial_cubic": 2.1, "drag": 3.3, "dry": 1.0}
    own = SimpleNamespace(place=place, near=(), tied=(), kinds=kinds, places=(),
                          terms={(key := kind.replace(" ", "_")): (sizes[key], 0.0) for kind in kinds})  # fmt: skip
    seen = judged(case, SimpleNamespace(status="discovered", gap=None, discovered=own))
    assert seen["outcome"] == outcome
    if outcome.startswith("right"):
        assert seen["error"] == pytest.approx(0.1 if "drag" in kinds else 0.05)


@pytest.mark.parametrize(("places", "outcome"), [(("disc 1", "the bearing left"), "right"),
                                                 (("the bearing left", "disc 1"), "WRONG place")])  # fmt: skip
def test_two_laws_at_two_places_are_right_each_at_its_own(places, outcome, monkeypatch):
    monkeypatch.setattr("studies.benchmarks.foreign_laws.reduction", lambda gap: 1.0)
    case = LawCase(BY_NAME["cubic"], "disc 1", 2.0, RIG, 1, LawCase(BY_NAME["dry"], "left bearing", 0.5, RIG, 1))
    own = SimpleNamespace(place=places[0], near=(), tied=(), kinds=("cubic", "dry"),
                          places=tuple((z, 0.0) for z in places),
                          terms={"cubic": (2.0, 0.0), "dry": (0.55, 0.0)})  # fmt: skip
    seen = judged(case, SimpleNamespace(status="discovered", gap=None, discovered=own))
    assert seen["outcome"] == outcome and seen["error"] == pytest.approx(0.1)
