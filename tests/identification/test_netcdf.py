"""netCDF records, and refused foreign or damaged HDF5 files."""

import h5py
import numpy as np
import pytest
import xarray as xr

import identification as idn


def test_a_netcdf_of_another_program_is_refused_with_what_it_holds(tmp_path):
    path = tmp_path / "a.nc"
    xr.Dataset({"temperature": ("lat", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(idn.ReadError, match="'lat', 'temperature'"):
        idn.read(path)


def test_an_hdf5_file_without_a_whole_record_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["time"], file["angle"] = np.arange(3.0), np.zeros((3, 4))
    with pytest.raises((idn.ReadError, idn.SchemaError)):
        idn.read(path)
    with h5py.File(path, "w"):
        pass
    with pytest.raises(idn.ReadError, match="no vector"):
        idn.read(path)


def test_a_record_leads_nowhere_outside_itself(record, tmp_path):
    path = idn.save(record, tmp_path / "a.nc")
    with h5py.File(path, "r+") as file:
        file["speed_measured"] = h5py.ExternalLink(str(tmp_path / "other"), "/speed")
    with pytest.raises(idn.ReadError, match="'speed_measured' is a link"):
        idn.read(path)


@pytest.mark.parametrize("suffix", [".nc", ".csv", ".mat"])
def test_axes_that_a_file_keeps_as_bytes_are_text_again(record, tmp_path, suffix):
    kept = record.assign_coords(axis=np.array([b"x", b"y"]))
    assert idn.validate(kept) is kept
    assert idn.examine(kept).channels[0].name == idn.examine(record).channels[0].name
    kept.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    assert idn.read(tmp_path / "a.nc").equals(record)
    assert idn.read(idn.save(kept, tmp_path / f"b{suffix}")).equals(record)


def test_a_record_with_faults_is_named(record, tmp_path):
    path = tmp_path / "a.nc"
    record.isel(time=[0, 1, 2, 9, 10]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(idn.SchemaError, match=r"a.nc: record.time: 1 gaps"):
        idn.read(path)


def test_a_mapping_for_a_record_is_refused(record, tmp_path):
    path = idn.save(record, tmp_path / "a.nc")
    with pytest.raises(idn.ReadError, match="mapping"):
        idn.read(path, {"channels": {"angle": {"column": 1, "unit": "rad"}}})
    with pytest.raises(idn.ReadError, match="mapping"):
        idn.columns(path)


@pytest.mark.parametrize("cut", [20, 600, 0.5, 0.95])
def test_a_record_that_was_cut_off_is_refused(record, tmp_path, cut):
    path = idn.save(record, tmp_path / "a.nc")
    content = path.read_bytes()
    path.write_bytes(content[: cut if cut > 1 else int(len(content) * cut)])
    with pytest.raises(idn.ReadError, match=r"\.nc"):
        idn.read(path)
