"""Figures of a page as CSV, SVG and PNG, and single figures as PNG."""

import csv
import io
import json

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.subplots import make_subplots

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.report import save_figures, save_png
from rotorsim.report.browser import chrome
from rotorsim.report.figure_files import HEADS, figure_csv, figures_of
from rotorsim.report.page import Block, compact, save_study_page, style

NEEDS_CHROME = pytest.mark.skipif(chrome() is None, reason="no Chromium here; install Debian's package chromium")
X, Z = np.array([1.0, 2.0, np.nan]), np.array([[-1.0, 0.0, 1.0], [2.0, np.nan, 0.5]])


def two_panels():
    figure = make_subplots(1, 2, subplot_titles=["left", "right <b>side</b>"], shared_yaxes=True)
    figure.add_trace(go.Scatter(x=compact(X), y=compact(X**2), name="a < b"), 1, 1)
    figure.add_trace(go.Scatter(y=[3, 4]), 1, 2)
    figure.update_xaxes(title_text="speed [rpm]").update_yaxes(title_text="size [µm 0-pk]", col=1)
    return style(figure, 300)


def rows_of(figure):
    rows = list(csv.reader(io.StringIO(figure_csv(json.loads(figure.to_json())))))
    assert tuple(rows[0]) == HEADS
    return rows[1:]


@pytest.fixture
def page(tmp_path):
    blocks = [Block("One: <two> panels", figure=two_panels()), Block("Map", figure=go.Figure(go.Heatmap(z=Z))),
              Block("Map", figure=go.Figure(go.Surface(z=Z, surfacecolor=Z + 1)))]  # fmt: skip
    path = tmp_path / "page.html"
    save_study_page("page", "", blocks, path)
    return path


def test_a_table_names_panel_curve_and_axes_of_every_point():
    assert rows_of(two_panels()) == [
        ["left", "a < b", "speed [rpm]", "size [µm 0-pk]", "", "1", "1", "", ""],
        ["left", "a < b", "speed [rpm]", "size [µm 0-pk]", "", "2", "4", "", ""],
        ["left", "a < b", "speed [rpm]", "size [µm 0-pk]", "", "", "", "", ""],
        ["right side", "scatter 2", "speed [rpm]", "size [µm 0-pk]", "", "0", "3", "", ""],
        ["right side", "scatter 2", "speed [rpm]", "size [µm 0-pk]", "", "1", "4", "", ""],
    ]


def test_a_colour_scale_in_powers_of_ten_is_written_as_numbers():
    bar = {"title": {"text": "µm"}, "tickvals": [-1.0, 0.0], "ticktext": ["0.1", "1"]}
    rows = rows_of(go.Figure(go.Heatmap(x=[1, 2, 3], y=[5, 6], z=Z, colorbar=bar)))
    assert [row[5:8] for row in rows[:4]] == [["1", "5", "0.1"], ["2", "5", "1"], ["3", "5", "10"], ["1", "6", "100"]]
    assert rows[4][7] == "" and rows[0][4] == "µm"


def test_labels_in_two_lines_and_bars_are_written():
    rows = rows_of(go.Figure(go.Bar(x=[["1 krpm", "2 krpm"], ["0.3", "0.5"]], y=[1, 2])))
    assert [row[5:7] for row in rows] == [["1 krpm / 0.3", "1"], ["2 krpm / 0.5", "2"]]


def test_every_figure_of_a_page_is_found_under_its_title(page):
    found = figures_of(page)
    assert [one["title"] for one in found] == ["One: <two> panels", "Map", "Map"]
    assert found[0]["layout"]["height"] == 300


def test_tables_lie_next_to_the_page_with_the_names_of_its_figures(page):
    paths = save_figures(page, "csv")
    assert [p.name for p in paths] == ["page_one_two_panels.csv", "page_map.csv", "page_map_2.csv"]
    assert "0,0,-1,0" in paths[2].read_text()


@NEEDS_CHROME
@pytest.mark.parametrize(("kind", "begin"), [("png", b"\x89PNG"), ("svg", b"<svg")])
def test_images_lie_next_to_the_page_with_the_names_of_its_figures(page, kind, begin):
    paths = save_figures(page, kind)
    assert [p.name for p in paths] == [f"page_one_two_panels.{kind}", f"page_map.{kind}", f"page_map_2.{kind}"]
    assert all(p.read_bytes().startswith(begin) for p in paths)


@NEEDS_CHROME
def test_a_single_figure_has_the_size_that_was_asked_for(tmp_path):
    image = pytest.importorskip("PIL.Image")
    save_png(two_panels(), tmp_path / "a.png", width=500, height=400)
    with image.open(tmp_path / "a.png") as found:
        assert found.size == (500, 400)


def test_a_file_that_is_no_page_and_an_unknown_kind_are_refused(tmp_path, page):
    with refused(DataError, "page", tmp_path / "none.html"):
        save_figures(tmp_path / "none.html", "csv")
    with pytest.raises(DataError, match="'pdf' is not known"):
        save_figures(page, "pdf")
