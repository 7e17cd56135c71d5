"""The desk in a real browser: its numbers against Python's, what is typed, undone, refused, saved and dragged."""

import json
import os
import re
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

from live_browser import IN_BROWSER, expect, until
from random_edits import edits
from rotorsim.desk import Design
from rotorsim.machine import Machine, machine_text
from rotorsim.report.design import answered
from rotorsim.report.linear import criticals, peaks
from rotorsim.report.page import cells

pytestmark = IN_BROWSER
READY = "window.deskTimes?.some((one) => one.all)"


def table(page, name, of="table"):
    return page.evaluate(
        "([name, of]) => [...document.querySelectorAll(`[data-${of}='${name}'] tbody tr`)].map("
        "(row) => [...row.cells].map((cell) => cell.textContent))",
        [name, of],
    )


def field(page, path):
    return page.locator(f"input[data-path='{path}']")


def settled(page):
    """Wait until every panel shows the design as it is; `wait_for_function` would take a promise itself for true."""
    panels = (
        "fetch('desk?known=-1').then((r) => r.json()).then((s) => [...document.querySelectorAll("
        "'[data-panel]:not([data-slow])')].every((one) => Number(one.dataset.revision) === s.revision))"
    )
    until(page, bool, asked=lambda page: page.evaluate(panels))


def edits_of(page):
    """Number of edits that can be undone."""
    return page.evaluate("fetch('desk').then((r) => r.json()).then((s) => s.undo)")


def shapes(page):
    return page.evaluate(
        "[...document.querySelectorAll('[data-shape]')].map((one) => one.getAttribute('points') || "
        "one.getAttribute('transform'))"
    )


@pytest.mark.parametrize("name", ["plain_rotor", "pump_on_tables"])
def test_every_table_on_the_page_has_the_numbers_of_the_script_that_it_shows(desk_of, name, monkeypatch):
    page = desk_of(name)
    field(page, "discs.0.mass").fill("35")
    field(page, "discs.0.mass").blur()
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("[data-saved]")).to_have_text("saved")
    settled(page)
    page.get_by_role("button", name="as Python").click()
    monkeypatch.chdir(page.file.parent)
    space = {}
    exec(page.locator("[data-script]").text_content(), space)
    assert table(page, "campbell") == [cells(row) for row in criticals(space["campbell"])] != []
    assert table(page, "response") == [cells(row) for row in peaks(space["response"])] != []
    modes = zip(space["modes"]["wn"].values / (2 * np.pi), space["modes"]["zeta"].values, strict=True)
    shown = [row[1:3] for row in table(page, "modes")]
    assert shown == [cells((float(f), float(z))) for f, z in modes][: len(shown)] != []
    loads = [cells((float(load),))[0] for load in space["static"]["load"].values]
    assert [row[1] for row in table(page, "static")] == loads
    checks = {(c.name, cells((answered(c),))[0], c.verdict) for c in space["review"].checks}
    found = {(row[0], row[2], row[4][2:]) for row in table(page, "limits")}
    assert found == checks


def test_a_value_is_answered_while_it_is_typed_and_a_refused_one_keeps_the_last_design(desk_of):
    page = desk_of("plain_rotor")
    before, drawn = table(page, "campbell"), shapes(page)
    mass = field(page, "discs.0.mass")
    mass.fill("")
    mass.press_sequentially("8")
    page.wait_for_function("window.deskTimes.at(-1).revision > 1 && window.deskTimes.at(-1).all")
    settled(page)
    assert table(page, "campbell") != before
    after = table(page, "campbell"), shapes(page)
    assert after[1] != drawn
    mass.press_sequentially("x")
    sentence = page.locator("[data-part='discs.0'] .desk-sentence")
    expect(sentence).to_contain_text("8x")
    expect(mass).to_have_attribute("aria-invalid", "true")
    assert (table(page, "campbell"), shapes(page)) == after
    assert json.loads(json.dumps(page.evaluate("fetch('desk').then((r) => r.json())")))["problems"] == []
    mass.press("Backspace")
    expect(sentence).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(mass).to_have_value("3.946")
    settled(page)
    assert table(page, "campbell") == before and shapes(page) == drawn


