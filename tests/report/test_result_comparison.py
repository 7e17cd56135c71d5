"""Comparison of results of several machines: one kind in one picture, key figures, refusals."""

import json

import numpy as np
import pytest

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
    assert not (tmp_path / "compare").exists()
