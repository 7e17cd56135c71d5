"""Pages in imperial units: quantities, columns and axes; numbers against pint; finished text is never rewritten."""

import json
import re

import numpy as np
import pint
import plotly.graph_objects as go
import pytest
from plotly.subplots import make_subplots

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.report.figure_files import figure_csv, figures_of, imperial_figure
from rotorsim.report.page import Block, Page, figures, html, plain_page, save_study_page
from rotorsim.report.units import IMPERIAL, displacement, label, micrometres, number, quantity, unit_system

PINT = {
    "mil": "thou", "lb": "pound", "mil/V": "thou/volt", "mil/lbf": "thou/force_pound", "V/mil": "volt/thou",
    "V/lbf": "volt/force_pound", "klbf/in": "kiloforce_pound/inch",
    "lbf": "force_pound", "lbf s/in": "force_pound*second/inch", "lbf/in": "force_pound/inch",
    "in": "inch", "psi": "psi", "lb/h": "pound/hour", "oz in": "ounce*inch", "oz": "ounce",
    "kN s/m": "kN*s/m", "g mm": "g*mm", "µm": "µm", "lbf in": "force_pound*inch", "N m": "N*m",
}  # fmt: skip
LEFT = re.compile(r"µm|\bum\b|\bMPa\b|\bmg/s\b|\bNl/min\b|\bkN\b|\d mm\b|\[N\]|g mm")


@pytest.mark.parametrize("unit", [unit for unit in IMPERIAL if unit not in ("Nl/min", "normal litres per minute")])
def test_every_factor_is_that_of_pint(unit):
    ureg = pint.UnitRegistry()
    name, factor = IMPERIAL[unit]
    if name.startswith("klbf"):
        name, factor = name[1:], 1e3 * factor
    assert ureg.Quantity(1.0, PINT.get(unit, unit)).to(PINT[name]).magnitude == pytest.approx(factor, rel=1e-9)


def test_a_normal_litre_is_at_0_and_a_standard_cubic_foot_at_60_degrees_fahrenheit():
    assert IMPERIAL["Nl/min"][1] == pytest.approx(0.0353147 * 288.7056 / 273.15, rel=1e-5)


@pytest.mark.parametrize(
    ("value", "unit", "form", "metric", "imperial"),
    [
        (0.755, "µm", ".3g", "0.755 µm", "0.0297 mil"),
        (0.5, "MPa", "g", "0.5 MPa", "72.5 psi"),
        (52.12, "mg/s", ".4g", "52.12 mg/s", "0.4137 lb/h"),
        (1.2e-5, "µm", ".2g", "1.2e-05 µm", "4.72e-07 mil"),
        (-3.0, "mm", "g", "-3 mm", "-0.118 in"),
        (25.0, "g*mm", "g", "25 g*mm", "0.0347 oz in"),
        (12.0, "N m", "g", "12 N m", "106 lbf in"),
        (3000.0, "rpm", ".0f", "3000 rpm", "3000 rpm"),
        (120.0, "Hz", "g", "120 Hz", "120 Hz"),
    ],
)
def test_a_quantity_is_rendered_in_the_units_of_the_page(value, unit, form, metric, imperial):
    assert quantity(value, unit, form) == metric
    with unit_system("imperial"):
        assert quantity(value, unit, form) == imperial
    assert quantity(value, unit, form) == metric


def test_parts_of_a_range_and_displacements_in_metres():
    with unit_system("imperial"):
        assert f"{number(0.105, 'MPa')} to {quantity(0.214, 'MPa')}" == "15.2 to 31 psi"
        assert displacement(25.4e-6) == "1 mil"


FOREIGN = "an acceleration of 0.5 g, 3 N at most; 25 um and 0.5 MPa in a name, 5 mm [g]"


