"""The desk in a real browser: its numbers against Python's, what is typed, undone, refused, saved and dragged."""

import json
import os
import re
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

import counted_desk
from live_browser import CONTRAST, IN_BROWSER, expect, until
from random_edits import edits
from rotorsim.desk import Design
from rotorsim.desk.panels import FIRST, PANELS, SLOW, DesignCase, answer
from rotorsim.machine import Machine, load_machine, machine_text, shipped_machines

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


def settled(page, panels="[data-panel]:not([data-slow])"):
    """Wait until every panel shows the design as it is; `wait_for_function` would take a promise itself for true."""
    shown = (
        "(panels) => fetch('desk?known=-1').then((r) => r.json()).then((s) => [...document.querySelectorAll(panels)]"
        ".every((one) => Number(one.dataset.revision) === s.revision))"
    )
    until(page, bool, asked=lambda page: page.evaluate(shown, panels))


def edits_of(page):
    """Number of edits that can be undone."""
    return page.evaluate("fetch('desk').then((r) => r.json()).then((s) => s.undo)")


def shapes(page):
    return page.evaluate(
        "[...document.querySelectorAll('[data-shape]')].map((one) => one.getAttribute('points') || "
        "one.getAttribute('transform'))"
    )


def leaves_of(found, path=""):
    """Numbers and texts of nested data, by their place."""
    pairs = found.items() if isinstance(found, dict) else enumerate(found) if isinstance(found, list) else None
    if pairs is None:
        return {path: found}
    return {place: leaf for key, value in pairs for place, leaf in leaves_of(value, f"{path}.{key}").items()}


def by_script(page, group):
    """The panels of a group by the results of the script that the page shows."""
    page.get_by_role("button", name="as Python").click()
    lines = page.locator("[data-script]").text_content().splitlines()
    others = tuple(f"{name} = " for names in RESULTS.values() if names != RESULTS[group] for name in names)
    space = {}
    exec("\n".join(line for line in lines if not line.startswith(others)), space)
    case = DesignCase(load_machine(page.file))
    case.__dict__.update({name: space[name] for name in RESULTS[group] if name in space})
    return {name: json.loads(json.dumps(answer(case, name))) for name in PANELS if (name in SLOW) == (group == "slow")}


RESULTS = {"quick": ("campbell", "response", "modes", "static", "review"), "slow": ("slopes", "scatter", "clearances")}
"""Results of the script from which the panels of a group are made."""
AT_ONCE = [name for name in shipped_machines() if not load_machine(name).films]


@pytest.mark.parametrize(
    ("group", "name"),
    [pytest.param(group, name, marks=() if group == "quick" and name in AT_ONCE else pytest.mark.nightly)
     for group in RESULTS for name in shipped_machines()],
)  # fmt: skip
def test_every_figure_on_the_page_is_that_of_the_script_that_it_shows(desk_of, group, name, monkeypatch, capsys):
    """Curves, tables and sentences of an edited machine, each figure as it is printed; the sum is printed."""
    page = desk_of(name, ready=False, hidden=[one for one in PANELS if (one in SLOW) != (group == "slow")])
    path = "discs.0.mass" if load_machine(name).discs else "shaft.sections.0.outer_diameter"
    field(page, path).press("ArrowUp")
    until(page, lambda edits: edits == 1, asked=edits_of)
    field(page, path).blur()
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("[data-saved]")).to_have_text("saved")
    settled(page, "[data-panel]")
    expect(page.locator(".desk-waiting")).to_have_count(0)
    shown = json.loads(page.evaluate("JSON.stringify(getElement(document.querySelector('.desk')).answers)"))
    monkeypatch.chdir(page.file.parent)
    expected = by_script(page, group)
    shown = {panel: shown[panel] for panel in expected}  # a hidden one may have been answered before it was hidden
    for panel, one in shown.items():
        assert table(page, panel) == one.get("rows", [])
        notes = page.locator(f"[data-panel='{panel}'] .desk-note").all_text_contents()
        assert notes == one["notes"]
    here, there = leaves_of(shown), leaves_of(expected)
    figures = [place for place, leaf in there.items() if any(c.isdigit() for c in str(leaf))]
    unequal = [
        (place, here.get(place), there.get(place)) for place in here | there if here.get(place) != there.get(place)
    ]
    with capsys.disabled():
        print(f"\n{name}, {group} panels: {len(figures)} figures, {len(unequal)} unequal")
    assert figures and not unequal


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


