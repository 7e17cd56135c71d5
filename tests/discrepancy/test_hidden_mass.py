"""Hidden masses in the plant: the bearing that one is answers as its closed form does, and a machine file takes it."""

import numpy as np
import pytest

from rotorsim import Machine
from rotorsim.base.errors import MachineFileError
from rotorsim.discrepancy.discovery import LIBRARY, LawTerm, ProposedLaw
from rotorsim.discrepancy.hidden_mass import HiddenMass, mass_of
from rotorsim.plant.assemble import assemble
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import settle
from studies.benchmarks.foreign_laws import machine_of_laws

TERM = next(one for one in LIBRARY if one.resonates)
SHAPE = {"resonance": 390.0, "damping_ratio": 0.03}


def law_at(place, size=0.02, one=True):
    coefficients = np.array([size] if one else [size, size])
    return ProposedLaw(
        place, (LawTerm(TERM, tuple(SHAPE.items()), one),), coefficients, 0.0, 0.0, 0.0, np.zeros(0), coefficients
    )


def receptances(machine: Machine, z: float, omega: np.ndarray, speed: float = 200.0) -> np.ndarray:
    """Receptances (lines, 2, 2) [m/N] at a coordinate."""
    a = assemble(machine)
    plant, shape = linearise(a, settle(a, speed, 0.0), speed), a.mesh.shape_between(z)
    return np.array([shape @ np.linalg.solve(plant.dynamic_stiffness(1j * w), shape.T) for w in omega])


def test_the_shaft_with_a_hidden_mass_answers_as_the_shaft_without_it_next_to_its_dynamic_stiffness():
    machine = machine_of_laws()
    mass = mass_of(law_at("disc 1"), machine)
    omega = np.array([60.0, 250.0, 380.0, 390.0, 402.0, 700.0])
    H = receptances(machine, mass.position, omega)
    more = 0.02 * TERM.memory(omega, **SHAPE)
    expected = np.linalg.inv(np.linalg.inv(H) + more[:, None, None] * np.eye(2))
    found = receptances(mass.added_to(machine), mass.position, omega)
    assert np.abs(found / expected - 1)[:, [0, 1], [0, 1]].max() < 2e-3
    assert np.abs(expected / H - 1)[:, [0, 1], [0, 1]].max() > 0.1  # it shows


def test_a_law_is_a_hidden_mass_in_the_plant_where_it_is_alike_along_x_and_y_and_no_bearing_stands_there():
    machine = machine_of_laws()
    assert mass_of(law_at("disc 1"), machine) == HiddenMass(machine.discs[1].position, 0.02, **SHAPE)
    assert mass_of(law_at("disc 1", one=False), machine) is None
    assert mass_of(law_at("disc 1", -0.02), machine) is None
    assert mass_of(law_at("the bearing left"), machine) is None
    with pytest.raises(MachineFileError):
        HiddenMass(machine.bearings[0].position, 0.02, **SHAPE).added_to(machine)


def test_the_law_states_the_table_that_the_machine_file_takes():
    machine, mass = machine_of_laws(), HiddenMass(0.3, 0.02, **SHAPE)
    added = mass.added_to(machine).bearings[-1]
    assert added.support.mass == 0.02 and added.kxx == pytest.approx(0.02 * 390.0**2, rel=1e-9)
    assert added.cxx == pytest.approx(2 * 0.03 * 390.0 * 0.02, rel=1e-9)
    assert mass.table["kxx"] in mass.law and mass.table["support"]["mass"] in mass.law