def test_two_hundred_random_edits_are_undone_on_the_page_to_the_byte(desk_of):
    page = desk_of("plain_rotor")
    text = page.file.read_bytes()
    mirror = Design(text.decode(), page.file.with_name("mirror.toml"), text.decode())
    for act, values in edits(np.random.default_rng(7), mirror, 200):
        answer = page.evaluate(
            "(content) => fetch('desk', { method: 'POST', body: JSON.stringify(content) }).then((r) => r.json())",
            {"act": act, **values},
        )
        try:
            getattr(mirror, act)(*values.values())
        except Exception as error:
            assert "refused" in answer, (act, values, error)
        else:
            assert "refused" not in answer, (act, values, answer["refused"])
    page.evaluate(
        "(async () => { for (;;) { const s = await fetch('desk').then((r) => r.json()); if (s.undo < 2) return;"
        " await fetch('desk', { method: 'POST', body: JSON.stringify({ act: 'undo' }) }); } })()"
    )
    page.reload()
    undo = page.get_by_role("button", name="Undo")
    undo.click()
    expect(undo).to_be_disabled()
    expect(page.locator("[data-saved]")).to_have_text("saved")
    assert page.file.read_bytes() == text and not page.file.with_name("rotor.toml.edits").exists()


def test_a_file_that_changes_meanwhile_is_asked_about_and_never_replaced_unasked(desk_of):
    page = desk_of("plain_rotor")
    field(page, "discs.0.mass").fill("5")
    theirs = machine_text("plain_rotor").replace("3.946 kg", "3 kg").encode()
    page.file.write_bytes(theirs)
    page.keyboard.press("Control+s")
    banner = page.locator("[data-conflict]")
    expect(banner).to_be_visible()
    assert page.file.read_bytes() == theirs
    banner.get_by_role("button", name="Take the file over").click()
    expect(field(page, "discs.0.mass")).to_have_value("3")
    expect(banner).to_have_count(0)


def test_a_browser_that_is_closed_loses_no_edit_and_two_windows_show_one_design(desk_of):
    page = desk_of("plain_rotor")
    field(page, "discs.0.mass").fill("5")
    until(page, lambda edits: edits == 1, asked=edits_of)
    other = page.context.new_page()
    other.goto(page.address)
    expect(other.locator("input[data-path='discs.0.mass']")).to_have_value("5")
    other.locator("input[data-path='bearings.0.kxx']").fill("20")
    expect(field(page, "bearings.0.kxx")).to_have_value("20")
    assert Machine.from_text(page.file.with_name("rotor.toml.edits").read_text()).bearings[0].kxx == 20e6


def test_a_drag_moves_the_disc_and_asks_for_no_more_answers_than_it_moves(desk_of):
    page = desk_of("plain_rotor")
    page.evaluate("window.deskTimes.length = 0")
    box = page.locator("polygon[data-shape='discs.0']").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + 20
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(40):
        page.mouse.move(x + 4 * k, y)
    page.mouse.up()
    settled(page)
    assert float(field(page, "discs.0.position").input_value()) > 350
    times = page.evaluate("window.deskTimes")
    for name in {one["panel"] for one in times}:
        assert len([one for one in times if one["panel"] == name]) <= 40
    assert edits_of(page) == 1


def test_the_page_begins_empty_and_a_start_is_saved_as_a_machine(desk_of):
    page = desk_of()
    page.get_by_role("button", name="Overhung wheel").click()
    expect(page.locator("[data-file]")).to_contain_text("my_overhung_wheel.toml")
    page.keyboard.press("Control+s")
    expect(page.locator("[data-saved]")).to_have_text("saved")
    saved = Machine.from_text((page.file.parent / "my_overhung_wheel.toml").read_text())
    assert saved.discs[0].position > saved.bearings[1].position


