"""Room of a journal in its sleeve against the gap that the film itself has there."""

import numpy as np
import pytest

from reynolds import kernels
from rotorsim.machine import load_machine
from rotorsim.plant.assemble import make_films
from rotorsim.plant.simulation import journal_room

DIRECTIONS = np.linspace(0, 2 * np.pi, 13)
FORMS = {
    "plain": {},
    "lobes": {"lobes": {"count": 3, "preload": 0.5}},
    "jumps": {"lobes": {"count": 3, "preload": 0.5, "offset": 0.3}},
    "pockets": {"steps": [{"count": 4, "depth": "6 um", "arc": "50 deg"}]},
}


@pytest.mark.parametrize("name", FORMS)
def test_the_gap_closes_at_the_edge_of_the_room(name):
    """In every direction, to round-off."""
    machine = load_machine("rigid_rotor_self_acting")
    for part, value in FORMS[name].items():
        machine = machine.replace(f"bearings.0.{part}", value)
    model = make_films(machine)[0]
    layout, w, _ = model.build()
    for at, room in zip(DIRECTIONS, journal_room(machine, 0, DIRECTIONS), strict=True):
        w[layout.journal : layout.journal + 2] = room * np.cos(at), room * np.sin(at)
        assert kernels.least_gap(w, model.record()[0], layout) == pytest.approx(0.0, abs=1e-15)


def test_effects_take_their_share_of_the_room():
    """c + a cos 2 theta of an oval sleeve, less 21 nm of growth at 6000 rpm, less the turning lobe of the journal."""
    machine = load_machine("dtu_gas_bearing").replace("effects.out_of_round.sleeve", "4 um")
    c = machine.films[0].clearance
    assert journal_room(machine, 0, np.array([np.pi / 2]))[0] == pytest.approx(c - 4e-6, rel=1e-9)
    grown = machine.replace("effects.clearance_growth.growth", "21 nm")
    assert journal_room(grown, 0, np.array([np.pi / 2]), 200 * np.pi)[0] == pytest.approx(c - 4.021e-6, rel=1e-9)
    lobed = grown.replace("effects.out_of_round.journal", "1 um")
    assert journal_room(lobed, 0, np.array([np.pi / 2]))[0] == pytest.approx(c - 5e-6, rel=1e-9)
