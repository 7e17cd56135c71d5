"""Pages in Chromium at two widths: nothing wider than the window, toolbars above the figures."""

import shutil

import numpy as np
import plotly.graph_objects as go
import pytest

from rotorsim.report.page import Block, save_study_page, style
from small_diagnosis import blocked, small_diagnosis
from waiting import window as window_of

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here; install Debian's package chromium")]
ABOVE = """() => [...document.querySelectorAll('.plotly-graph-div')].map(plot => {
  const box = one => one.getBoundingClientRect(), bar = box(plot.querySelector('.modebar'));
  const text = box(plot.closest('section').querySelector('p'));
  return bar.height > 0 && text.bottom <= bar.top && bar.bottom <= box(plot.querySelector('.main-svg')).top;
})"""
"""Whether the toolbar has a strip of its own between the text and the figure."""
COVERED = """() => { const legend = document.querySelector('.legend').getBoundingClientRect();
  return [...document.querySelectorAll('.annotation')].filter(
    one => one.getBoundingClientRect().top < legend.bottom).length; }"""
"""Number of the columns' titles that the legend covers."""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page with a figure of two titled columns and a legend of several lines."""
    from plotly.subplots import make_subplots

    figure = make_subplots(1, 2, subplot_titles=["stiffness", "damping"])
    for k in range(12):
        trace = go.Scatter(x=np.arange(3), y=k * np.arange(3), name=f"a curve with a name, {k}")
        figure.add_trace(trace, 1, 1 + k % 2)
    path = tmp_path_factory.mktemp("page") / "page.html"
    save_study_page("page", "", [Block("A figure", "A sentence above it.", figure=style(figure, 500))], path)
    return path


@pytest.mark.parametrize(("width", "stacked"), [(400, True), (1300, False)])
def test_panels_stand_below_each_other_on_a_narrow_screen(browser, page, width, stacked):
    window = window_of(browser, viewport={"width": width, "height": 900})
    window.goto(page.as_uri())
    window.wait_for_selector(".modebar", state="attached")
    domains = "['', '2'].map(n => ['x', 'y'].map(letter => PLOTS[0]._fullLayout[`${letter}axis${n}`].domain))"
    panels = window.evaluate(domains)
    (x1, y1), (x2, y2) = panels
    assert (x1 == x2 == [0, 1] and y1[0] > y2[1]) is stacked and (x1[1] < x2[0] and y1 == y2) is not stacked
    titles = window.evaluate("() => [...document.querySelectorAll('.annotation')].map(one => "
                             "[one.getBoundingClientRect().top, one.getBoundingClientRect().left])")  # fmt: skip
    assert (titles[1][0] > titles[0][0] + 100) is stacked and (titles[1][1] > titles[0][1] + 100) is not stacked
    assert window.evaluate("document.documentElement.scrollWidth") == width and window.evaluate(COVERED) == 0


@pytest.mark.parametrize("width", [700, 1300])
def test_toolbars_cover_neither_legends_nor_titles(browser, page, width):
    window = window_of(browser, viewport={"width": width, "height": 900})
    window.goto(page.as_uri())
    window.wait_for_selector(".modebar", state="attached")
    assert window.evaluate("document.documentElement.scrollWidth") == width
    assert window.evaluate(ABOVE) == [True]
    assert window.evaluate(COVERED) == 0
    window.close()


FIGURE = """() => { const one = document.querySelector('.main-svg').getBoundingClientRect();
  return [one.width, one.height]; }"""


def test_figures_have_the_width_of_a_sheet_while_they_are_printed(browser, page):
    """A4 less 12 mm on each side is 703 px wide; afterwards the figure fills the window again."""
    window = window_of(browser, viewport={"width": 1300, "height": 900})
    window.goto(page.as_uri())
    before = window.evaluate(FIGURE)
    window.emulate_media(media="print")
    window.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert window.evaluate(FIGURE)[0] <= 703 and window.evaluate(FIGURE)[1] < before[1]
    assert not window.locator(".modebar-container").first.is_visible()
    window.emulate_media(media="screen")
    window.evaluate("dispatchEvent(new Event('afterprint'))")
    assert window.evaluate(FIGURE) == before
    assert window.pdf(format="A4").startswith(b"%PDF")
    window.close()


@pytest.mark.parametrize(("scheme", "dark"), [("light", False), ("dark", True)])
def test_page_and_figures_follow_the_colour_scheme_and_paper_stays_white(browser, page, scheme, dark):
    window = window_of(browser, color_scheme=scheme)
    window.goto(page.as_uri())
    look = "() => [getComputedStyle(document.querySelector('section')).backgroundColor, "
    look += "getComputedStyle(document.querySelector('.figure')).filter != 'none']"
    assert window.evaluate(look) == ["rgb(26, 26, 26)" if dark else "rgb(255, 255, 255)", dark]
    window.emulate_media(media="print", color_scheme=scheme)
    assert window.evaluate(look) == ["rgb(255, 255, 255)", False]
    window.close()


@pytest.fixture(scope="module")
def diagnosis_page(tmp_path_factory):
    """The page of a diagnosis."""
    return small_diagnosis("dtu_gas_bearing", effects=[blocked()]).report(tmp_path_factory.mktemp("d") / "page.html")


BELOW = """() => [...document.querySelectorAll('.key + .row > section')].map(
  one => [one.getBoundingClientRect().bottom, one.scrollWidth - one.clientWidth])"""
"""Lower edge of every part of the first screen, and by how much its content is wider than it."""


@pytest.mark.parametrize("width", [400, 800, 1280])
def test_the_first_screen_of_a_diagnosis_is_not_wider_than_the_window_and_fits_a_large_one(
    browser, diagnosis_page, width
):
    window = window_of(browser, viewport={"width": width, "height": 900})
    window.goto(diagnosis_page.as_uri())
    window.wait_for_selector(".key + .row section:last-child .main-svg", state="attached")
    assert window.evaluate("document.documentElement.scrollWidth") == width
    edges = window.evaluate(BELOW)
    assert len(edges) == 4 and all(more <= 0 for _, more in edges)
    assert width < 1280 or max(bottom for bottom, _ in edges) <= 900
    window.close()