LATE = """(after) => {
  const own = window.fetch;
  window.fetch = async (path, ...rest) => {
    const answer = await own(path, ...rest);
    if (path === "desk" && rest.length) await new Promise((next) => setTimeout(next, after));
    return answer;
  };
}"""
"""Answers to acts come so many ms late."""


def test_what_is_typed_before_the_answer_to_an_earlier_keystroke_stays(desk_of):
    page = desk_of("plain_rotor")
    page.evaluate(LATE, 400)
    for text, wrong in (("4.25", "false"), ("3.9b", "true"), ("3.875", "false")):
        mass = field(page, "discs.0.mass")
        mass.fill("")
        mass.press_sequentially(text, delay=100)
        page.wait_for_timeout(1000)
        expect(mass).to_have_attribute("aria-invalid", wrong)
        expect(mass).to_have_value(text)
    settled(page)
    page.keyboard.press("Control+s")
    expect(page.locator("[data-saved]")).to_have_text("saved")
    assert load_machine(page.file).discs[0].mass == 3.875


def test_what_is_typed_last_is_kept_where_the_page_is_left_at_once(desk_of):
    page = desk_of("plain_rotor")
    page.evaluate(LATE, 10000)
    mass = field(page, "discs.0.mass")
    mass.fill("")
    mass.press_sequentially("4.25")
    field(page, "bearings.0.kxx").fill("20")
    page.keyboard.press("Control+z")
    field(page, "bearings.1.kxx").fill("30")
    page.goto("about:blank")
    kept = page.file.with_name("rotor.toml.edits")
    text = until(page, lambda text: '"30 MN/m"' in text, asked=lambda page: kept.read_text() if kept.exists() else "")
    assert '"4.25 kg"' in text and '"20 MN/m"' not in text


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


COARSE = machine_text("rigid_rotor_self_acting").replace("[gas]", "[grid]\nn_theta = 16\nn_z = 8\n\n[gas]", 1)


def dragged(page, part):
    """Drag a part for two seconds, forty moves."""
    box = page.locator(f"[data-shape='{part}']").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 3
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(40):
        page.mouse.move(x + 2 * k, y)
        page.wait_for_timeout(50)
    page.mouse.up()


@pytest.mark.parametrize(
    ("name", "text", "part"), [("pump_on_tables", None, "discs.0"), ("rigid_rotor_self_acting", COARSE, "bearings.0")]
)
def test_a_drag_of_two_seconds_never_queues_more_than_one_computation_a_panel(desk_of, name, text, part):
    """Each that begins is of the design asked for last, and none is begun next to another of its panel."""
    page = desk_of(name, text=text, hidden=SLOW, ready=False, program=(counted_desk.__file__,))
    field(page, f"{part}.position").wait_for()
    settled(page)
    page.lines.clear()
    moved = float(field(page, f"{part}.position").input_value())
    for count in (1, 2):
        dragged(page, part)
        until(page, lambda now, count=count: now == count, asked=edits_of)
        if text:
            until(page, lambda events: any(one[0] == "begin" and one[1] != "static" for one in events),
                  asked=lambda page: counted_desk.read(page.lines))  # fmt: skip
    settled(page)
    assert float(field(page, f"{part}.position").input_value()) > moved
    events = counted_desk.read(page.lines)
    wanted, computing = ["-"], {}
    for before, (event, panel, digest) in zip([None, *events], events, strict=False):
        if event == "wanted":
            wanted.append(digest)
        elif event == "begin":
            overtaken = before[0] == "wanted" and digest == wanted[-2]  # in the moment between look and begin
            assert digest == wanted[-1] or overtaken, events
            assert panel not in computing, events
            computing[panel] = digest
        else:
            assert computing.pop(panel) == digest
    assert not computing
    begun = {panel for event, panel, _ in events if event == "begin"}
    assert begun == set(PANELS) - set(SLOW) | (set(FIRST) if text else set())
    assert len({digest for event, _, digest in events if event == "wanted"}) > 10  # the drag did ask


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
