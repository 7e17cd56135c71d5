"""Comparison of results of several machines: one kind in one picture, key figures, refusals."""

import json

import numpy as np
import pytest
import xarray as xr

from refusals import refused
from rotorsim.__main__ import main
from rotorsim.analysis import campbell, map_machine, unbalance_response
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.report import compare_results, result_rows, write

SPEEDS = np.linspace(50.0, 800.0, 16)


@pytest.fixture(scope="module")
def responses():
    plain = load_machine("plain_rotor")
    softer = plain.with_({"bearings.0.kxx": 5e5, "bearings.1.kxx": 5e5})
    return {name: unbalance_response(Plant(m), SPEEDS, 0.0) for name, m in (("plain", plain), ("softer", softer))}


def test_responses_lie_over_each_other_with_their_peaks(responses):
    figure = compare_results(responses)
    assert [t.name for t in figure.data if t.showlegend is not False] == ["plain", "softer"]
    plain, softer = result_rows(responses)
    assert softer["speed [rpm]"] < plain["speed [rpm]"] and plain["result"] == "plain"
    largest = float(responses["plain"]["major"].isel(place=0).max()) * 1e6
    assert plain["peak [µm 0-pk]"] == pytest.approx(largest)


def test_the_command_takes_results_and_writes_page_and_figures(responses, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, found in responses.items():
        write_netcdf(tmp_path / f"{name}.nc", found)
    with pytest.raises(SystemExit) as ended:
        main(["compare", "plain.nc", "softer.nc", "--out", "both", "--json"])
    assert not ended.value.code
    printed = json.loads(capsys.readouterr().out)
    assert [row["result"] for row in printed["results"]] == ["plain", "softer"]
    assert "<h2>Key figures</h2>" in (tmp_path / "both" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("results", "value"), [({}, None), ({"a": 1}, "a"), ({"a": map(str, ())}, "a")])
def test_a_dictionary_that_holds_no_results_is_refused(results, value, tmp_path):
    with refused(DataError, "results", value):
        write(results, tmp_path / "page.html")


def test_a_map_whose_points_the_film_does_not_carry_is_refused_alone_and_in_a_comparison(rig, tmp_path):
    low = map_machine(rig(), [0.0], [0.1e6], workers=1)
    assert not low["lifted"].any()
    for results, value in ((low, "map"), ({"low": low}, "low")):
        with refused(DataError, "result", value):
            write(results, tmp_path / "page.html")


def test_results_of_several_kinds_are_refused_and_nothing_is_written(responses, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    other = campbell(Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=2)
    with refused(DataError, "results", "other"):
        compare_results({"plain": responses["plain"], "other": other})
    write_netcdf(tmp_path / "a.nc", responses["plain"])
    write_netcdf(tmp_path / "b.nc", other)
    with pytest.raises(SystemExit) as ended:
        main(["compare", "a.nc", "b.nc"])
    assert ended.value.code == 2 and "give results of one kind" in capsys.readouterr().err
    (tmp_path / "folder").mkdir()
    write_netcdf(tmp_path / "folder" / "response.nc", responses["plain"])
    for runs in (["folder", "missing"], ["missing", "folder"]):
        with pytest.raises(SystemExit) as ended:
            main(["compare", *runs])
        message = capsys.readouterr().err
        assert ended.value.code == 2 and message.startswith("missing: ") and message.count("\n") == 1
        assert "Errno" not in message
    assert not (tmp_path / "compare").exists()


def sweep_over(*frequencies):
    """A sweep of one axis, as `rs.analysis.sweep` writes it."""
    from rotorsim.analysis.sweep_definition import QUANTITIES

    k = QUANTITIES["frequency"].factor
    return xr.Dataset(
        {
            "frequency": ("stiffness", np.array(frequencies) / k, {"units": "rad/s"}),
            "frequency_reason": ("stiffness", [""] * len(frequencies)),
        },
        {"stiffness": ("stiffness", [1.0, 2.0, 3.0], {"units": "MN/m", "long_name": "bearings.0.kxx"})},
        {"kind": "sweep"},
    )


def test_sweeps_lie_over_each_other_with_their_best_points():
    sweeps = {"before": sweep_over(10.0, 20.0, 15.0), "after": sweep_over(12.0, 14.0, 30.0)}
    figure = compare_results(sweeps)
    assert [t.name for t in figure.data] == ["before", "after"]
    assert [float(y) for y in figure.data[1].y] == pytest.approx([12.0, 14.0, 30.0])
    rows = result_rows(sweeps)
    assert [row["result"] for row in rows] == ["before", "after"]
    assert {row["quantity"] for row in rows} == {"frequency"}
    with refused(DataError, "results", None):
        compare_results({"before": sweeps["before"], "after": sweeps["after"].rename(stiffness="other")})


def test_of_machines_the_fields_that_differ_are_listed(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plain = load_machine("plain_rotor")
    plain.replace("bearings.0.kxx", "5 MN/m").replace("shaft.sections.0.outer_diameter_right", "25 mm").save(
        "soft.toml"
    )
    with pytest.raises(SystemExit) as ended:
        main(["compare", "plain_rotor", "soft.toml", "--json"])
    assert not ended.value.code
    rows = json.loads(capsys.readouterr().out)["differences"]
    assert rows[0] == {"field": "shaft.sections.0.outer_diameter_right", "plain_rotor": "not set [mm]", "soft": "25 mm"}
    assert {row["field"] for row in rows[1:]} == {"bearings.0.kxx", "bearings.0.kyy"}