def test_text_that_is_no_quantity_is_never_rewritten():
    """Names, descriptions and sentences of others hold what looks like numbers with units: 0.5 g is no mass."""
    figure = go.Figure(go.Scatter(x=[1.0], y=[0.5], name=FOREIGN, text=[FOREIGN])).update_yaxes(title_text="a [g]")
    blocks = [Block(FOREIGN, FOREIGN, (FOREIGN, "a [g]"), [(FOREIGN, 0.5)], figure)]
    with unit_system("imperial"):
        made = Page(FOREIGN, FOREIGN, blocks)
        page, drawn = html(made), figures(plain_page(made))[0]
    shown = re.sub(r"<[^>]*>", " ", re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)).replace("µm", "um")
    assert shown.count(FOREIGN) == 7 and "oz" not in shown and "a [g]" in shown and "0.5" in shown
    assert drawn["layout"]["yaxis"]["title"]["text"] == "a [g]" and drawn["data"][0]["y"] == [0.5]
    assert drawn["data"][0]["name"] == FOREIGN and drawn["data"][0]["text"] == [FOREIGN]


def test_columns_are_converted_by_their_heads_and_machine_files_stay():
    heads, rows = ("p [MPa]", "order"), [("0.5", "2"), ("-", "1")]
    with unit_system("imperial"):
        shown = html(Page("a", "b", [Block("c", "", heads, rows), Block("d", "", heads, [(0.5, "2")])]))
    table = "<table><thead><tr><th>p [psi]</th><th>order</th></tr></thead><tr><td>72.5</td><td>2</td></tr>"
    assert f"{table}<tr><td>-</td><td>1</td></tr></table>" in re.sub(r"\n", "", shown)
    assert shown.count("<td>72.5</td>") == 2
    assert "<td>0.5</td>" in html(Page("a", "b", [Block("c", "", heads, rows)]))


def test_a_page_that_is_written_in_imperial_units_leaves_the_next_one_metric(tmp_path):
    block = Block("c", "", ("p [MPa]",), [(0.5,)])
    for name, units in (("a", "imperial"), ("b", "metric")):
        save_study_page("t", "d", [block], tmp_path / f"{name}.html", units)
    assert "p [psi]" in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "p [MPa]" in (tmp_path / "b.html").read_text(encoding="utf-8")


def plain(figure):
    return json.loads(figure.to_json())


def test_data_ranges_shapes_and_labels_of_an_axis_go_together():
    figure = make_subplots(1, 2, shared_yaxes=True)
    for column in (1, 2):
        figure.add_trace(go.Scatter(x=[1, 2], y=np.array([25.4, 50.8]), hovertemplate="%{y:.3g} µm"), 1, column)
    figure.update_yaxes(title_text="size<br>[µm 0-pk]", range=[0, 254], col=1)
    figure.add_hline(y=127, row=1, col=1)
    made = imperial_figure(plain(figure))
    assert [trace["y"] for trace in made["data"]] == [[1, 2], [1, 2]]
    assert made["layout"]["yaxis"]["range"] == [0, 10] and made["layout"]["shapes"][0]["y0"] == pytest.approx(5)
    assert made["layout"]["yaxis"]["title"]["text"] == "size<br>[mil 0-pk]"
    assert made["data"][0]["hovertemplate"] == "%{y:.3g} mil" and plain(figure)["data"][0]["x"] == made["data"][0]["x"]


def test_a_panel_takes_the_unit_of_its_own_title_or_of_the_panel_on_its_left():
    """Axes that are neither linked nor labelled: the row of amplitudes of 1X, 2X and 3X."""
    figure = make_subplots(1, 3, subplot_titles=["1X", "2X", "force [N]"])
    for column in (1, 2, 3):
        figure.add_trace(go.Scatter(x=[1, 2], y=[25.4, 50.8]), 1, column)
    figure.update_yaxes(title_text="size [µm]", col=1)
    made = imperial_figure(plain(figure))
    assert [trace["y"][0] for trace in made["data"]] == [1, 1, 5.71015]
    assert [note["text"] for note in made["layout"]["annotations"]] == ["1X", "2X", "force [lbf]"]


