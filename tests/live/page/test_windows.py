"""Several windows on one live rig: shared settings, records, scenes, tour."""

import json

import pytest

from live_browser import CONTRAST, IN_BROWSER, PATIENCE, expect, fill, frame, until
from waiting import window

pytestmark = IN_BROWSER


def test_two_windows_see_the_same_machine(page, browser, address):
    other = window(browser)
    other.goto(address)
    other.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    fill(page, "reference_y", "2.5")
    other.wait_for_function("window.rotorsimFrame.trace.reference_y.at(-1) === 2.5", timeout=PATIENCE * 1e3)
    field = other.get_by_label("reference_y value", exact=True)
    expect(field).to_have_value("2.5", timeout=PATIENCE * 1e3)
    fill(other, "reference_y", "0")
    until(page, lambda s: s["reference_y"] == 0.0)
    other.context.close()


def test_a_page_that_is_not_seen_asks_for_nothing_and_the_plant_runs_on(page):
    """One that was on its way still comes, and no other however long the plant runs."""
    page.evaluate("window.requestAnimationFrame = () => 0")
    asked = page.evaluate("window.rotorsimFrames")
    then = page.evaluate("fetch('frame').then(r => r.json())")["time"]
    until(
        page, lambda now: now["time"] > then + 1, asked=lambda page: page.evaluate("fetch('frame').then(r => r.json())")
    )
    assert page.evaluate("window.rotorsimFrames") <= asked + 1


def test_a_record_is_written_and_replayed(page, folder):
    page.get_by_label("record", exact=True).click()
    page.wait_for_function("window.rotorsimFrame.status.recording > 0.5", timeout=PATIENCE * 1e3)
    page.get_by_label("record", exact=True).click()
    page.wait_for_function("window.rotorsimFrame.status.recording === null", timeout=PATIENCE * 1e3)
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="record-1").click(timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.status.replay !== null", timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.time >= 0.5", timeout=PATIENCE * 1e3)
    page.get_by_role("button", name="Back to the plant").click()
    page.wait_for_function("window.rotorsimFrame.status.replay === null", timeout=PATIENCE * 1e3)
    assert (folder / "record-1.nc").exists()


def test_a_scene_is_saved_and_loaded(page, folder):
    fill(page, "impulse", "33")
    until(page, lambda s: s["impulse"] == pytest.approx(0.033))
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="Save scene").click()
    page.get_by_role("button", name="scene", exact=True).wait_for(timeout=PATIENCE * 1e3)
    assert json.loads((folder / "scene.scene.json").read_text())["values"]["impulse"] == pytest.approx(0.033)
    page.get_by_role("tab", name="Operate").click()
    fill(page, "impulse", "10")
    until(page, lambda s: s["impulse"] == pytest.approx(0.01))
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="scene", exact=True).click()
    until(page, lambda s: s["impulse"] == pytest.approx(0.033))


def test_every_scene_of_the_tour_opens(page):
    page.get_by_role("tab", name="Tour").click()
    for title in ("Lift-off", "Critical speed", "Cross-coupling", "Whirl onset", "Controller on"):
        page.get_by_role("button", name=title).click()
        frames = page.evaluate("window.rotorsimFrames")
        page.wait_for_function(f"window.rotorsimFrames > {frames} + 10")
        stopped = frame(page)["status"]["stopped"]  # whirl grows as long as nobody acts: in time no step has a solution
        assert stopped == "" or (title == "Whirl onset" and stopped.startswith("plant: no solution of the step"))
    until(page, lambda s: s["controller"] == "hinf")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_has_a_contrast_of_four_and_a_half(page, scheme):
    page.emulate_media(color_scheme=scheme)
    page.reload()
    page.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    page.wait_for_function(f"document.body.classList.contains('body--dark') === {str(scheme == 'dark').lower()}")
    found = page.evaluate(CONTRAST)
    assert len(found) > 20
    assert [one for one in found if one[0] < 4.5] == []
