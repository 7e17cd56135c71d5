"""Readings of probes in records: files, x and y of a plane from its probes, identification on them."""

import numpy as np
import pytest

import identification as idn
from identification.records.sensors import probe_outputs
from model3 import record as model3_record

PROBES = {
    "probe": ["DE_x", "DE_y", "NDE", "A"],
    "probe_quantity": [*["relative_displacement"] * 3, "housing_acceleration"],
    "probe_position": [0.15, 0.15, 0.4, 0.15],
    "probe_angle": [np.pi / 4, 3 * np.pi / 4, 0.0, 0.0],
    "probe_gain": [7870.0, -1.0, 1.0, 1.0],
    "probe_unit": ["V", "m", "m", "m/s^2"],
}


def seen_by(motion):
    """Readings (n, 4) of PROBES for a motion (n, 2) [m] at both planes."""
    angle, gain = np.array(PROBES["probe_angle"]), np.array(PROBES["probe_gain"])
    return (motion @ np.stack([np.cos(angle), np.sin(angle)])) * gain


@pytest.fixture
def motion():
    return np.random.default_rng(3).normal(size=(200, 2)) * 1e-5


@pytest.fixture
def probed(motion):
    return idn.from_arrays(
        np.arange(200) / 5000, np.zeros((200, 2)), motion, probes=PROBES, probe_measured=seen_by(motion)
    )


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".nc"])
def test_a_record_with_probes_comes_back_identical(probed, tmp_path, suffix):
    back = idn.read(idn.save(probed, tmp_path / f"probed{suffix}"))
    assert back.identical(probed)
    assert back["probe_unit"].values.tolist() == PROBES["probe_unit"]


def test_probes_are_chosen_by_name(probed):
    assert probed["probe_measured"].dims == ("time", "probe")
    assert (
        probed["probe_measured"].sel(probe="NDE").values.tobytes()
        == seen_by(probed["disc_measured"].values)[:, 2].tobytes()
    )


def test_columns_named_like_probes_are_read_in_si(written):
    heads = "time [s],probe_measured_A [um],probe_measured_NDE_2 [mm/s],disc_measured_x [um],disc_measured_y [um]"
    path = written("rig.csv", f"{heads}\n0,1,2,0,0\n0.001,3,4,0,0\n0.002,3,4,0,0\n")
    record = idn.read(path)
    assert record["probe"].values.tolist() == ["A", "NDE_2"]
    assert record["probe_unit"].values.tolist() == ["m", "m/s"]
    assert record["probe_measured"].values[:2].ravel() == pytest.approx([1e-6, 2e-3, 3e-6, 4e-3])


def test_two_probes_at_45_degrees_give_x_and_y_of_their_plane(probed, motion):
    """Volts of one, a reversed sense of the other."""
    found = probe_outputs(probed, ("DE_x", "DE_y"))
    assert found["disc_measured"].values == pytest.approx(motion, rel=1e-12, abs=1e-18)
    assert "disc" not in found and "DE_x, DE_y" in found["disc_measured"].attrs["long_name"]


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (("DE_x", "DE_Y"), "probes: no 'DE_Y' in the record; did you mean 'DE_y'?"),
        (("DE_x", "A"), "probe A: measures housing_acceleration; choose displacement probes"),
        (("DE_x", "NDE"), "probes DE_x, NDE: stand at 150, 400 mm; choose probes of one plane"),
        (("DE_x",), "probes DE_x: do not see both x and y; choose two at different angles"),
        (("DE_x", "DE_x"), "probes DE_x, DE_x: do not see both x and y; choose two at different angles"),
    ],
)
def test_probes_that_make_no_plane_are_refused(probed, names, sentence):
    with pytest.raises(idn.SchemaError) as caught:
        probe_outputs(probed, names)
    assert str(caught.value) == sentence


def test_a_record_without_probes_or_with_two_of_one_name_is_refused(probed, record):
    with pytest.raises(idn.SchemaError, match="no probe_measured"):
        probe_outputs(record, ("A", "B"))
    with pytest.raises(idn.SchemaError, match=r"record\.probe: "):
        idn.validate(probed.assign_coords(probe=["A", "A", "B", "C"]))
    with pytest.raises(idn.SchemaError, match="4 probes, but 0 of 'probe'"):
        idn.from_arrays(np.arange(200) / 5000, None, None, probe_measured=np.zeros((200, 4)))


def test_identification_on_a_pair_of_probes_is_that_on_the_motion_they_see():
    """The same numbers to what rounding of the rotated readings moves a fit."""
    whole = model3_record(seconds=4.0)
    at, u, motion = (whole[name].values for name in ("time", "reference", "disc_measured"))
    pair = {name: values[:2] for name, values in PROBES.items()}
    at_rest = np.zeros_like(motion)
    probed = idn.from_arrays(at, u, at_rest, probes=pair, probe_measured=seen_by(motion)[:, :2], pressure=3e5)
    expected = idn.identify(whole, model=1)
    found = idn.identify(probed, model=1, settings=idn.Prefilter(probes=("DE_x", "DE_y")))
    assert found.wn == pytest.approx(expected.wn, rel=1e-6)
    assert found.fit == pytest.approx(expected.fit, abs=1e-6)