def test_design_a_and_the_design_exchange_their_answers_and_a_is_there_after_a_reload(desk_of):
    page = desk_of("plain_rotor")
    begun = table(page, "campbell")
    page.get_by_role("button", name="Keep as A").click()
    field(page, "discs.0.mass").fill("8")
    field(page, "discs.0.mass").blur()
    until(page, lambda edits: edits == 1, asked=edits_of)
    settled(page)
    changed = table(page, "campbell")
    assert changed != begun == table(page, "campbell", "kept")
    for press, now, then in (("Swap A and B", begun, changed), ("Undo", changed, begun), ("Redo", begun, changed)):
        edits = edits_of(page)
        page.get_by_role("button", name=press).click()
        until(page, lambda now, before=edits: now != before, asked=edits_of)
        settled(page)
        assert (table(page, "campbell"), table(page, "campbell", "kept")) == (now, then)
    page.reload()
    page.wait_for_function("document.querySelector('[data-kept=campbell]')")
    assert table(page, "campbell", "kept") == changed
    page.get_by_role("button", name="Forget A").click()
    expect(page.get_by_role("button", name="Swap A and B")).to_have_count(0)
    expect(page.locator("[data-kept]")).to_have_count(0)


def test_parts_are_added_copied_and_deleted_by_the_keyboard_and_every_field_has_a_name(desk_of):
    page = desk_of("plain_rotor")
    page.get_by_role("button", name="add bearing").focus()
    page.keyboard.press("Enter")
    expect(page.locator("[data-part='bearings.2']")).to_be_visible()
    page.get_by_role("button", name="delete bearing 2 (linear)").press("Enter")
    expect(page.locator("[data-part='bearings.2']")).to_have_count(0)
    page.get_by_role("button", name="copy disc 0").press("Enter")
    expect(page.locator("[data-part='discs.1']")).to_be_visible()
    field(page, "discs.1.position").press("ArrowUp")
    expect(field(page, "discs.1.position")).to_have_value("331")
    nameless = page.evaluate(
        "[...document.querySelectorAll('.desk input, .desk select, .desk canvas, .desk button')].filter((one) => "
        "!(one.labels?.length || one.getAttribute('aria-label') || one.textContent.trim())).map((one) => one.outerHTML)"
    )
    assert nameless == []


def test_a_pinned_panel_stays_first_and_is_answered_first(desk_of):
    page = desk_of("plain_rotor")
    names = "[...document.querySelectorAll('[data-panel]')].map((one) => one.dataset.panel)"
    for first in ("static", "campbell"):
        page.get_by_role("button", name="pin Static deflection").click()
        page.reload()
        page.wait_for_function(READY)
        assert page.evaluate(names)[0] == page.evaluate("window.deskTimes[0].panel") == first


def test_panels_of_a_shaft_too_large_are_computed_when_they_are_asked_for(desk_of):
    page = desk_of("plain_rotor")
    page.locator("summary").filter(has_text=re.compile(r"^Shaft$")).click()
    page.locator("[data-part='shaft'] .desk-more").click()
    field(page, "shaft.max_element_length").fill("1")
    expect(page.locator("[data-large]")).to_have_count(page.locator("[data-panel]").count())
    expect(page.locator(".desk-waiting")).to_have_count(0)
    before = page.locator("[data-panel=static]").get_attribute("data-revision")
    page.get_by_role("button", name="compute Static deflection").click()
    expect(page.locator("[data-panel=static]")).not_to_have_attribute("data-revision", before)
    expect(page.locator("[data-panel=campbell]")).to_have_attribute("data-revision", before)
    assert page.locator("[data-large]").count() == page.locator("[data-panel]").count() - 1
    field(page, "shaft.max_element_length").fill("25")
    settled(page)
    expect(page.locator("[data-large]")).to_have_count(0)


