"""Places of candidates: each disc, end and support, and where the machine file has such an effect, by name."""

import numpy as np
import pytest

from rotorsim.base.errors import MachineFileError
from rotorsim.discrepancy.calibration import GRID, ParameterPoint
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.machine_file import IdentifiedEffect
from rotorsim.discrepancy.result import found_of
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine


@pytest.fixture(scope="module")
def two_discs():
    """The plain rotor with its disc in two halves, at a third and at three quarters of the span."""
    one = load_machine("plain_rotor")
    (disc,) = one.discs
    half = {"mass": disc.mass / 2, "polar_inertia": 0.006, "diametral_inertia": 0.003}
    return one.with_({"discs": [{"position": 0.2, **half}, {"position": 0.45, **half}]})


def keys(machine, effect, only=None):
    return {f.key for f in candidates(Twin(machine, GRID, 2e-4, only=only)) if f.effect == effect}


def test_a_seal_is_a_candidate_at_every_disc_and_support(two_discs):
    ends = two_discs.bearings_in_words
    places = {"disc 0", "disc 1", *ends}
    assert keys(two_discs, "labyrinth_seal") == {
        f"labyrinth_seal.{p} of {place}" for p in ("damping", "cross_stiffness") for place in places
    }
    assert keys(two_discs, "crack") == {"crack.loss of disc 0", "crack.loss of disc 1"}


def test_a_place_that_the_machine_file_states_is_kept(two_discs):
    own = two_discs.replace("effects.labyrinth_seal", {"damping": "10 N*s/m", "position": "350 mm"})
    assert "labyrinth_seal.damping of the shaft at 350 mm" in keys(own, "labyrinth_seal")


@pytest.mark.parametrize(
    "place", ["the bearing left", "bearing 1", "disc 1", "the left end", "the plane of the probes"]
)
def test_a_disc_with_the_name_of_another_place_is_refused(place, two_discs):
    """A law or an effect there and one at the disc would have one name."""
    changes = {"bearings.0.name": "left", "bearings.1.name": None, "discs.1.name": None}
    own = two_discs.with_({**changes, "discs.0.name": "disc 0"})
    assert own.disc_names == ("disc 0", "disc 1") and len({*own.disc_names, *own.bearings_in_words}) == 4
    with pytest.raises(MachineFileError) as refused:
        two_discs.with_({**changes, "discs.0.name": place})
    assert [problem.startswith(f"discs.0.name: '{place}'") for problem in refused.value.problems] == [True]


@pytest.mark.parametrize("position", [None, "at the disc"])
def test_the_supports_of_a_single_disc_are_candidates_and_the_disc_is_not_named(position):
    """A seal that the file states at the only disc is still at one place."""
    machine = load_machine("plain_rotor")
    places = {"", *(f" of {name}" for name in machine.bearings_in_words)}
    if position is not None:
        (disc,) = machine.discs
        machine = machine.replace("effects.labyrinth_seal", {"damping": "10 N*s/m", "position": f"{disc.position} m"})
    assert keys(machine, "labyrinth_seal") == {
        f"labyrinth_seal.{p}{place}" for p in ("damping", "cross_stiffness") for place in places
    }


def test_a_rotor_without_a_disc_has_the_candidates_that_need_none():
    machine = load_machine("rigid_rotor_self_acting")
    assert not machine.discs and not keys(machine, "crack") and keys(machine, "labyrinth_seal") == set()
    assert keys(machine, "runout")


@pytest.mark.slow
def test_a_force_of_the_twin_acts_at_its_place(two_discs):
    """A twin whose seal is moved to the second disc answers as the machine that has it there from the start."""
    twin = Twin(two_discs, GRID, 2e-4, only=("labyrinth_seal",))
    table = twin.slots["labyrinth_seal"]
    rows = np.zeros((500, 6))
    rows[:, 0], rows[:20, 4] = 2 * np.pi * 30, 50.0
    stem = f"labyrinth_seal.{table}"
    values = {f"{stem}.damping": 300.0, f"{stem}.swirl": 0.5}
    moved = twin.run({**values, f"{stem}.position": 0.45}, rows, 0.0)[:, :2]
    there = two_discs.replace("effects.labyrinth_seal", {"position": "450 mm"})
    own = Twin(there, GRID, 2e-4, only=())
    others = own.run({"labyrinth_seal.0.damping": 300.0}, rows, 0.0)[:, :2]
    np.testing.assert_allclose(moved, others, atol=1e-6 * np.abs(others).max())
    first = twin.run({**values, f"{stem}.position": 0.2}, rows, 0.0)[:, :2]
    assert np.abs(first - moved).max() > 1e-2 * np.abs(moved).max()


def test_the_place_is_written_into_the_machine_file(two_discs):
    twin = Twin(two_discs, GRID, 2e-4, only=("labyrinth_seal",))
    form = next(f for f in candidates(twin) if f.key == "labyrinth_seal.cross_stiffness of disc 1")
    point = ParameterPoint({form.parameters[0]: 5e4}, form.fixed)
    found = found_of(
        twin, form, ParameterFit(form.parameters, point, np.zeros(1), np.zeros((1, 1)), 0.0), np.eye(1), ()
    )
    assert isinstance(found, IdentifiedEffect) and found.parameters["position"] == pytest.approx(0.45)