def test_a_logarithmic_axis_and_a_colour_scale_in_powers_of_ten_are_shifted():
    figure = go.Figure(go.Scatter(x=[1, 2], y=[25.4, 254.0]))
    figure.update_yaxes(type="log", range=[0, 2], title_text="a [µm]")
    assert imperial_figure(plain(figure))["layout"]["yaxis"]["range"] == pytest.approx([-1.40483, 0.59517], abs=1e-5)
    bar = {"title": {"text": "µm"}, "tickvals": [0.0, 1.0], "ticktext": ["1", "10"]}
    figure = go.Figure(go.Heatmap(z=np.log10([[25.4, 254.0]]), coloraxis="coloraxis"))
    made = imperial_figure(plain(figure.update_layout(coloraxis={"cmin": 0, "cmax": 3, "colorbar": bar})))
    assert made["layout"]["coloraxis"]["colorbar"]["ticktext"] == ["0.1", "1", "10"]
    assert [line.split(",")[7] for line in figure_csv(made).splitlines()[1:]] == ["1", "10"]


def test_an_axis_without_brackets_stays_with_its_numbers():
    figure = go.Figure(go.Bar(x=[25.4], y=["a"], orientation="h")).update_xaxes(title_text="gap, um rms")
    made = imperial_figure(plain(figure))
    assert made["layout"]["xaxis"]["title"]["text"] == "gap, um rms"
    assert figure_csv(made) == figure_csv(plain(figure))


def test_an_axis_whose_title_begins_with_its_unit_takes_its_numbers_along():
    figure = go.Figure(go.Scatter(x=[1.0, 2.0], y=[25.4, 50.8])).update_yaxes(title_text="µm pk-pk")
    made = imperial_figure(plain(figure))
    assert made["layout"]["yaxis"]["title"]["text"] == "mil pk-pk" and made["data"][0]["y"] == [1, 2]


def test_categories_that_are_numbers_of_an_axis_are_converted_and_names_stay():
    figure = go.Figure(go.Bar(x=[["0 rpm", "3 krpm"], ["0.30", "0.70"]], y=[1.0, 2.0]))
    made = imperial_figure(plain(figure.update_xaxes(title_text="pressure [MPa], speed")))
    assert made["data"][0]["x"] == [["0 rpm", "3 krpm"], ["43.5", "102"]]
    assert made["layout"]["xaxis"]["title"]["text"] == "pressure [psi], speed"
    made = imperial_figure(plain(go.Figure(go.Bar(y=["fit: 1200 rpm, 16 N"], x=[1.0], hovertext=["16 N"]))))
    assert made["data"][0]["y"] == ["fit: 1200 rpm, 16 N"] and made["data"][0]["hovertext"] == ["16 N"]
    assert label("size<br>[µm 0-pk]") == "size<br>[µm 0-pk]"


def test_micrometres_have_their_sign_on_pages_and_not_in_machine_files():
    text = "30 um, [um rms] and summer"
    page = html(Page("a", "b", [Block(text, text, code="clearance = '25 um'")]))
    assert micrometres(text) == "30 µm, [µm rms] and summer" and page.count(micrometres(text)) == 2
    assert "<pre>clearance = &#39;25 um&#39;</pre>" in page


@pytest.fixture(scope="module")
def record():
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4)
    return rs.experiments.runup(plant, 0.0, 200.0, 200.0, 0.5e6)


def test_nothing_metric_is_left_in_a_report(record, tmp_path):
    rs.write_report(record, tmp_path / "metric.html")
    rs.write_report(record, tmp_path / "imperial.html", units="imperial")
    pages = [(tmp_path / f"{name}.html").read_text(encoding="utf-8") for name in ("metric", "imperial")]
    texts = [re.sub(r"<[^>]*>", " ", re.sub(r"<(script|style|pre)\b.*?</\1>", "", p, flags=re.DOTALL)) for p in pages]
    description = rs.load_machine("dtu_gas_bearing").description
    texts = [text.replace(description, "") for text in texts]  # a text of the machine file
    assert len(LEFT.findall(texts[0])) > 10 and not LEFT.findall(texts[1])
    drawn = [figures_of(tmp_path / f"{name}.html") for name in ("metric", "imperial")]
    for before, after in zip(*drawn, strict=True):
        assert not LEFT.findall(json.dumps(after, ensure_ascii=False))
        assert len(after["data"]) == len(before["data"])


def test_units_that_are_not_known_are_refused(record, tmp_path):
    with refused(DataError, "units", "inches"):
        rs.write_report(record, tmp_path / "a.html", units="inches")
    assert not list(tmp_path.iterdir())
