"""Records as pandas tables and in the layout of a MATLAB timetable."""

import numpy as np
import pytest
from scipy.io import loadmat

import rotorsim as rs
from rotorsim.base.errors import SchemaError


@pytest.fixture(scope="module")
def record():
    return rs.experiments.steady("plain_rotor", speed=100.0, duration=0.02)


def test_a_table_has_the_records_values_units_and_time(record):
    table = rs.identification.to_pandas(record)
    np.testing.assert_array_equal(table.index, record["time"])
    np.testing.assert_array_equal(table["disc_y"], record["disc"].sel(axis="y"))
    assert table.index.name == "time" and table.attrs["units"]["speed"] == "rad/s"


def test_a_timetable_has_names_units_rate_and_the_line_that_makes_it(record, tmp_path):
    path = rs.identification.save_timetable(record, tmp_path / "mine.mat")
    raw = loadmat(path)
    names = [str(one[0]) for one in raw["VariableNames"][0]]
    np.testing.assert_array_equal(raw["Data"][:, names.index("disc_x")], record["disc"].sel(axis="x"))
    np.testing.assert_array_equal(raw["Time"][:, 0], record["time"])
    assert raw["SampleRate"].item() == pytest.approx(5000) and len(raw["VariableUnits"][0]) == len(names)
    assert "load('mine.mat')" in raw["HowTo"][0] and "array2timetable" in raw["HowTo"][0]


@pytest.mark.parametrize(
    "call", [rs.identification.to_pandas, lambda record: rs.identification.save_timetable(record, "x.mat")]
)
def test_what_is_no_record_is_refused(record, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SchemaError):
        call(record.drop_vars("time"))
    assert not list(tmp_path.iterdir())
