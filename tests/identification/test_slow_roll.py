"""Slow roll subtracted once, and hints at conjugated phasors and mirrored axes."""

import numpy as np
import pytest

import identification as idn
from refusals import refused
from rotorsim.base.errors import ReadError, SchemaError

RPM = np.pi / 30
SPEED = np.linspace(300, 4000, 60) * RPM
SLOW = {"x": 8e-6 * np.exp(-1j * 0.5), "y": 5e-6 * np.exp(1j * 1.1)}


def response(conjugated=False, mirrored=False, slow=False):
    """Run-up vectors of a rotor with a resonance at 1800 rpm: Jeffcott, forward."""
    r = SPEED / (1800 * RPM)
    x = 20e-6 * r**2 / (1 - r**2 + 0.1j * r)
    columns = [x, -1j * x]
    if mirrored:
        columns[1] = -columns[1]
    if slow:
        columns = [column + SLOW[axis] for axis, column in zip("xy", columns, strict=True)]
    found = np.stack([np.conj(c) if conjugated else c for c in columns], axis=1)[:, None]
    return idn.make_vectors(SPEED, np.abs(found), -np.angle(found))


def complex_of(vectors):
    return (vectors["amplitude"] * np.exp(-1j * vectors["phase"])).values


@pytest.fixture
def table(tmp_path):
    idn.save(response(slow=True), tmp_path / "runup.csv")
    return tmp_path / "runup.csv"


def rolled(**how):
    return {"slow_roll": how}


VECTORS = {
    "1X": {
        "x": {"amplitude": "16 um pp", "phase": "0.5 rad"},
        "y": {"amplitude": "5 um", "phase": f"{-np.rad2deg(1.1)} deg"},
    }
}


def test_vectors_of_the_mapping_are_subtracted_and_said(table):
    found = idn.read(table, rolled(**VECTORS))
    np.testing.assert_allclose(complex_of(found), complex_of(response()), atol=1e-9)
    assert found.attrs["slow_roll"] == "subtracted: vectors of the mapping"
    assert idn.notes_of(found) == ["slow roll subtracted: vectors of the mapping"]


def test_rows_below_a_speed_or_a_file_of_them_are_a_slow_roll(table, tmp_path):
    found = idn.read(table, rolled(below="400 rpm"))
    small = 20e-6 * (350 / 1800) ** 2
    assert np.abs(complex_of(found) - complex_of(response())).max() < 1.5 * small
    assert found.attrs["slow_roll"] == "subtracted: mean of 2 rows up to 362.7 rpm"
    idn.save(idn.read(table).isel(speed=slice(0, 2)), tmp_path / "slow.csv")
    again = idn.read(table, rolled(file=str(tmp_path / "slow.csv")))
    np.testing.assert_allclose(complex_of(again), complex_of(found), atol=1e-12)


def test_it_is_never_subtracted_twice(table, tmp_path):
    idn.save(idn.read(table, rolled(below="400 rpm")), tmp_path / "less.nc")
    with refused(SchemaError, "slow_roll", "subtracted: mean of 2 rows up to 362.7 rpm"):
        idn.read(tmp_path / "less.nc", rolled(below="400 rpm"))
    flagged = idn.read(table, rolled(subtracted=True))
    np.testing.assert_allclose(complex_of(flagged), complex_of(idn.read(table)), atol=1e-15)
    idn.save(flagged, tmp_path / "flagged.nc")
    with refused(SchemaError, "slow_roll", lambda done: "subtracted" in done):
        idn.read(tmp_path / "flagged.nc", rolled(**VECTORS))
    with pytest.raises(SchemaError, match="slow roll"):
        idn.read(table, rolled(file=str(tmp_path / "flagged.nc")))


