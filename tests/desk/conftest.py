"""Fixtures of the desk's tests: a design of a shipped machine in a folder of its own."""

import pytest

from rotorsim.desk import Design
from rotorsim.machine import machine_text


@pytest.fixture
def design(tmp_path):
    """The plain rotor as a file that is saved."""
    path = tmp_path / "rotor.toml"
    path.write_bytes(machine_text("plain_rotor").encode())
    return Design(path.read_bytes().decode(), path, path.read_bytes().decode())
