"""Rotor on linear bearings: the plant equals the finite-element rotor."""

import numpy as np
import pytest

from fe_shaft.modal import run_modal
from fe_shaft.response import run_static, run_unbalance_response
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

pytestmark = pytest.mark.numerical

SPEED = 150.0
SAMPLE = 2e-4


@pytest.fixture(scope="module")
def plant(changed):
    """The plain rotor with all of its low modes and no damping ratio of its own, which the elements do not have."""
    values = {"solver.modes_per_plane": 12, "shaft.damping_ratio": 0.0}
    return Plant(changed(load_machine("plain_rotor"), values))


def test_without_a_film_the_modes_are_those_of_the_finite_elements(plant):
    """Twelve modes a plane carry the first two pairs within 1e-6: what is left out is above 20 kHz."""
    assert plant.assembly.film_model is None
    expected = run_modal(plant.assembly.mesh.rotor, SPEED)
    model = plant.linearise(SPEED)
    assert model.wn[:4] == pytest.approx(expected.wn[:4], rel=1e-5)
    assert model.zeta[:4] == pytest.approx(expected.damping_ratio[:4], rel=1e-2, abs=1e-7)


def test_without_a_film_the_sag_is_that_of_the_finite_elements(plant):
    """Eight microns; the modes left out carry 1e-5 of it."""
    mesh = plant.assembly.mesh
    expected = run_static(mesh.rotor, gravity=9.81).displacement
    node = 4 * mesh.node(mesh.probe)
    assert plant.equilibrium().disc == pytest.approx(expected[node : node + 2], rel=1e-4, abs=1e-15)


def test_without_a_film_unbalance_whirls_as_the_finite_elements_do(plant, changed):
    """After the transient: bearing dampers a hundred times the shipped ones let it die within 2 s.

    .1 % holds the modes left out and the step's own error, (omega dt)^2 / 12 = 2e-5 at .1 ms.
    """
    values = {f"bearings.{i}.cxx": "20000 N*s/m" for i in range(2)}
    damped = Plant(changed(plant.machine, values))
    mesh = damped.assembly.mesh
    node = mesh.node(mesh.probe)
    expected = run_unbalance_response(mesh.rotor, node, 25e-6, 0.0, SPEED).response[4 * node : 4 * node + 2, 0]
    decay = damped.linearise(SPEED).eigenvalues.real.max()
    duration = round(-12 / decay / SAMPLE + 2000) * SAMPLE
    record = damped.simulate(duration, SPEED).isel(time=slice(-2000, None))
    angle = record["angle"].values
    basis = np.column_stack([np.cos(angle), -np.sin(angle), np.ones_like(angle)])
    cosine, sine, _ = np.linalg.lstsq(basis, record["disc"].values, rcond=None)[0]
    assert np.abs(cosine + 1j * sine - expected) == pytest.approx(0, abs=1e-3 * np.abs(expected).max())
    assert "film_force" not in record and "contact" not in record
