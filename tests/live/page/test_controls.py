"""Controls of the live page: each is operated in a browser and its effect on the plant checked."""

import pytest

from live_browser import IN_BROWSER, PATIENCE, UNIT, expect, fill, settings, until

pytestmark = IN_BROWSER


def test_operating_controls_turn_the_plant(page):
    for key, shown, value in (
        ("acceleration", "900", 900 / UNIT["acceleration"]),
        ("torque", "1.5", 1.5),
        ("impulse", "12", 0.012),
        ("pressure", "0.45", 0.45e6),
        ("reference_x", "-1.25", -1.25),
        ("reference_y", "0.5", 0.5),
        ("speed", "600", 600 / UNIT["speed"]),
    ):
        fill(page, key, shown)
        until(page, lambda s, key=key, value=value: abs(s[key] - value) <= 1e-9 * abs(value))
    page.wait_for_function("window.rotorsimFrame.now.speed > 590", timeout=PATIENCE * 1e3)
    page.wait_for_function("Math.abs(window.rotorsimFrame.now.pressure - 0.45) < 0.02", timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.trace.reference_x.at(-1) === -1.25", timeout=PATIENCE * 1e3)


def test_switches_turn_the_plant(page):
    fill(page, "reference_x", "0")  # a controller has no room next to a constant reference: it would be refused
    fill(page, "reference_y", "0")
    for label, key, positions in (
        ("drive", "drive", ("torque", "coast", "speed")),
        ("sense", "sense", ("backward", "forward")),
        ("noise", "noise", ("off", "on")),
        ("controller", "controller", ("hinf", "off")),
        ("simulation speed", "pace", ("0.1x", "fastest", "1x")),
    ):
        for position in positions:
            button = page.get_by_label(label, exact=True).get_by_role("button", name=position, exact=True)
            button.click()
            found = until(page, lambda s, key=key, position=position: s[key] == position)
            if key == "noise":
                assert (found["noise.sigma"] == 0.0) is (position == "off")
            expect(button).to_have_attribute("aria-pressed", "true", timeout=PATIENCE * 1e3)


def test_every_effect_of_the_catalogue_is_turned_by_its_field(page):
    page.get_by_label("simulation speed", exact=True).get_by_role("button", name="pause", exact=True).click()
    page.get_by_role("tab", name="Effects").click()
    before = settings(page)
    keys = [key for key in before if "." in key]
    assert len(keys) > 80
    for key in keys:
        field = page.get_by_label(f"{key} value", exact=True)
        if not field.is_visible():
            page.locator(".q-expansion-item").filter(has=field).locator(".q-item--clickable").click()
            field.wait_for(timeout=PATIENCE * 1e3)
        if key == "ball_bearing.thrust":  # that alone would have nothing to compare with
            fill(page, "ball_bearing.rated_thrust", "100")
            until(page, lambda s: s["ball_bearing.rated_thrust"] == 100.0)
        shown = float(field.input_value())
        whole = key.endswith(("injector", "order", "_lobes", "counts", "window", "surface", "sequence"))
        fill(page, key, f"{shown + 1 if whole else shown * 0.9 or 0.01:.6g}")
        until(page, lambda s, key=key: s[key] != before[key])
        fill(page, key, f"{shown:g}")
    page.get_by_role("button", name="Back to the machine file").click()
    until(page, lambda s: all(s[key] == before[key] for key in keys))
    page.get_by_label("simulation speed", exact=True).get_by_role("button", name="1x", exact=True).click()
    until(page, lambda s: s["pace"] == "1x")


def test_values_beyond_limits_are_clamped_with_a_message(page):
    fill(page, "pressure", "7")
    until(page, lambda s: s["pressure"] == 1e6)
    page.get_by_text("is beyond 0 MPa to 1 MPa, set to 1 MPa").first.wait_for(timeout=PATIENCE * 1e3)
    fill(page, "pressure", "0.3")
    until(page, lambda s: s["pressure"] == pytest.approx(0.3e6))
