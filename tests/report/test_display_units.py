"""Pages in imperial units: every text, table and axis; numbers against pint; nothing metric is left."""

import json
import re

import numpy as np
import pint
import plotly.graph_objects as go
import pytest
from plotly.subplots import make_subplots

import rotorsim as rs
from rotorsim.base.errors import DataError
from rotorsim.report.export.display_units import IMPERIAL, converted, converted_html, micrometres
from rotorsim.report.export.figure_table import figure_csv
from rotorsim.report.export.figure_units import imperial_figure
from rotorsim.report.export.page_units import in_units
from rotorsim.report.pages.html import figures_of

PINT = {
    "mil": "thou", "mil/V": "thou/volt", "mil/lbf": "thou/force_pound", "V/mil": "volt/thou",
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
    ("metric", "imperial"),
    [
        ("0.755 µm 0-pk at 2743 rpm", "0.0297 mil 0-pk at 2743 rpm"),
        ("Pressures range from 0.105 to 0.214 MPa absolute", "Pressures range from 15.2 to 31.0 psi absolute"),
        ("52.12 mg/s (51.94 to 52.27), 2.42 Nl/min", "0.4137 lb/h (0.4122 to 0.4148), 0.0903 scfm"),
        ("semi-axes 0.758 and 0.653 um.", "semi-axes 0.0298 and 0.0257 mil."),
        ("3000 rpm, 0.5 MPa", "3000 rpm, 72.5 psi"),
        ("static gain [um/V]", "static gain [mil/V]"),
        ("a force of 20 N along x; N acts inwards", "a force of 4.50 lbf along x; N acts inwards"),
        ("1.2e-05 µm", "4.72e-07 mil"),
        ("-3 mm", "-0.118 in"),
        ("25 g*mm and 10 g mm", "0.0347 oz in and 0.0139 oz in"),
        ("12 N m, but 5 N*s/m", "106 lbf in, but 5 N*s/m"),
        ("1500 rpm, 120 Hz, 4 V, 2.5 MN, 3 summer", "1500 rpm, 120 Hz, 4 V, 2.5 MN, 3 summer"),
    ],
)
def test_quantities_in_texts(metric, imperial):
    expected = imperial.replace("31.0", "31").replace("4.50", "4.5")
    assert converted(metric) == expected
    assert converted(expected) == expected


def test_columns_are_converted_by_their_heads_and_machine_files_stay():
    page = ("<table><tr><th>p [MPa]</th><th>order</th></tr><tr><td>0.5</td><td>2</td></tr><tr><td>-</td><td>1</td></tr>"
            "</table><pre>clearance = 25 um</pre><p>1 &lt; 2 µm</p>")  # fmt: skip
    assert converted_html(page) == (
        "<table><tr><th>p [psi]</th><th>order</th></tr><tr><td>72.5</td><td>2</td></tr><tr><td>-</td><td>1</td></tr>"
        "</table><pre>clearance = 25 um</pre><p>1 &lt; 0.0787 mil</p>"
    )


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


def test_an_axis_that_states_its_unit_without_brackets_is_converted_with_its_numbers():
    figure = go.Figure(go.Bar(x=[25.4], y=["a"], orientation="h")).update_xaxes(title_text="gap, um rms")
    made = imperial_figure(plain(figure))
    assert made["data"][0]["x"] == [1.0] and made["layout"]["xaxis"]["title"]["text"] == "gap, mil rms"


def test_names_of_categories_are_converted():
    figure = go.Figure(go.Bar(x=[["0 rpm", "3 krpm"], ["0.30", "0.70"]], y=[1.0, 2.0]))
    made = imperial_figure(plain(figure.update_xaxes(title_text="pressure [MPa], speed")))
    assert made["data"][0]["x"] == [["0 rpm", "3 krpm"], ["43.5", "102"]]
    assert made["layout"]["xaxis"]["title"]["text"] == "pressure [psi], speed"
    made = imperial_figure(plain(go.Figure(go.Bar(y=["fit: 1200 rpm, 16 N"], x=[1.0], hovertext=["16 N"]))))
    assert made["data"][0]["y"] == ["fit: 1200 rpm, 3.6 lbf"] and made["data"][0]["hovertext"] == ["3.6 lbf"]


def test_micrometres_have_their_sign_on_pages_and_not_in_machine_files():
    page = "<p>30 um, [um rms] and summer</p><pre>clearance = '25 um'</pre>"
    assert micrometres(page) == "<p>30 µm, [µm rms] and summer</p><pre>clearance = '25 um'</pre>"


@pytest.fixture(scope="module")
def record():
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4)
    return rs.experiments.runup(plant, 0.0, 200.0, 200.0, 0.5e6)


def test_nothing_metric_is_left_in_a_report(record, tmp_path):
    rs.write_report(record, tmp_path / "metric.html")
    rs.write_report(record, tmp_path / "imperial.html", units="imperial")
    pages = [(tmp_path / f"{name}.html").read_text(encoding="utf-8") for name in ("metric", "imperial")]
    texts = [re.sub(r"<[^>]*>", " ", re.sub(r"<(script|style|pre)\b.*?</\1>", "", p, flags=re.DOTALL)) for p in pages]
    assert len(LEFT.findall(texts[0])) > 10 and not LEFT.findall(texts[1])
    for before, after in zip(*map(figures_of, pages), strict=True):
        assert not LEFT.findall(json.dumps(after.figure, ensure_ascii=False))
        assert len(after.figure["data"]) == len(before.figure["data"])
    assert in_units(pages[1], "imperial").count("mil") == pages[1].count("mil")


def test_units_that_are_not_known_are_refused(record, tmp_path):
    with pytest.raises(DataError, match=r"units: 'inches' is not known; known are metric, imperial"):
        rs.write_report(record, tmp_path / "a.html", units="inches")
    assert not list(tmp_path.iterdir())
