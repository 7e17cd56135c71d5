"""Page in an exported unit: equations are drawn and fit a narrow window."""

import ast
import re
import shutil
from pathlib import Path

import pytest

import rotorsim as rs
from fmu.contents import block, law_page, linear_page, page, prose
from fmu.linear_units import LawUnit, LinearUnit
from fmu.model import PlantUnit
from rotorsim import effects
from rotorsim.control import design
from waiting import window

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
MODEL = Path(__file__).parents[1] / "control" / "rig_model.json"
EFFECTS = sorted(Path(effects.__file__).parent.rglob("*.py"))
WIDER = """() => [document.documentElement.scrollWidth, [...document.querySelectorAll('.math > div')].filter(
  one => one.scrollWidth > one.clientWidth + 1).map(one => one.textContent)]"""


@pytest.fixture(scope="module")
def pages():
    model = rs.load_model(MODEL)
    law = design("lqr", model.at(314.0, 0.5e6))
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4)
    return {"plant": page(PlantUnit(plant, 0.0, 0.5e6)), "law": law_page(LawUnit(law)),
            "linear": linear_page(LinearUnit(model, "rig", 314.0, 0.5e6))}  # fmt: skip


def test_an_equation_is_split_at_its_wide_spaces_outside_brackets():
    assert block(r"a = 1, \quad b = 2").count("<math") == 2
    assert block(r"a = \begin{cases} 1 & \quad b \\ 2 & c \end{cases}").count("<math") == 1
    assert block(r"a &= 1 \\ b &= 2").count("<div>") == 2
    assert block(r"a = \frac{1 \quad 2}{3}").count("<math") == 1


def test_symbols_in_a_sentence_are_drawn_and_the_rest_is_escaped():
    text = prose(r"An angle \varphi & more <b>." + "\n\n.. math:: x = 1\n\nEnd.")
    assert text.count("<math") == 2 and "&amp; more &lt;b&gt;." in text and text.endswith("<p>End.</p>")


@pytest.mark.parametrize("path", EFFECTS, ids=lambda path: path.stem)
def test_the_docstring_of_every_effect_becomes_a_page_without_latex(path):
    text = prose(ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "")
    assert not re.search(r"\\[a-zA-Z]{2,}|\.\. math", re.sub(r"<annotation.*?</annotation>", "", text))


@pytest.mark.parametrize(("kind", "least"), [("plant", 20), ("law", 3), ("linear", 3)])
def test_equations_of_a_unit_are_drawn(pages, kind, least):
    assert pages[kind].count("<math") >= least and "<pre>" not in pages[kind] and "$" not in pages[kind]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here; install Debian's package chromium")
@pytest.mark.parametrize("kind", ["plant", "law", "linear"])
def test_page_and_equations_fit_a_window_of_700_px(pages, kind, tmp_path):
    playwright = pytest.importorskip("playwright.sync_api")
    (tmp_path / "page.html").write_text(pages[kind], encoding="utf-8")
    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        opened = window(browser, viewport={"width": 700, "height": 900})
        opened.goto((tmp_path / "page.html").as_uri())
        assert opened.evaluate(WIDER) == [700, []]
        browser.close()
