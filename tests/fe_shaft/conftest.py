"""Rotors shared by the shaft tests: the rig with a gas bearing, and a small rotor with every kind of part."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import pytest

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement, steel


@dataclass(frozen=True)
class RigRotor:
    """The rig's rotor, and the nodes of the gas bearing and of the disc."""

    rotor: Rotor
    gas: int
    disc: int


def build_rig(disc_at: float = 0.3787, gas_stiffness: float | None = None, element: float = 0.0125) -> RigRotor:
    """Shaft 23.6 x 500 mm with a 40 x 50 mm journal at .625 of the way from ball bearing to disc."""
    material = Material("rig steel", rho=7850.0, E=210e9, Poisson=0.3)
    journal = 0.625 * disc_at
    stub = 0.5 - disc_at
    pieces = [
        (stub, 0.0236),
        (journal - 0.025, 0.0236),
        (0.025, 0.040),
        (0.025, 0.040),
        (disc_at - journal - 0.025, 0.0236),
    ]
    shaft, ends = [], []
    for length, diameter in pieces:
        parts = ceil(length / element - 1e-9)
        shaft += [ShaftElement(length / parts, 0.0, diameter, material=material) for _ in range(parts)]
        ends.append(len(shaft))
    ball, gas, disc = ends[0], ends[2], ends[4]
    bearings = [BearingElement(ball, 5e7, 0.0)]
    if gas_stiffness is not None:
        bearings.append(BearingElement(gas, gas_stiffness, 0.0))
    return RigRotor(Rotor(shaft, [DiskElement(disc, 1.5, 0.001858625, 0.003675)], bearings), gas, disc)


@pytest.fixture
def rig() -> Callable[..., RigRotor]:
    """Return the builder of the rig."""
    return build_rig


@pytest.fixture
def full_rotor() -> Rotor:
    """Hollow and solid pieces, two discs, damping and unequal bearings with cross coupling."""
    shaft = [ShaftElement(0.1 + 0.02 * i, 0.005 * (i % 2), 0.03 + 0.004 * i) for i in range(6)]
    discs = [DiskElement(2, 3.0, 0.01, 0.018), DiskElement.from_geometry(6, steel, 0.02, 0.03, 0.2)]
    bearings = [
        BearingElement(1, 2e6, 300.0),
        BearingElement(5, 3e6, 100.0, kyy=2e6, kxy=4e5, kyx=-3e5, cyy=150.0, cxy=20.0, cyx=-10.0),
    ]
    return Rotor(shaft, discs, bearings)
