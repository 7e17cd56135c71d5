"""Page of a design: over a range of operating points, along one axis, at one point."""

from pathlib import Path

import numpy as np
import pytest

import rotorsim as rs
from identification import load_model
from rotorsim.report.control import damping_figure
from rotorsim.report.figure_files import figures_of

MODEL = Path(__file__).parents[1] / "control" / "rig_model.json"


@pytest.fixture(scope="module")
def lpv():
    return load_model(MODEL)


def test_a_design_at_one_point_has_its_modes_and_no_rectangle_of_damping(lpv, tmp_path):
    one = lpv.at(314.0, 0.5e6)
    page = rs.report.write_design(rs.control.design("lqr", one), one, tmp_path / "law.html").read_text()
    assert "Damping over the range" not in page and "corners of the range" not in page
    assert len(figures_of(tmp_path / "law.html")) == 2
    assert "Modes" in page and "At 2998 rpm, 0.5 MPa, the point of the model" in page
    assert "<td>open</td><td>118.5</td>" in page and "<td>closed</td>" in page


def test_a_design_over_a_range_has_its_map_of_damping(lpv, tmp_path):
    page = rs.report.write_design(rs.control.design("lqr", lpv), lpv, tmp_path / "law.html").read_text()
    assert "Damping over the range" in page and len(figures_of(tmp_path / "law.html")) == 3


@pytest.mark.parametrize(
    ("speeds", "pressures", "title"),
    [([314.0], [0.3e6, 0.5e6], "pressure [MPa]"), ([0.0, 314.0], [0.5e6], "speed [rpm]")],
)
def test_damping_along_one_axis_is_a_line(lpv, speeds, pressures, title):
    figure = damping_figure(rs.control.design("lqr", lpv), lpv, np.array(speeds), np.array(pressures))
    assert figure.data[0].type == "scatter" and figure.layout.xaxis.title.text == title
    assert figure.layout.yaxis.title.text == "damping ratio" and len(figure.data[0].y) == 2
