"""Records of machines with several films: a dimension with the bearings' names, in memory and on disk."""

import numpy as np
import pytest

import rotorsim as rs
from rotorsim.analysis import operating_map
from rotorsim.analysis.shaft_motion import measuring_places
from rotorsim.campaign.simulate_case import MemoryRecording
from rotorsim.experiments.running import begin, stream
from rotorsim.machine import load_machine, summary
from rotorsim.report.film import film_parts
from rotorsim.report.operating_map import blocks
from rotorsim.report.orbit import journal_names
from rotorsim.report.run import analyse

STEADY = rs.experiments.Steady(speed=600.0, pressure=0.5e6, duration=0.6)


@pytest.fixture(scope="module")
def plant():
    machine = load_machine("aerostatic_spindle").with_({"bearings.1.clearance": 22e-6, "bearings.1.length": 0.044})
    return rs.Plant(machine, n_theta=16, n_z=8, dt=2e-4)


@pytest.fixture(scope="module")
def path(plant, tmp_path_factory):
    file = tmp_path_factory.mktemp("record") / "run.nc"
    assert rs.record(plant, STEADY, file).complete
    return file


def test_films_are_chosen_by_the_names_of_their_bearings(plant):
    record = plant.simulate(0.02, 600.0, 0.5e6)
    assert record["bearing"].values.tolist() == ["rear", "front"]
    np.testing.assert_array_equal(record["journals"].sel(bearing="rear"), record["journal"])
    np.testing.assert_array_equal(record["film_forces"].sel(bearing="rear"), record["film_force"])
    np.testing.assert_array_equal(record["film_thickness"].min("bearing"), record["h_min"])
    np.testing.assert_allclose(record["film_flow"].sum("bearing"), record["mass_flow"], rtol=1e-12)
    assert (record["film_flow"].sel(bearing="front") > record["film_flow"].sel(bearing="rear")).all()
    assert "reference" not in record and "pin" not in record


def test_a_single_film_has_no_dimension_of_bearings():
    record = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8).simulate(0.002, 300.0, 0.5e6)
    assert "bearing" not in record.dims and "film_flow" not in record and "reference" in record


def test_bearings_without_a_name_are_named_by_their_index():
    machine = load_machine("aerostatic_spindle").with_({"bearings.0.name": None})
    assert machine.film_names == ("bearing 0", "front")


def test_a_file_and_a_record_in_memory_hold_the_pressures_of_all_films(plant, path):
    sink = MemoryRecording(bearings=plant.machine.film_names)
    stream(begin(plant, STEADY, 0), STEADY, sink)
    kept, stored = sink.dataset(), rs.open_record(path)
    for name in ("film_pressure", "film_z", "journals", "film_flow", "bearing"):
        assert kept[name].dims == stored[name].dims
        np.testing.assert_array_equal(kept[name].values, stored[name].values)
    assert stored["film_pressure"].dims == ("snapshot", "bearing", "theta", "z")
    edges = np.abs(stored["film_z"].values).max(axis=1)
    assert edges[1] == pytest.approx(1.1 * edges[0])


def test_the_page_shows_every_film_with_its_name(path):
    run = analyse(rs.open_record(path))
    assert [(p.name, len(p.feeds)) for p in film_parts(run)] == [("rear", 16), ("front", 16)]
    assert journal_names(run) == ["rear", "front"]
    maps = rs.report.film_pressure(rs.open_record(path))
    titles = [a.text for a in maps.layout.annotations]
    assert {t.split(",")[0] for t in titles} == {"rear", "front"}
    assert "journal front y [µm]" in {axis.title.text for axis in rs.report.orbits(rs.open_record(path)).select_yaxes()}
    page = path.with_suffix(".html")
    rs.report.write_report(path, page)
    html = page.read_text(encoding="utf-8")
    for text in ("Smallest film thickness, front", "Mass flow of all orifices", "Mass flow, rear", "film front"):
        assert text in html
    assert "injectors" not in html


def test_a_map_names_the_films(plant):
    found = operating_map(plant, [600.0], [0.4e6, 0.5e6], workers=1)
    assert found["film_stiffness"].sel(bearing="front").dims == ("pressure", "speed", "at", "axis", "to")
    texts = [b.heads for b in blocks(found.assign(safe=found["lifted"]))]
    assert all("gain" not in head for heads in texts for head in heads or ())


def test_places_of_a_response_and_the_summary_name_the_bearings(plant):
    assert {"bearing rear", "bearing front"} < set(measuring_places(plant))
    assert "2 gas films, with 20 um and 22 um clearance; in all 32 orifices" in summary(plant.machine)
    assert "gas film rear" in repr(plant.machine) and "16 orifices" in repr(plant.machine)
