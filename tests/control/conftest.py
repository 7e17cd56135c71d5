"""Identified LPV model of the shipped rig (nine PRBS records, Model 3) shared by the control tests."""

from pathlib import Path

import pytest

import identification as idn
from identification.lpv_model import LpvModel


@pytest.fixture(scope="session")
def model():
    """LPV model over 0 to 6 krpm, 0.3 to 0.7 MPa."""
    return idn.load_model(Path(__file__).parent / "rig_model.json")


@pytest.fixture(scope="session")
def small(model):
    """Model 1 whose parameters move a share as much as the rig's about the middle of the range."""

    def made(share=0.3):
        coefficients = model.coefficients[:12].copy()
        coefficients[:, 1:] *= share
        return LpvModel("1", model.parameters[:12], coefficients, model.basis, model.order, model.points,
                        model.rms_identification[:12], model.rms_hold_out[:12])  # fmt: skip

    return made
