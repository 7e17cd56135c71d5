"""Page of an operating map: which panels there are, columns with names, nothing that is not a number."""

import re

import numpy as np
import pytest

import rotorsim as rs
from rotorsim.report.operating_map import (
    GAINS,
    HEADS,
    blocks,
    campbell_figure,
    constants,
    contour_figure,
    map_page,
    onset_figure,
    varying,
)
from rotorsim.report.page import Page, html


@pytest.fixture(scope="module")
def found():
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4)
    return rs.analysis.map_machine(plant, [0.0, 300.0, 600.0], [0.3e6, 0.5e6, 0.7e6], workers=1, critical=True)


def without_lift(found, points):
    """The map as if the film carried at `points` (pressures by speeds) alone."""
    kept = points.reshape(found["lifted"].shape) > 0
    where = {name: found[name].where(found["lifted"].copy(data=kept)) for name in found if "speed" in found[name].dims}
    return found.assign(where).assign(lifted=found["lifted"].copy(data=kept.astype(float)))


def text_of(page):
    return re.sub(r"<[^>]*>", " ", re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL))


@pytest.mark.parametrize("points", [np.ones(9), np.eye(3), np.array([1, 1, 0, 1, 1, 0, 0, 0, 0]), np.zeros(9)])
def test_no_panel_is_empty_and_nothing_that_is_no_number_is_printed(found, points):
    one = without_lift(found, points)
    page = html(Page("map", "", blocks(one)))
    assert not re.search(r"\b(nan|inf|None)\b", text_of(page))
    for panel in varying(one):
        drawn = [trace for trace in contour_figure(one).data if trace.hoverinfo != "skip"]
        values = np.asarray(drawn[varying(one).index(panel)].z, float)
        assert np.isfinite(values).sum() >= 4 and np.nanmax(values) > np.nanmin(values)
    assert bool(varying(one)) == (points.sum() in (9, 4))


def test_a_quantity_that_is_the_same_everywhere_is_a_sentence_and_no_panel(found):
    one = found.assign(h_min=found["h_min"].copy(data=np.full_like(found["h_min"].values, 12e-6)))
    assert ("smallest film [µm]", pytest.approx(12.0)) in constants(one)
    assert all(title != "smallest film [µm]" for title, *_ in varying(one))
    assert "All over the map: smallest film [µm] 12." in blocks(one)[0].text


def test_the_text_lists_every_critical_speed_of_the_file(found):
    table = next(block for block in blocks(found) if block.title == "Critical speeds")
    speeds = found["crossing_speed"].values * 60 / (2 * np.pi)
    assert len(table.rows) == np.isfinite(speeds).sum() > 20
    assert sorted(float(row[2]) for row in table.rows) == sorted(np.round(speeds[np.isfinite(speeds)]))
    first = found.drop_vars([name for name in found.variables if "crossing" in str(name) or name == "order"])
    of_map = next(block for block in blocks(first) if block.title == "Critical speeds")
    assert len(of_map.rows) == np.isfinite(found["critical_speed"]).sum() and {row[1] for row in of_map.rows} == {"1X"}


def test_a_critical_speed_counts_for_what_is_safe_as_the_map_counted_it(found):
    table = next(block for block in blocks(found) if block.title == "Critical speeds")
    amplified = [row[1] == "1X" and 0.5 / float(row[3]) >= 2.5 for row in table.rows]
    assert [row[4] == "yes" for row in table.rows] == amplified and 0 < sum(amplified) < len(amplified)


def test_a_point_that_is_not_safe_states_why(found):
    grows = found["grows"].copy(data=np.eye(3))
    one = found.assign(grows=grows, safe=found["safe"].where(grows == 0, 0.0))
    reasons = [str(row[-1]) for row in blocks(one)[-1].rows]
    assert [reason.startswith("no: a mode grows") for reason in reasons] == (np.eye(3).ravel() == 1).tolist()
    assert all(reason in ("yes", "not known") or reason.startswith("no: ") for reason in reasons)


def test_every_column_has_a_name_and_its_unit(found):
    page, last = html(Page("map", "", blocks(found))), blocks(found)[-1]
    heads = (*HEADS, *GAINS, "safe")
    assert "<th></th>" not in page and all(f"<th>{head}</th>" in page for head in heads)
    assert sum("[" in head for head in heads) == 6 and len(heads) == len(last.rows[0])


def test_an_onset_that_was_not_found_is_stated_and_not_drawn(found):
    one = found.assign(onset_speed=("pressure", np.full(3, np.nan)))
    titles = {block.title: block for block in blocks(one)}
    assert "Whirl onset and lift-off" not in titles
    assert titles["Not shown"].rows[0][0] == "whirl onset"
    one = found.assign(onset_speed=("pressure", np.array([1500.0, np.nan, np.nan])))
    assert "Not shown" not in {block.title for block in blocks(one)} and len(onset_figure(one).data) == 1


def test_one_onset_is_a_sentence_and_lift_off_over_speeds_a_curve(found):
    one = found.isel(pressure=[1]).assign(onset_speed=("pressure", np.array([959.3])))
    block = next(block for block in blocks(one) if block.title == "Whirl onset and lift-off")
    assert block.figure is None and block.text == "Whirl onset: 9161 rpm at 0.5 MPa."
    lifted = one.assign(lift_off_pressure=("speed", np.array([2e5, 3e5, 4e5])))
    block = next(block for block in blocks(lifted) if block.title == "Whirl onset and lift-off")
    assert [len(trace.x) for trace in block.figure.data] == [1, 3]


def test_the_head_of_the_page_says_once_why_points_are_not_safe(found):
    zeta = found["zeta_least"].copy()
    zeta[{"pressure": 1, "speed": 2}] = -0.1
    introduction = map_page(rs.analysis.safe_region(found.assign(zeta_least=zeta))).introduction
    assert introduction.count("Not safe") == 1 and "; a mode grows from between" in introduction


def test_the_legend_of_the_campbell_diagram_lists_only_what_is_drawn(found):
    one = found.assign(crossing_speed=found["crossing_speed"].where(found["crossing_speed"] > 1e9))
    assert not [trace.name for trace in campbell_figure(one).data if "crossings" in str(trace.name)]
    one = without_lift(found, np.array([0, 0, 0, 1, 1, 1, 1, 1, 1]))
    assert not [trace.name for trace in campbell_figure(one).data if "0.3 MPa" in str(trace.name)]
