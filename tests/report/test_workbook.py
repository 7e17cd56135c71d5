"""Tables of results as workbooks: what is read back is what the result holds."""

import sys

import numpy as np
import pytest
import xarray as xr

from refusals import refused
from rotorsim.__main__ import main
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.report import workbook, write_workbook


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        return int(ended.value.code or 0), *capsys.readouterr()

    return call


@pytest.fixture
def result():
    speed = ("speed", [10.0, 20.0, 30.0], {"units": "rad/s"})
    return xr.Dataset(
        {
            "peak": ("speed", [1e-6, np.nan, 3e-6], {"units": "m"}),
            "wn": (("mode", "speed"), np.arange(6.0).reshape(2, 3), {"units": "rad/s"}),
            "proven": ("speed", [1, 0, 1]),
            "note": ((), "all of it"),
        },
        {"speed": speed, "mode": ["first", "second"]},
        {"kind": "response", "machine": "x" * 40_000},
    )


def read(path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.load_workbook(path, read_only=True)
    return {sheet.title: [list(row) for row in sheet.iter_rows(values_only=True)] for sheet in book}


def test_every_number_stands_below_its_name_and_unit(result, tmp_path):
    pytest.importorskip("openpyxl")
    assert write_workbook(result, tmp_path / "r.xlsx") == {"speed": 3, "mode x speed": 6, "values": 1, "about": 2}
    sheets = read(tmp_path / "r.xlsx")
    assert sheets["speed"] == [
        ["speed [rad/s]", "peak [m]", "proven"], [10, 1e-6, 1], [20, None, 0], [30, 3e-6, 1]
    ]  # fmt: skip
    assert sheets["mode x speed"][0] == ["mode", "speed [rad/s]", "wn [rad/s]"]
    assert sheets["mode x speed"][5] == ["second", 20, 4]
    assert sheets["values"] == [["note"], ["all of it"]]
    assert sheets["about"][1] == ["kind", "response"] and len(sheets["about"][2][1]) == workbook.MOST_TEXT


def test_the_command_writes_the_workbook_of_a_result(result, tmp_path, run):
    pytest.importorskip("openpyxl")
    write_netcdf(tmp_path / "r.nc", result)
    code, out, _ = run("report", "tables", "r.nc")
    assert code == 0 and "mode x speed: 6 rows" in out
    assert read(tmp_path / "r.xlsx")["speed"][1] == [10, 1e-6, 1]
    code, _, message = run("report", "tables", "r.nc")
    assert code == 2 and "r.xlsx" in message


def test_another_ending_and_too_many_rows_are_refused(result, tmp_path, monkeypatch):
    pytest.importorskip("openpyxl")
    with refused(DataError, "path", str(tmp_path / "r.xls")):
        write_workbook(result, tmp_path / "r.xls")
    monkeypatch.setattr(workbook, "MOST_ROWS", 4)
    with refused(DataError, "path", str(tmp_path / "r.xlsx")):
        write_workbook(result, tmp_path / "r.xlsx")
    assert not list(tmp_path.iterdir())


def test_without_the_package_the_extra_is_named(result, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(DataError, match=r"rotorsim\[xlsx\]"):
        write_workbook(result, tmp_path / "r.xlsx")


def test_names_of_sheets_are_short_and_differ():
    long = {f"{'axis' * 9}{k}": 2 for k in range(3)}
    found = xr.Dataset({f"v{k}": ((name,), np.zeros(2)) for k, name in enumerate(long)})
    names = list(workbook.tables(found))
    assert len(set(names)) == 4 and max(map(len, names)) <= workbook.LONGEST_NAME
