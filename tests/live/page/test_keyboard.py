"""Keyboard operation of the live page: sliders, shortcut keys, focus."""

import re

import pytest

from live_browser import IN_BROWSER, PATIENCE, UNIT, expect, fill, settings, until

pytestmark = IN_BROWSER


def test_sliders_move_by_the_keyboard_and_lose_no_step(page):
    fill(page, "pressure", "0.45")
    before = until(page, lambda s: s["pressure"] == pytest.approx(0.45e6))["pressure"]
    slider = page.get_by_label("pressure", exact=True)
    expect(slider).to_have_attribute("aria-valuenow", re.compile(r"0\.214"), timeout=PATIENCE * 1e3)
    slider.locator("[tabindex]").focus()
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    until(page, lambda s: s["pressure"] < before)
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    until(page, lambda s: s["pressure"] == before)


def test_a_slider_that_is_moved_step_by_step_stays_where_it_is_put(page):
    """Its first steps away from the neutral place change nothing that three digits show."""
    slider = page.get_by_label("acceleration", exact=True)
    fill(page, "acceleration", "500")
    until(page, lambda s: s["acceleration"] == pytest.approx(500 / UNIT["acceleration"]))
    expect(slider).to_have_attribute("aria-valuenow", "0", timeout=PATIENCE * 1e3)
    slider.locator("[tabindex]").focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
        frames = page.evaluate("window.rotorsimFrames")
        page.wait_for_function(f"window.rotorsimFrames > {frames} + 10")
    expect(slider).to_have_attribute("aria-valuenow", "0.003", timeout=PATIENCE * 1e3)


def test_keys_pause_and_hit(page):
    page.locator("body").click(position={"x": 700, "y": 5})
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "pause")
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "1x")
    page.evaluate("window.hits = 0; const look = () => { if (window.rotorsimFrame.now.force[0] !== 0) window.hits++;"
                  " requestAnimationFrame(look); }; look()")  # fmt: skip
    page.keyboard.press("x")
    page.wait_for_function("window.rotorsimFrame.status.reading.axis === 'x'", timeout=PATIENCE * 1e3)


def test_keys_work_while_a_button_has_the_focus_and_space_continues_at_the_pace_before(page):
    pace = page.get_by_label("simulation speed", exact=True)
    pace.get_by_role("button", name="0.1x", exact=True).click()
    until(page, lambda s: s["pace"] == "0.1x")
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "pause")
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "0.1x")
    pace.get_by_role("button", name="1x", exact=True).click()
    until(page, lambda s: s["pace"] == "1x")
    page.get_by_label("reset to equilibrium").click()
    page.wait_for_function("window.rotorsimFrame.status.reading.why !== 'x: ringing'", timeout=PATIENCE * 1e3)
    page.get_by_label("hit y", exact=True).focus()
    page.keyboard.press("x")
    page.wait_for_function("window.rotorsimFrame.status.reading.why === 'x: ringing'", timeout=PATIENCE * 1e3)
    page.keyboard.press("r")
    page.wait_for_function("window.rotorsimFrame.status.reading.why !== 'x: ringing'", timeout=PATIENCE * 1e3)
    page.keyboard.press(" ")  # a button that the keyboard reached is pressed
    page.wait_for_function("window.rotorsimFrame.status.reading.why === 'y: ringing'", timeout=PATIENCE * 1e3)
    page.keyboard.press("Control+y")
    assert settings(page)["pace"] == "1x"
