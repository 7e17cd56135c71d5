"""Generator of laws on the independent rotor: what it solves, what it draws, and its judge."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.benchmarks.foreign_laws import (
    DISC_NODES,
    FLOOR,
    HIGHEST,
    LAWS,
    PERIOD,
    LawCase,
    change,
    drawn,
    excitation,
    judged,
    machine_of_laws,
    points,
    receptance,
    repeated,
)
from studies.benchmarks.foreign_rotor import BEARINGS, UNBALANCE, TwoDiscRig

RIG = TwoDiscRig(tuple(own for _, *own in BEARINGS), tuple((me, 0.3) for me in UNBALANCE))
BY_NAME = {law.name: law for law in LAWS}


def test_there_are_fourteen_laws_of_six_speeds_two_amplitudes_and_two_repeats():
    assert len(LAWS) == len(BY_NAME) == 14 and len(points()) == 6 * 2 * 2
    assert sum(law.kind == "stochastic" for law in LAWS) == 4
    assert "gravity" not in machine_of_laws().effects


def test_a_law_that_is_a_stiffness_is_the_rotor_with_that_stiffness():
    """Solved at its place by the receptances without it, against the matrices with it."""
    case = LawCase(BY_NAME["softening with speed"], "right bearing", 0.3, RIG, 1)
    lines = np.arange(0.0, HIGHEST, 1 / PERIOD)
    found = repeated(case, 40, 1.0, case.size, {})
    more = receptance(case.rig, 40, lines, (DISC_NODES[0],), DISC_NODES,
                      lambda omega: case.size * case.law.stiffness(omega, 2 * np.pi * 40), case.node)  # fmt: skip
    held = np.ones(len(lines), complex)
    f = excitation(case.rig, 40, 1.0, lines)
    at = np.abs(f[:, 0]) > 0
    at[lines == 40] = False
    held[at] = np.sinc(lines[at] / 5000) * np.exp(-1j * np.pi * lines[at] / 5000)
    f[:, :2] *= held[:, None]
    assert found == pytest.approx(np.einsum("lij,lj->li", more, f), rel=1e-9, abs=1e-16)


@pytest.mark.parametrize("name", ["dry", "moving unbalance"])
def test_the_size_changes_the_response_by_three_to_ten_floors(name):
    case = drawn(BY_NAME[name], 2)
    assert 2.9 * FLOOR < change(case, case.size, {}) < 10.1 * FLOOR


@pytest.mark.parametrize(
    ("law", "found", "outcome"),
    [
        ("cubic", {"status": "unknown"}, "silent"), ("cubic", {"status": "named"}, "WRONG name"),
        ("line", {"status": "discovered", "kinds": ("cubic",)}, "WRONG law"),
        ("cubic", {"status": "discovered", "kinds": ("dry",)}, "WRONG law"),
        ("cubic", {"status": "discovered", "kinds": ("cubic",)}, "right"),
        ("cubic", {"status": "stochastic"}, "WRONG stochastic"), ("line", {"status": "stochastic"}, "right"),
    ],
)  # fmt: skip
def test_a_verdict_is_right_by_form_and_place(law, found, outcome, monkeypatch):
    case = LawCase(BY_NAME[law], "left bearing", 2.0, RIG, 1)
    place = f"the bearing {case.place.split()[0]}"
    monkeypatch.setattr("studies.benchmarks.foreign_laws.reduction", lambda gap: 1.0)
    own = SimpleNamespace(place=place, near=(), kinds=found.get("kinds", ()), terms={"cubic": (1.05 * case.size, 0.0)})
    force = SimpleNamespace(place=place, others=())
    verdict = SimpleNamespace(status=found["status"], gap=None, stochastic=force,
                              discovered=own if found["status"] == "discovered" else None)  # fmt: skip
    seen = judged(case, verdict)
    assert seen["outcome"] == outcome
    if outcome == "right" and law == "cubic":
        assert seen["error"] == pytest.approx(0.05)
