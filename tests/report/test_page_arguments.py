"""Calls that write a page take the units and the kind of figure files that their commands take."""

import inspect
import re
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest

import rotorsim as rs
from identification import load_model, make_vectors
from refusals import refused
from rotorsim.base.errors import DataError

ROOT = Path(__file__).parents[2]
MODEL = ROOT / "tests" / "control" / "rig_model.json"
WRITERS = ("write", "write_report", "write_design", "save_study_page")
METRIC = re.compile(r"µm|MPa|g mm")


def design(path, **wanted):
    one = load_model(MODEL).at(314.0, 0.5e6)
    rs.report.write_design(rs.control.design("lqr", one), one, path, **wanted)


def comparison(path, **wanted):
    speed = np.linspace(50, 400, 200)
    size = (1e-6 / (0.01 + np.abs(speed / 200 - 1)))[:, None, None]
    runs = {name: make_vectors(speed, k * size, 0 * size, (1,), axes=("x",)) for name, k in (("a", 1), ("b", 2))}
    rs.report.write(rs.signals.compare_runs(runs), path, **wanted)


def balance(path, **wanted):
    kit = ROOT / "docs" / "rk4"
    found = rs.balance.assess("bently_rk4", rs.balance.read_conditions([kit / "open.csv"], kit / "balance.toml"))
    rs.report.write(found, path, **wanted)


def operating_map(path, **wanted):
    plant = rs.Plant("plain_rotor")
    found = rs.analysis.map_machine(plant, [0.0, 300.0], [0.4e6], workers=1)
    rs.report.write(found, path, **wanted)


def study(path, **wanted):
    block = rs.report.Block("Sizes", figure=go.Figure(go.Scatter(y=[1.0], x=[1.0])).update_yaxes(title_text="a [µm]"))
    rs.report.save_study_page("Study", "Amplitudes up to 25.4 µm.", [block], path, **wanted)


@pytest.mark.parametrize("write", [design, comparison, balance, operating_map, study])
def test_a_page_in_imperial_units_with_its_figures_as_files(write, tmp_path):
    write(tmp_path / "page.html", units="imperial", figures="csv")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    tables = [path.read_text(encoding="utf-8") for path in tmp_path.glob("page_*.csv")]
    assert "mil" in page or "oz in" in page
    assert tables and not any(METRIC.search(text) for text in [page.split("<script")[0], *tables])


def test_the_page_of_a_balancing_lists_the_unknown_unbalances(tmp_path):
    kit = ROOT / "docs" / "rk4"
    conditions = rs.balance.read_conditions([kit / "open.csv", kit / "unlabelled.csv"], kit / "balance.toml")
    page = rs.report.write(rs.balance.assess("bently_rk4", conditions), tmp_path / "b.html").read_text()
    assert "<th>disc_1 [g mm]</th><th>disc_1 at [deg]</th><th>disc_1 sd [g mm]</th>" in page
    assert page.count("<tr><td>S") == 56


@pytest.mark.parametrize("name", WRITERS)
def test_every_writer_of_pages_takes_units_and_figures(name):
    given = inspect.signature(getattr(rs.report, name)).parameters
    assert given["units"].default == "metric" and given["figures"].default is None


@pytest.mark.parametrize("wanted", [{"units": "inches"}, {"figures": "pdf"}])
@pytest.mark.parametrize("write", [design, comparison, study])
def test_others_are_refused_before_anything_is_written(write, wanted, tmp_path):
    with pytest.raises(DataError, match="is not known"):
        write(tmp_path / "page.html", **wanted)
    assert not list(tmp_path.iterdir())


def test_a_report_of_something_else_than_a_record_is_refused(tmp_path):
    with refused(DataError, "report", "Plant"):
        rs.write_report(rs.Plant("plain_rotor"), tmp_path / "page.html")
