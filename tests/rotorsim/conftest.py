"""Machines and inputs that the tests of the plant share."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from rotorsim.machine import load_machine
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

SILENT = {"effects.unbalance.me": "0 g*mm", "effects.coupling.second": "0 N", "effects.coupling.third": "0 N"}


def change(machine: Machine, values: Mapping[str, Any]) -> Machine:
    """The machine with other values."""
    for path, value in values.items():
        machine = machine.replace(path, value)
    return machine


def build_rig(values: Mapping[str, Any] | None = None, n_z: int = 8, dt: float = 2e-4, n_theta: int = 32) -> Plant:
    """The shipped rig without unbalance and coupling forces, then with `values`; one time step a sample."""
    machine = change(load_machine("dtu_gas_bearing"), SILENT | dict(values or {}))
    return Plant(machine, n_theta=n_theta, n_z=n_z, dt=dt)


def held_inputs(samples: int, speed: float, pressure: float) -> np.ndarray:
    """Input rows (samples, 6) of constant speed [rad/s] and gauge pressure [Pa], no reference, no disc force."""
    rows = np.zeros((samples, 6))
    rows[:, 0], rows[:, 1] = speed, pressure
    return rows


@pytest.fixture(scope="session")
def changed() -> Callable[..., Machine]:
    """Return what changes values of a machine."""
    return change


@pytest.fixture(scope="session")
def rig() -> Callable[..., Plant]:
    """Return the builder of the rig."""
    return build_rig


@pytest.fixture(scope="session")
def held() -> Callable[..., np.ndarray]:
    """Return the builder of constant inputs."""
    return held_inputs
