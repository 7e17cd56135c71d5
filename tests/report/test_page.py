"""Pages: one set of plain data for HTML and files, sections by name, titles of figures, hostile texts."""

import json
import pkgutil
import subprocess
import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import plotly.graph_objects as go
import pytest

import rotorsim.report as report
from identification import make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.experiments import EXPERIMENTS
from rotorsim.report.figure_files import figures_of, save_figures
from rotorsim.report.page import RESULT_PAGES, Block, Page, figures, html, plain_page
from rotorsim.report.record import ADDED, POSSIBLE
from rotorsim.report.run import SECTIONS, record_section
from rotorsim.report.units import unit_system
from rotorsim.signals.record_blocks import MissingError

EVIL = "</script></pre><img src=x onerror=alert(1)>"


def amplitude():
    return go.Figure(go.Scatter(x=[1.0, 2.0], y=np.array([25.4, 50.8]))).update_yaxes(title_text="a [µm]")


def test_a_figure_has_the_title_of_its_section_however_long_its_text(tmp_path):
    report.save_study_page("p", "", [Block("Sizes", "word " * 8000, figure=amplitude())], tmp_path / "page.html")
    assert [path.name for path in save_figures(tmp_path / "page.html", "csv")] == ["page_sizes.csv"]


@pytest.mark.parametrize(("units", "first"), [("metric", 25.4), ("imperial", 1.0)])
def test_html_json_and_csv_hold_the_same_numbers(tmp_path, units, first):
    blocks = [Block("Sizes", heads=("a [µm]",), rows=[(25.4,)], figure=amplitude())]
    with unit_system(units):
        shown = plain_page(Page("p", "", blocks))
    assert json.loads(json.dumps(shown)) == shown
    report.save_study_page("p", "", blocks, tmp_path / "page.html", units, "csv")
    assert figures_of(tmp_path / "page.html") == figures(shown)
    assert shown["rows"][0][0]["rows"] == [[f"{first:g}"]]
    assert f"<td>{first:g}</td>" in (tmp_path / "page.html").read_text(encoding="utf-8")
    lines = (tmp_path / "page_sizes.csv").read_text(encoding="utf-8").splitlines()
    assert [float(line.split(",")[6]) for line in lines[1:]] == [first, 2 * first]


def test_no_text_of_a_page_is_markup():
    one = Block(EVIL, EVIL, (EVIL,), [(EVIL,)], amplitude().update_layout(title=EVIL), [(EVIL, "red")], (EVIL,), EVIL,
                (EVIL, EVIL), EVIL)  # fmt: skip
    page = html(Page(EVIL, EVIL, [one, replace(one, folded=True), (one, one)], [(EVIL, EVIL)], [EVIL], EVIL))
    assert "<img" not in page and page.count("&lt;img") > 40


def test_rows_side_by_side_and_folded_blocks_keep_their_order():
    blocks = [Block("a", "1"), (Block("b", "2"), Block("c", "3")), Block("d", code="4", folded=True)]
    page = html(Page("p", "", blocks))
    assert [page.index(f">{title}<") for title in "abcd"] == sorted(page.index(f">{title}<") for title in "abcd")
    assert page.count('<div class="row">') == 1 and page.count("<details") == 1


def test_every_section_that_an_experiment_names_is_registered():
    named = {name for kind in EXPERIMENTS.values() for name in kind.figures}
    assert len(EXPERIMENTS) > 5 and len(named) > 10
    assert named | set(POSSIBLE) | set(ADDED) == set(SECTIONS)


def test_a_section_is_registered_where_it_is_drawn():
    def nothing(run):
        raise MissingError("There is nothing.")

    @record_section("Nothing", nothing, lambda run, _: "")
    def nothing_at_all(run, data):
        """Figure of nothing."""
        return go.Figure()

    try:
        assert SECTIONS["nothing_at_all"].title == "Nothing" and nothing_at_all.__doc__ == "Figure of nothing."
        record = make_record(np.arange(0.0, 0.1, 1e-3), {"disc": np.zeros((100, 2))})
        with refused(DataError, "record", "Nothing"):
            nothing_at_all(record)
    finally:
        del SECTIONS["nothing_at_all"]


def test_results_with_a_page_of_their_own_are_registered():
    with pytest.raises(DataError, match="is not a Diagnosis"):
        report.write(EVIL, "page.html")
    kinds = {"campbell", "response", "map"}
    types = {"Dataset", "Diagnosis", "Verification", "SweepResult", "RunComparison", "Assessment"}
    types |= {"DesignReview", "RandomResult", "Optimisation", "dict"}
    assert set(RESULT_PAGES) == kinds | types
    assert {RESULT_PAGES[name][0].__name__ for name in kinds} == {"Dataset"}
    assert {name: RESULT_PAGES[name][0].__name__ for name in types} == {name: name for name in types}


def test_the_page_of_a_diagnosis_loads_none_of_control_and_of_records():
    program = """import sys
from rotorsim.report.page import RESULT_PAGES
print(RESULT_PAGES["Diagnosis"][0].__name__, len(RESULT_PAGES))
print(*sys.modules)"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    shown, loaded = ran.splitlines()
    assert shown == "Diagnosis 13" and "rotorsim.report.diagnosis" in loaded.split()
    assert not any(name in loaded for name in ("rotorsim.verify", "control.law", "report.record", "report.orders"))


def test_no_module_hides_a_public_name():
    """An import of a chapter sets its name in the package, which must not be that of a public function."""
    chapters = [one.name for one in pkgutil.iter_modules(report.__path__)]
    assert len(chapters) > 15 and not set(chapters) & set(report.__all__)
    assert not any(isinstance(getattr(report, name), ModuleType) for name in report.__all__)
