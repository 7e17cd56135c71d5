"""WAV files with their full scale, and HDF5 files of other programs."""

import numpy as np
import pytest
from scipy.io import wavfile

import identification as idn
from rotorsim.base.errors import ReadError

N = 1000
WAVE = np.column_stack([np.sin(0.05 * np.arange(N)), np.cos(0.05 * np.arange(N))])
CODES = {
    "i2": np.round(WAVE * 32767).astype("i2"),
    "i4": np.round(WAVE * (2**31 - 1)).astype("i4"),
    "u1": np.round(128 + WAVE * 127).astype("u1"),
    "f4": WAVE.astype("f4"),
}


def probe(column, angle, **more):
    return {"column": column, "full_scale": "10 V", "sensitivity": "8 V/mm", "angle": f"{angle} deg"} | more


MAPPING = {"probes": {"A": probe("channel 1", 0), "B": probe("channel 2", 90)}}


@pytest.mark.parametrize(("kind", "error"), [("i2", 1e-4), ("i4", 1e-6), ("u1", 1.5 / 128), ("f4", 1e-6)])
def test_a_wav_file_is_read_by_its_full_scale(tmp_path, kind, error):
    wavfile.write(tmp_path / "a.wav", 51200, CODES[kind])
    record = idn.read(tmp_path / "a.wav", MAPPING)
    assert idn.sampling_time(record) == pytest.approx(1 / 51200) and record.attrs["source_format"] == "WAV"
    np.testing.assert_allclose(record["disc_measured"].values, WAVE * 10 / 8e3, atol=error * 1.25e-3)


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        ({"full_scale": None}, "full_scale = '10 V'"),
        ({"full_scale": None, "unit": "V"}, "probes.A: .*full_scale"),
        ({"full_scale": "10"}, "'10'"),
        ({"full_scale": 10}, "full_scale: 10"),
        ({"unit": "V"}, "probes.A: full_scale"),
        ({"gap": "1 mil"}, "unit 'mil'"),
    ],
)
def test_wrong_full_scales_end_in_a_sentence(tmp_path, change, shown):
    wavfile.write(tmp_path / "a.wav", 5000, CODES["i2"])
    table = {k: v for k, v in (MAPPING["probes"]["A"] | change).items() if v is not None}
    with pytest.raises(ReadError, match=shown):
        idn.read(tmp_path / "a.wav", {"probes": {"A": table, "B": MAPPING["probes"]["B"]}})


@pytest.mark.parametrize("cut", [12, 30, 44, 500, -100])
def test_damaged_wav_files_are_refused(tmp_path, cut):
    wavfile.write(tmp_path / "a.wav", 5000, CODES["i2"])
    (tmp_path / "a.wav").write_bytes((tmp_path / "a.wav").read_bytes()[:cut])
    with pytest.raises(ReadError, match=r"a.wav: "):
        idn.read(tmp_path / "a.wav", MAPPING)
    (tmp_path / "b.wav").write_bytes(b"RIFX nothing of the kind")
    with pytest.raises(ReadError, match=r"\.wav"):
        idn.read(tmp_path / "b.wav", MAPPING)


def test_a_hdf5_file_of_another_program_is_read(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"] = np.arange(N) / 5000
        file["rig/probes"] = WAVE.T  # as MATLAB writes it
        file["rig/probes"].attrs["units"] = "mil"
        file["note"] = "text"
    probes = {n: {"column": f"rig/probes_{i}", "angle": f"{a} deg"} for n, i, a in (("A", 1, 0), ("B", 2, 90))}
    record = idn.read(tmp_path / "a.h5", {"time": {"column": "t", "unit": "s"}, "probes": probes})
    np.testing.assert_allclose(record["disc_measured"].values, WAVE * 25.4e-6, atol=1e-12)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["note"] = "text"
    with pytest.raises(ReadError, match="no vector"):
        idn.read(tmp_path / "b.h5", {"time": {"column": "t", "unit": "s"}, "probes": probes})