CONTRAST = """() => {
  const parts = (text) => text.match(/[\\d.]+/g).map(Number);
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => [r, g, b].map((v) => linear(v / 255))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const found = parts(getComputedStyle(at).backgroundColor);
      if (found.length === 3 || found[3] > 0.99) return found;
    }
    return document.body.classList.contains("body--dark") ? [18, 18, 18] : [255, 255, 255];
  };
  const seen = [...document.querySelectorAll(".desk *")].filter((one) => one.checkVisibility() && !one.disabled &&
    !one.closest("svg") && [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()));
  return seen.map((one) => {
    const [a, b] = [light(parts(getComputedStyle(one).color)), light(behind(one))];
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), one.outerHTML.slice(0, 90)];
  });
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_has_a_contrast_of_four_and_a_half(desk_of, scheme):
    page = desk_of("plain_rotor", scheme)
    field(page, "discs.0.mass").fill("heavy")
    expect(page.locator("[data-part='discs.0'] .desk-sentence")).to_be_visible()
    found = page.evaluate(CONTRAST)
    assert len(found) > 50
    assert [one for one in found if one[0] < 4.5] == []


def test_a_stranger_is_refused_by_the_guard_of_the_live_page(desk_of):
    page = desk_of("plain_rotor", ready=False)
    place = page.address.split("?")[0]
    for headers in ({}, {"Host": "evil.example"}, {"Cookie": "rotorsim_8760=wrong"}, {"Origin": "http://evil.example"}):
        for path in ("", "desk", "report"):
            with pytest.raises(HTTPError) as error:
                urlopen(Request(place + path, headers=headers))
            assert error.value.code == 403
    assert page.evaluate("fetch('desk', { method: 'POST', body: '{' }).then((r) => r.status)") == 200
    assert page.evaluate("fetch('desk', { method: 'POST', body: 'x'.repeat(70000) }).then((r) => r.status)") == 413
    assert page.evaluate("fetch('nothing').then((r) => r.status)") == 404


KEYSTROKES = {"plain_rotor": ("10 mm", "discs.0.mass"), "pump_on_tables": ("25 mm", "discs.0.mass"),
              "rigid_rotor_self_acting": ("", "bearings.0.clearance")}  # fmt: skip
"""Longest element for a shaft of 60, none for that of the machine, and the number that changes, by machine."""


@pytest.mark.parametrize("name", KEYSTROKES)
def test_from_a_keystroke_to_all_panels_redrawn_is_measured(desk_of, capsys, name):
    """Prints the times; no test decides by them."""
    page, (longest, path) = desk_of(name), KEYSTROKES[name]
    last, taken = "window.deskTimes.filter((one) => one.all).at(-1)", []
    if longest:
        page.locator("details:has([data-part='shaft'])").evaluate("one => { one.open = true }")
        if not field(page, "shaft.max_element_length").count():
            page.locator("[data-part='shaft'] .desk-more").click()
        field(page, "shaft.max_element_length").fill(longest)
        page.wait_for_function(f"{last}.revision > 0 && {last}.typed")
    for _ in range(int(os.environ.get("ROTORSIM_KEYSTROKES", "8"))):
        before = page.evaluate(f"{last}.revision")
        field(page, path).press("ArrowUp")  # a design that was not answered before
        page.wait_for_function(f"{last}.revision > {before}")
        one = page.evaluate(last)
        each = page.evaluate("(n) => window.deskTimes.filter((one) => one.revision === n)", one["revision"])
        words = {True: " in part", None: ""}
        taken.append({one["panel"] + words[one.get("first")]: one["drawn"] - one["typed"] for one in each})
    with capsys.disabled():
        print(f"\n{name}", end="")
        for panel in taken[-1]:
            print(f"\n{panel}: {np.median([one[panel] for one in taken if panel in one]):.0f} ms", end="")
    assert all(one == taken[-1].keys() for one in map(dict.keys, taken))
    assert bool(Machine.from_text(machine_text(name)).films) == ("response in part" in taken[-1])
