"""The identified model of the shipped rig (nine records of pseudo-random excitation, Model 3) that the tests share."""

from pathlib import Path

import pytest

import identification as idn


@pytest.fixture(scope="session")
def model():
    """LPV model over 0 to 6 krpm, 0.3 to 0.7 MPa."""
    return idn.load_model(Path(__file__).parent / "rig_model.json")