@pytest.mark.parametrize(
    ("how", "shown"),
    [
        ({}, "slow_roll: "),
        ({"subtracted": True, "below": "400 rpm"}, "slow_roll: "),
        ({"subtracted": False}, "slow_roll.subtracted: false"),
        ({"file": 3}, "slow_roll.file: 3"),
        ({"below": 400}, "slow_roll.below: 400"),
        ({"below": "200 rpm"}, "slow roll: .*200 rpm"),
        ({"below": "3000 rpm"}, "rpm .*4000 rpm.*2000 rpm"),
        ({"1X": {"x": {"amplitude": 3, "phase": "1 deg"}}}, "slow_roll.1X.x.amplitude: 3"),
        ({"1X": {"x": {"amplitude": "3 um"}}}, "slow_roll.1X.x: "),
        ({"1X": {}}, "slow_roll.1X: "),
        ({"first": {}}, "first"),
        ({"file": "not_there.csv"}, r"not_there\.csv"),
    ],
)
def test_a_wrong_slow_roll_ends_in_a_sentence(table, how, shown):
    with pytest.raises((ReadError, SchemaError), match=shown):
        idn.read(table, rolled(**how))


def series(speed, slow_alone=False):
    t = np.arange(20000) / 5000
    angle = speed * t + 0.7
    runout = np.column_stack([(SLOW[axis] * np.exp(1j * angle)).real for axis in "xy"])
    runout[:, 0] += 2e-6 * np.cos(3 * angle)
    motion = np.column_stack([20e-6 * np.cos(angle - 1), 20e-6 * np.sin(angle - 1)])
    values = {"disc_measured": runout + (0 if slow_alone else 1) * motion, "angle": angle}
    return idn.make_record(t, values), motion


def test_a_slow_roll_over_time_is_subtracted_at_its_angle(tmp_path):
    fast, motion = series(2 * np.pi * 50)
    slow, _ = series(2 * np.pi * 5.3, slow_alone=True)
    idn.save(fast, tmp_path / "fast.nc")
    idn.save(slow, tmp_path / "slow.nc")
    (tmp_path / "map.toml").write_text("[slow_roll]\nfile = 'slow.nc'\n")
    found = idn.read(tmp_path / "fast.nc", tmp_path / "map.toml")
    np.testing.assert_allclose(found["disc_measured"].values, motion, atol=1e-9)
    assert found.attrs["slow_roll"] == "subtracted: record at 318 rpm"
    with pytest.raises(SchemaError, match=r"3000 rpm .* 318 rpm"):
        idn.read(tmp_path / "slow.nc", rolled(file=str(tmp_path / "fast.nc")))


def test_right_vectors_give_no_hint():
    assert idn.examine(response()).warnings == () and idn.examine(response(slow=True)).warnings == ()


def test_leads_taken_for_lags_are_hinted_at_and_left_alone():
    (hint,) = idn.examine(response(conjugated=True)).warnings
    assert "the lag falls by" in hint and "through the peak at 18" in hint and "and 1X whirls backward" in hint
    assert "are these leads (conjugated phasors)? write sign = -1 in every phase; nothing was changed" in hint


def test_mirrored_axes_are_hinted_at():
    (hint,) = idn.examine(response(mirrored=True)).warnings
    assert "1X whirls backward (999 times as much as forward): check the angles, signs and order of the probes" in hint
    (both,) = idn.examine(response(conjugated=True, mirrored=True)).warnings
    assert "are these leads" in both and "but 1X whirls forward" in both


def test_a_series_that_whirls_backward_is_hinted_at():
    record, motion = series(2 * np.pi * 50)
    assert idn.examine(record).warnings == ()
    turned = record.assign(disc_measured=(("time", "axis"), motion[:, ::-1], {"units": "m"}))
    (hint,) = idn.examine(turned).warnings
    assert hint.startswith("disc_measured: 1X whirls backward")
    backward = turned.assign(angle=-record["angle"].assign_attrs(units="rad"))
    backward["angle"].attrs["units"] = "rad"
    assert idn.examine(backward).warnings == ()
