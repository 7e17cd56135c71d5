"""`rotorsim.fmu`: what a unit can be made of, and what is refused."""

from pathlib import Path

import pytest

import rotorsim as rs
from fmu.linear_units import LawUnit, LinearUnit
from fmu.model import PlantUnit
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.fmu import unit_of

RIG = Path(__file__).parents[1] / "control" / "rig_model.json"
LAW = Path(rs.__file__).parent / "live" / "shipped" / "hinf.json"


@pytest.mark.parametrize(
    ("subject", "kind"),
    [
        ("dtu_gas_bearing", PlantUnit),
        (rs.load_machine("dtu_gas_bearing"), PlantUnit),
        (rs.Plant("dtu_gas_bearing"), PlantUnit),
        (RIG, LinearUnit),
        (rs.load_model(RIG), LinearUnit),
        (rs.load_law(LAW), LawUnit),
    ],
)
def test_a_unit_is_made_of_a_machine_a_model_or_a_law(subject, kind):
    assert isinstance(unit_of(subject, None, None), kind)


def test_a_start_is_taken_over():
    unit = unit_of("dtu_gas_bearing", 100.0, 0.4e6)
    assert (unit.speed, unit.pressure) == (100.0, 0.4e6)


@pytest.mark.parametrize(
    ("subject", "error", "sentence"),
    [
        (3, DataError, "int is not a Plant, a machine, an LpvModel or a Law"),
        ("nope.toml", MachineFileError, "'nope.toml' is neither a shipped machine"),
        ("nope.json", DataError, r"nope\.json: is not there"),
    ],
)
def test_anything_else_is_refused_in_one_sentence(subject, error, sentence):
    with pytest.raises(error, match=sentence):
        unit_of(subject, None, None)


def test_other_versions_and_files_are_refused(tmp_path):
    with pytest.raises(DataError, match="is not known; choose 2, 3 or 2,3"):
        rs.fmu.export("dtu_gas_bearing", tmp_path / "x.fmu", fmi=(4,))
    with pytest.raises(DataError, match="is not there"):
        rs.fmu.info(tmp_path / "none.fmu")
