"""Axis labels as text in every record: `record.disc.sel(axis="x")` in memory and from files."""

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import identification as idn
import rotorsim as rs
from rotorsim.campaign import collect
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.records import write_record
from rotorsim.campaign.simulate_case import solve
from rotorsim.campaign.store import make_store, record_path
from rotorsim.experiments import Steady, record, run
from rotorsim.signals.record_blocks import open_record

ENGINES = ["h5netcdf", *(["netcdf4"] if find_spec("netCDF4") else [])]
STEADY = Steady(30.0, 0.3e6, 0.1)


@pytest.fixture(scope="module")
def plant() -> rs.Plant:
    return rs.Plant("plain_rotor")


def streamed(plant: rs.Plant, folder: Path) -> Path:
    record(plant, STEADY, folder / "run.nc")
    return folder / "run.nc"


def saved(plant: rs.Plant, folder: Path) -> Path:
    return idn.save(run(plant, STEADY), folder / "saved.nc")


def written_by_a_campaign(plant: rs.Plant, folder: Path) -> Path:
    write_record(folder / "case.nc", run(plant, STEADY), {}, None)
    return folder / "case.nc"


def converted_from_csv(plant: rs.Plant, folder: Path) -> Path:
    idn.save(run(plant, STEADY), folder / "a.csv")
    return idn.save(idn.read(folder / "a.csv"), folder / "converted.nc")


def recorded_live(plant: rs.Plant, folder: Path) -> Path:
    from rotorsim.live.records import Recorder
    from rotorsim.live.rig import Rig

    rig = Rig(plant.machine, {})
    recorder = Recorder(rig, folder / "live.nc")
    recorder.write(rig.advance(50))
    recorder.close()
    return folder / "live.nc"


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "write",
    [streamed, saved, written_by_a_campaign, converted_from_csv, pytest.param(recorded_live, marks=pytest.mark.slow)],
)
def test_plain_xarray_finds_the_axes_of_a_file_by_their_names(
    plant: rs.Plant, tmp_path: Path, write: Callable[[rs.Plant, Path], Path], engine: str
) -> None:
    with xr.open_dataset(write(plant, tmp_path), engine=engine) as data:
        name = "disc" if "disc" in data else "disc_measured"
        assert data[name].sel(axis="y").values.tolist() == data[name].values[:, 1].tolist()
        assert data["axis"].values.tolist() == ["x", "y"]


def test_records_in_memory_have_named_axes(plant: rs.Plant) -> None:
    for data in (run(plant, STEADY), idn.from_arrays(np.arange(9.0), None, np.ones((9, 2)))):
        assert data["axis"].values.tolist() == ["x", "y"]
        assert data["axis"].dtype.kind == "U"


def test_the_records_of_a_campaign_and_their_collection_have_named_axes(tmp_path: Path) -> None:
    plan = make_plan("machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\nduration = '0.1 s'\n")
    store = make_store(plan, tmp_path / "store")
    case = plan.case(0).case
    solve(store.folder, case, next(iter(plan.machines.values())), plan.summary)
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as data:
        assert data["disc"].sel(axis="x").shape == (500,)
    index = store.index(writable=True)
    index.note(0, {"status": "done", "bytes": record_path(store.folder, case.key).stat().st_size})
    index.commit()
    index.close()
    assert collect(store.folder)["disc"].sel(axis="x").shape == (1, 500)


def test_axes_that_an_older_file_names_in_bytes_are_read_as_text(plant: rs.Plant, tmp_path: Path) -> None:
    old = run(plant, STEADY).assign_coords(axis=np.array([b"x", b"y"], "S1"))
    old.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    with open_record(tmp_path / "old.nc") as data:
        assert data["axis"].values.tolist() == ["x", "y"]
    assert idn.read(tmp_path / "old.nc")["disc"].sel(axis="x").shape == (500,)
