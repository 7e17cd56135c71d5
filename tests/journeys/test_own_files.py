"""Readers given the wrong kind of rotorsim file: kind recognised and named, exit code 2."""

import json

import pytest
import xarray as xr

from rotorsim.base.input_files import READ_BY
from rotorsim.machine import machine_text
from rotorsim.plant import Plant

PLAN = 'name = "p"\nmachine = "plain_rotor"\n[experiments.steady]\nkind = "steady"\nduration = "1 s"\n'
TARGETS = '[operating_points]\nspeeds = ["0 rpm"]\npressures = ["0.5 MPa"]\n[parameters]\n[[targets]]\nname = "f"\n'
MAPPING = '[time]\ncolumn = "t"\nunit = "s"\n[channels.disc]\nx = "a"\n'
LAW, MODEL = {"kind": "law", "name": "p"}, {"kind": "lpv", "structure": "3"}
SCENE = {"kind": "rotorsim scene", "version": 1, "machine": "", "values": {}}
TEXTS = {
    "machine.toml": (machine_text("plain_rotor"), "a machine file"),
    "plan.toml": (PLAN, "a plan of a campaign"),
    "targets.toml": (TARGETS, "a file of targets"),
    "mapping.toml": (MAPPING, "a mapping of measured data"),
    "law.json": (json.dumps(LAW), "a control law of 'rotorsim design'"),
    "model.json": (json.dumps(MODEL), "a model of 'rotorsim identify'"),
    "scene.json": (json.dumps(SCENE), "a scene of 'rotorsim live'"),
    "diagnosis.json": (json.dumps({"status": "named", "verdict": "x"}), "the verdict of 'rotorsim diagnose'"),
    "report.html": ("<!doctype html><html></html>", "a report"),
}
NETCDF = {"map.nc": "an operating map of 'rotorsim map'", "modes.nc": "a file of mode shapes of 'rotorsim modes'",
          "gap.nc": "the gap of 'rotorsim diagnose'"}  # fmt: skip
READERS = {
    "a record": (["data", "check"], ["data", "convert"], ["identify"], ["diagnose", "plain_rotor"]),
    "a machine": (["machine", "check"], ["modes", "--no-pictures"], ["map"], ["hide"]),
    "a plan": (["campaign", "check"],),
    "a model": (["design", "p"],),
    "a law": (["verify"],),
    "targets": (["machine", "calibrate", "plain_rotor", "--targets"],),
    "a mapping": (["data", "check", "run.csv", "--mapping"],),
}
OWN = {"machine.toml": "a machine", "plan.toml": "a plan", "targets.toml": "targets", "mapping.toml": "a mapping",
       "law.json": "a law", "model.json": "a model"}  # fmt: skip
PAIRS = [(name, wanted) for name in (*TEXTS, *NETCDF) for wanted in READERS if OWN.get(name) != wanted]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with one of each."""
    folder = tmp_path_factory.mktemp("own")
    for name, (text, _) in TEXTS.items():
        (folder / name).write_text(text)
    (folder / "run.csv").write_text("t [s],a [um]\n0,1\n1e-3,1\n")
    from rotorsim.analysis import mode_shapes, operating_map
    from rotorsim.discrepancy.gap import gap_dataset

    plant = Plant("plain_rotor")
    operating_map(plant, [0.0, 100.0], [0.0]).to_netcdf(folder / "map.nc", engine="h5netcdf")
    mode_shapes(plant, 0.0, 0.0).to_netcdf(folder / "modes.nc", engine="h5netcdf")
    gap_dataset({}).to_netcdf(folder / "gap.nc", engine="h5netcdf")
    return folder


@pytest.mark.parametrize(("name", "wanted"), PAIRS)
def test_a_file_of_another_kind_is_named(run, made, tmp_path, name, wanted):
    for words in READERS[wanted]:
        given = [str(made / "run.csv") if word == "run.csv" else word for word in words]
        more = ["out.nc"] if words[-1] == "convert" else []
        code, out, message = run(*given, made / name, *more)
        assert code == 2 and out == "" and len(message.strip().splitlines()) == 1
        kind = TEXTS[name][1] if name in TEXTS else NETCDF[name] if wanted == "a record" else "a netCDF file"
        assert message.startswith(f"{made / name}: is {kind}, not {wanted}"), message
        assert "reads it" in message or "reads a record" in message or kind not in READ_BY, message
    assert not list(tmp_path.iterdir())


def test_a_netcdf_file_as_a_machine_is_refused_with_what_is_wanted_and_what_reads_it(run, made):
    code, out, message = run("machine", "check", made / "map.nc")
    assert (code, out) == (2, "")
    assert message == (
        f"{made / 'map.nc'}: is a netCDF file, not a machine file (TOML) ('rotorsim data check' reads a record); "
        "'rotorsim machine new PATH' writes one\n"
    )


def test_records_stay_records(run, tmp_path):
    """Records of a run, and those that `data convert` makes of it."""
    record = Plant("plain_rotor").simulate(0.01, 100.0)
    record.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    assert run("data", "convert", "run.nc", "again.nc")[0] == 0
    with xr.open_dataset(tmp_path / "again.nc", engine="h5netcdf") as again:
        assert again.sizes["time"] == record.sizes["time"]
