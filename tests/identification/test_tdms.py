"""TDMS files of LabVIEW: channels, clocks, refusals (needs the extra nptdms)."""

import sys

import numpy as np
import pytest

import identification as idn

N = 100
WAVE = {"wf_increment": 2e-4, "wf_start_offset": 0.0}


def write(path, *channels):
    """Write channels (group, name, values, properties)."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
    return path


def good(path):
    unit = {**WAVE, "unit_string": "um"}
    return write(path, *(("rig", f"disc_measured_{axis}", np.arange(N) * 1.0, unit) for axis in "xy"))


def test_channels_units_and_the_clock_are_read(tmp_path):
    record = idn.read(good(tmp_path / "a.tdms"))
    assert record["time"].values == pytest.approx(np.arange(N) * 2e-4)
    assert record["disc_measured"].sel(axis="y").values == pytest.approx(np.arange(N) * 1e-6)


def test_channels_of_one_name_in_two_groups_go_by_their_group(tmp_path):
    path = write(tmp_path / "a.tdms", ("a", "P", np.ones(N), WAVE), ("b", "P", np.zeros(N), WAVE))
    record = idn.read(path, {"channels": {"angle": {"column": "b/P", "unit": "rad"}}})
    assert not record["angle"].values.any()
    with pytest.raises(idn.ReadError, match=r"'P' .* 2 "):
        idn.read(path, {"channels": {"angle": {"column": "P", "unit": "rad"}}})


def test_time_stamps_become_seconds(tmp_path):
    stamps = np.datetime64("2024-01-01T00:00:00", "us") + np.arange(N) * np.timedelta64(200, "us")
    record = idn.read(write(tmp_path / "a.tdms", ("a", "time", stamps), ("a", "angle", np.arange(N) * 1.0)))
    assert record["time"].values == pytest.approx(np.arange(N) * 2e-4, abs=2e-6)  # nptdms cuts to us


@pytest.mark.parametrize("cut", [30, 0.2, 0.5, 0.9])
def test_a_file_that_was_cut_off_is_refused(tmp_path, cut):
    path = good(tmp_path / "a.tdms")
    content = path.read_bytes()
    path.write_bytes(content[: cut if cut > 1 else int(len(content) * cut)])
    with pytest.raises(idn.ReadError, match=r"\.tdms"):
        idn.read(path)


def test_channels_on_two_clocks_and_texts_are_refused(tmp_path):
    path = write(
        tmp_path / "a.tdms", ("a", "angle", np.ones(N), WAVE), ("a", "speed", np.ones(N), {"wf_increment": 1.0})
    )
    with pytest.raises(idn.ReadError, match="is sampled every"):
        idn.read(path)
    with pytest.raises(idn.ReadError, match="channel"):
        idn.read(write(tmp_path / "b.tdms", ("a", "angle", ["a", "b"])))


def test_without_nptdms_one_sentence_names_how_to_get_it(written, monkeypatch):
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(idn.ReadError, match="nptdms"):
        idn.read(written("a.tdms", b"TDSm" + b"\0" * 100))


def test_noise_after_the_right_beginning_is_refused(written):
    pytest.importorskip("nptdms")
    for seed in range(20):
        with pytest.raises(idn.ReadError):
            idn.read(written("a.tdms", b"TDSm" + np.random.default_rng(seed).bytes(500)))
