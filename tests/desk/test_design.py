"""Design: edits that keep every other byte, are refused with the sentence of the value, and are undone to the byte."""

import asyncio
import gc
import os
import signal
import subprocess
import sys
import tomllib
import warnings
from contextlib import contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import orjson
import psutil
import pytest
from starlette.requests import Request

from code_blocks import ROOT, blocks_of
from random_edits import edits
from rotorsim.base.errors import MachineFileError, NotCarried
from rotorsim.base.files import WriteError
from rotorsim.desk import Design, open_design, server
from rotorsim.desk.design import NEW, FileChangedError, RefusedError, unsaved_edits
from rotorsim.desk.panels import FIRST, PANELS, DeskPoint
from rotorsim.desk.parts import listed, problem_fields
from rotorsim.desk.server import DesignDesk, PanelStream, answer_of, application, make_desk
from rotorsim.desk.starts import STARTS, begin
from rotorsim.machine import Machine, bearing_points, from_ross, machine_text, shipped_machines
from rotorsim.machine.rotor_import import with_points
from waiting import PATIENCE, until


def test_a_bare_number_takes_the_unit_of_the_field_and_all_other_bytes_stay(design):
    before = design.text
    design.set("discs.0.position", "250")
    assert design.text == before.replace('position = "300 mm" ', 'position = "250 mm" ')
    design.set("discs.0.position", "10 in")
    assert design.machine.discs[0].position == pytest.approx(0.254)


def test_a_file_in_which_bore_and_diameter_give_no_mass_is_refused_in_a_sentence():
    text = machine_text("grooved_turbo_rotor")
    wrong = text.replace('outer_diameter = "12 mm"', 'outer_diameter = "12 mm"\ninner_diameter_right = "25 mm"', 1)
    assert wrong != text
    with pytest.raises(MachineFileError) as error:
        Machine.from_text(wrong)
    assert any("inner_diameter_right" in problem for problem in error.value.problems)


@pytest.mark.parametrize(
    ("path", "text"),
    [("discs.0.mass", "-1"), ("discs.0.mass", "heavy"), ("discs.0.mass", ""), ("discs.0.position", "900"),
     ("shaft.damping_ratio", "2"), ("grid.n_theta", "33"), ("bearings.0.kind", "magic"),
     ("shaft.sections.0.inner_diameter", "30")],
)  # fmt: skip
def test_a_value_that_does_not_fit_is_refused_by_its_path_and_the_design_stays(design, path, text):
    text_before, machine = design.text, design.machine
    with pytest.raises(RefusedError) as error:
        design.set(path, text)
    assert error.value.argument == path and error.value.value == text
    assert (design.text, design.machine, design.before) == (text_before, machine, [])


def test_an_empty_field_takes_an_optional_value_out_and_a_default_holds(design):
    design.set("bearings.0.cxx", "")
    assert "cxx" not in tomllib.loads(design.text)["bearings"][0] and design.machine.bearings[0].cxx == 0
    design.undo()
    assert design.text == design.disk


LONG = ("plain_rotor", "aerostatic_spindle")


@pytest.mark.parametrize("name", shipped_machines())
def test_random_edits_are_undone_to_the_byte_and_none_raises(tmp_path, name):
    desk = DesignDesk(None, tmp_path)
    assert desk.act("open", {"name": name}) == {"chosen": ""}
    design, taken = desk.design, 0
    begun = design.text
    for act, values in edits(np.random.default_rng(1), design, 200 if name in LONG else 30):
        before = design.text
        brought = desk.act(act, values)
        assert design.machine is not None and not design.problems
        assert "refused" not in brought or design.text == before
        taken += design.text != before
    assert taken > 5
    last = design.text
    steps = len(design.before)
    while design.before:
        design.undo()
    assert design.text == begun
    for _ in range(steps):
        design.redo()
    assert design.text == last


@pytest.mark.parametrize("name", shipped_machines())
@pytest.mark.parametrize("part", ["discs.0", "bearings.0", "bearings.1", "shaft.sections.0"])
def test_a_copied_part_that_is_deleted_leaves_no_byte(tmp_path, name, part):
    design = open_design(name, tmp_path)
    if part == "discs.0" and not design.machine.discs:
        with pytest.raises(RefusedError):
            design.copy(part)
        return
    before = design.text
    added = design.copy(part)
    design.delete(added)
    assert design.text.rstrip("\n") == before.rstrip("\n")
    assert design.text.count("#") == before.count("#")


@pytest.mark.parametrize("kind", list(NEW))
def test_every_kind_of_part_can_be_added_to_every_start(tmp_path, kind):
    for key in STARTS:
        design = begin(key, tmp_path)
        present = kind.startswith("effects.") and kind.removeprefix("effects.") in design.machine.effects
        if present:
            with pytest.raises(RefusedError):
                design.add(kind)
        else:
            assert design.add(kind).startswith(kind) and design.machine is not None


def test_edits_of_one_field_are_one_step_of_undo_and_those_of_two_are_two(design):
    for text in ("4", "42", "4.2"):
        design.set("discs.0.mass", text, "1")
    design.set("discs.0.mass", "5", "2")
    design.undo()
    assert design.machine.discs[0].mass == 4.2
    design.undo()
    assert design.text == design.disk


def test_of_two_desks_on_one_file_the_second_is_asked_and_its_edits_stay(design):
    other = open_design(design.path)
    design.set("discs.0.mass", "5")
    other.set("discs.0.mass", "6")
    design.save()
    with pytest.raises(FileChangedError) as error:
        other.save()
    assert error.value.value == str(design.path) and unsaved_edits(design) == other.text
    other.save(anyway=True)
    assert unsaved_edits(other) is None and not other.unsaved.exists() and design.changed_on_disk()


def test_edits_that_another_desk_takes_over_stay_until_both_have_saved_or_undone_them(design):
    a = make_desk(design.path, design.path.parent)
    kept = a.design.unsaved
    a.act("set", {"path": "discs.0.mass", "text": "5"})
    b = make_desk(design.path, design.path.parent)
    assert b.design.text == a.design.text
    b.act("undo", {})
    assert [one.state(one.design.revision)["saved"] for one in (a, b)] == [False, True]
    assert kept.read_text() == a.design.text
    b.act("set", {"path": "discs.0.mass", "text": "6"})
    assert kept.read_text() == b.design.text
    b.act("save", {})
    a.state()
    b.state()
    assert kept.read_text() == a.design.text != b.design.text
    a.act("undo", {})
    a.act("take", {})
    assert not kept.exists() and a.design.saved


def test_edits_that_the_file_holds_already_are_taken_away(design):
    design.unsaved.write_text(design.text)
    assert make_desk(design.path, design.path.parent).design.saved and not design.unsaved.exists()
    fresh = make_desk("bently_rk4", design.path.parent)
    assert not fresh.state()["saved"] and not fresh.design.unsaved.exists()
    design.set("discs.0.mass", "5")
    design.unsaved.write_text(design.disk)
    design.undo()
    assert not design.unsaved.exists()


def test_acts_that_come_together_are_carried_out_in_their_order(tmp_path):
    desk = make_desk("plain_rotor", tmp_path)
    (route,) = [one for one in application(desk, PanelStream()).routes
                if one.path == "/desk" and "POST" in one.methods]  # fmt: skip

    def send(content):
        async def receive():
            return {"type": "http.request", "body": orjson.dumps(content)}

        request = Request({"type": "http"}, receive)
        return orjson.loads(asyncio.run(route.endpoint(request)).body)

    acts = [{"act": "set", "path": "discs.0.mass", "text": text} for text in ("5", "6")]
    found = send({"acts": [*acts, {"act": "undo"}, {"act": "nothing"}, 7]})
    assert desk.design.machine.discs[0].mass == 5 and "refused" in found
    assert "refused" not in send({"acts": []}) and "refused" not in send({"acts": 7})


def test_edits_are_kept_next_to_the_file_until_they_are_saved_or_undone(design):
    design.set("discs.0.mass", "5")
    assert design.unsaved.read_text() == design.text and design.path.read_text() == design.disk
    again = Design(design.disk, design.path, design.disk)
    assert unsaved_edits(again) == design.text
    design.save()
    assert design.path.read_text() == design.text and not design.unsaved.exists() and design.saved
    design.undo()
    design.redo()
    assert not design.unsaved.exists()


def test_a_file_that_somebody_else_changed_is_never_replaced_unasked(design):
    design.set("discs.0.mass", "5")
    theirs = design.disk.replace("3.946 kg", "3 kg")
    design.path.write_text(theirs)
    with pytest.raises(FileChangedError):
        design.save()
    assert design.path.read_text() == theirs and design.changed_on_disk()
    design.take_disk()
    assert design.text == theirs and not design.changed_on_disk()
    design.undo()
    design.path.write_text(theirs + "\n")
    design.save(anyway=True)
    assert design.path.read_text() == design.text
    with pytest.raises(FileChangedError):
        other = design.path.with_name("other.toml")
        other.write_text("theirs")
        design.save(other)


def test_a_file_with_faults_is_mended_one_by_one_and_cannot_become_worse(tmp_path):
    text = (
        machine_text("plain_rotor").replace("3.946 kg", "-3.946 kg").replace('length = "600 mm"', 'length = "600 kg"')
    )
    design = Design(text, tmp_path / "rotor.toml", text)
    assert set(problem_fields(design)) == {"discs.0.mass", "shaft.sections.0.length"} and design.machine is None
    paths = [field["path"] for group in listed(design) for part in group["parts"] for field in part["fields"]]
    assert "discs.0.mass" in paths
    with pytest.raises(RefusedError):
        design.set("bearings.0.kxx", "-1")
    design.set("discs.0.mass", "4 kg")
    assert set(problem_fields(design)) == {"shaft.sections.0.length"}
    design.set("shaft.sections.0.length", "600 mm")
    assert design.machine is not None and not design.problems


@pytest.mark.parametrize("key", list(STARTS))
def test_every_start_is_a_machine_under_a_name_that_is_free(tmp_path, key):
    (tmp_path / f"{STARTS[key].name}.toml").write_text("taken")
    design = begin(key, tmp_path)
    assert design.machine == Machine.from_text(design.text) and not design.path.exists()
    design.save()
    assert Machine.from_text(design.path.read_text()).name == STARTS[key].name


def test_a_page_cannot_write_or_open_beyond_its_folder(tmp_path):
    desk = DesignDesk(None, tmp_path / "inside")
    desk.folder.mkdir()
    (tmp_path / "secret.toml").write_text(machine_text("plain_rotor"))
    assert "refused" in desk.act("open", {"name": "../secret.toml"}) and desk.design is None
    desk.act("start", {"key": "springs"})
    for name in ("../out.toml", "a/b", "/out.toml", ".hidden"):
        assert "refused" in desk.act("save", {"name": name})
    assert "refused" in desk.act("nothing", {})
    assert not list(desk.folder.iterdir())


def test_bearings_can_be_added_again_and_again(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    for _ in range(12):
        design.add("bearings")
    assert len({b.position for b in design.machine.bearings}) == len(design.machine.bearings) == 14


def test_a_file_that_is_no_text_is_not_taken_over(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    design.save()
    design.path.write_bytes(b"\xff\xfe")
    before = design.text
    with pytest.raises(MachineFileError):
        design.take_disk()
    assert design.text == before and design.changed_on_disk()


def test_an_edit_in_a_folder_that_cannot_be_written_is_taken_and_the_page_is_told(tmp_path, monkeypatch):
    desk = DesignDesk(None, tmp_path)
    desk.act("start", {"key": "springs"})

    def full(path, text):
        raise WriteError(f"{path}: no room")

    monkeypatch.setattr("rotorsim.desk.design.write_text", full)
    assert desk.act("set", {"path": "discs.0.mass", "text": "5"}) == {"chosen": ""}
    assert desk.design.machine.discs[0].mass == 5 and desk.state()["unkept"]
    with pytest.raises(RefusedError):
        desk.run_up()
    monkeypatch.undo()
    desk.act("set", {"path": "discs.0.mass", "text": "6"})
    assert not desk.state()["unkept"]


@pytest.mark.parametrize("act", ["add", "copy", "delete", "set", "start", "open", "save", "take", "undo", "nothing"])
def test_whatever_a_forged_request_holds_is_answered_with_a_sentence_or_taken(tmp_path, act):
    words = ("", "discs", "discs.0", "discs.9", "discs.-1", "shaft", "effects.unbalance", "effects.unbalance.0", "x",
             "shaft.sections.0.length", "effects.magic", "bearings.0.kind.0", "name", "name.0", 'a"b', "a\nb", "\0",
             "..", "discs..mass", "9" * 400)  # fmt: skip
    desk = DesignDesk(None, tmp_path)
    for one in words:
        for key in ("path", "kind", "name", "key"):
            if desk.design is None:
                desk.act("start", {"key": "springs"})
            before = desk.design.text
            brought = desk.act(act, {key: one, "text": "5", "burst": ""})
            assert brought.keys() <= {"chosen", "refused", "conflict"}
            assert "refused" not in brought or desk.design.text == before
            assert desk.design.machine is not None and not desk.design.problems
            desk.design = None


def test_a_byte_order_mark_stays_in_the_file_that_has_one(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_bytes(b"\xef\xbb\xbf" + machine_text("plain_rotor").encode())
    design = open_design(path)
    assert design.saved and not design.changed_on_disk()
    design.set("discs.0.mass", "5")
    design.save()
    assert path.read_bytes() == b"\xef\xbb\xbf" + design.text.encode() and not design.changed_on_disk()
    design.save(tmp_path / "other.toml")
    assert (tmp_path / "other.toml").read_bytes() == design.text.encode()


def test_a_live_rig_that_says_nothing_is_ended(design, monkeypatch, tmp_path):
    silent = [sys.executable, "-c", "import time; time.sleep(600)"]
    begin_process = subprocess.Popen
    monkeypatch.setattr("rotorsim.desk.server.START", 0.2)
    monkeypatch.setattr("rotorsim.desk.server.subprocess.Popen", lambda words, **rest: begin_process(silent, **rest))
    desk = DesignDesk(design, tmp_path)
    with pytest.raises(MachineFileError):
        desk.run_up()
    assert desk.rigs[0].wait() < 0


def test_a_live_rig_that_ends_at_once_is_told_with_its_exit_code(design, monkeypatch, tmp_path):
    begin_process = subprocess.Popen
    monkeypatch.setattr(
        "rotorsim.desk.server.subprocess.Popen",
        lambda words, **rest: begin_process([sys.executable, "-c", "raise SystemExit(3)"], **rest),
    )
    with pytest.raises(MachineFileError) as error:
        DesignDesk(design, tmp_path).run_up()
    assert error.value.value == 3 and "3" in str(error.value)


def test_a_section_is_split_into_halves_that_are_the_same_shaft(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    design.set("shaft.sections.0.outer_diameter_right", "30 mm")
    before = design.machine
    assert design.split("shaft.sections.0") == "shaft.sections.1"
    first, second = design.machine.shaft.sections
    assert (first.outer, second.outer) == ((0.02, 0.025), (0.025, 0.03)) and first.length == second.length
    assert design.machine.mass == pytest.approx(before.mass, rel=1e-12)
    design.undo()
    assert design.machine == before
    with pytest.raises(RefusedError):
        design.split("discs.0")


def test_a_mirrored_part_lies_as_far_from_the_other_end(design):
    design.set("discs.0.position", "100")
    assert design.mirror("discs.0") == "discs.1"
    assert [disc.position for disc in design.machine.discs] == pytest.approx([0.1, 0.5])


def test_design_a_is_kept_and_changes_places_with_the_text_as_one_edit(design):
    begun = design.text
    design.swap()
    assert design.text == begun and not design.before
    design.keep()
    design.set("discs.0.mass", "5")
    design.swap()
    assert design.text == begun and design.kept != begun
    design.swap()
    assert design.machine.discs[0].mass == 5
    assert design.kept == begun
    design.undo()
    assert (design.text, design.kept) == (begun, design.after[-1][0])
    design.redo()
    assert design.machine.discs[0].mass == 5 and design.kept == begun
    design.forget()
    design.undo()
    assert design.text == begun and not design.kept


def test_a_design_in_a_folder_that_is_not_there_begins_empty_and_is_saved(tmp_path):
    desk = make_desk(tmp_path / "new" / "my.toml", tmp_path)
    assert desk.state()["files"] == []
    assert desk.act("start", {"key": "springs"}) == {"chosen": ""} and not desk.state()["unkept"]
    desk.act("set", {"path": "discs.0.mass", "text": "5"})
    assert desk.act("save", {}) == {"chosen": ""}
    assert Machine.from_text((tmp_path / "new" / "my.toml").read_text()).discs[0].mass == 5


def test_answers_of_design_a_come_after_those_of_the_design_and_are_of_its_text(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    desk, answers = DesignDesk(design, tmp_path), PanelStream()
    design.keep()
    kept = design.text
    design.set("discs.0.mass", "8")

    async def lines():
        return [orjson.loads(line) async for line in answers.stream(design, "w", ["static"], DeskPoint(), ["static"])]

    first, second = asyncio.run(lines())
    state = desk.state()
    assert (first["text"], second["text"]) == (state["text"], state["kept"])
    assert first["answer"] == answer_of(design.text, DeskPoint(), "static")
    assert second["answer"] == answer_of(kept, DeskPoint(), "static") != first["answer"]
    desk.act("forget", {})
    assert desk.state()["kept"] == "" and len(asyncio.run(lines())) == 1


@pytest.mark.parametrize("names", [[["static"]], [{"a": 1}], [None, 5], "static", {"static": 1}])
def test_names_of_panels_that_are_no_texts_are_left_out(tmp_path, names):
    app = application(DesignDesk(open_design("plain_rotor", tmp_path), tmp_path), PanelStream())
    answer_panels = next(route.endpoint for route in app.routes if getattr(route, "path", "") == "/answers")
    sent = orjson.dumps({"panels": names, "kept": names})

    async def receive():
        return {"type": "http.request", "body": sent, "more_body": False}

    async def lines():
        answer = await answer_panels(Request({"type": "http", "method": "POST", "headers": []}, receive))
        return [line async for line in answer.body_iterator]

    assert asyncio.run(lines()) == []


def test_a_rotor_that_ross_saved_is_opened_as_a_machine_of_its_own(tmp_path):
    saved = Path(__file__).parents[1] / "fe_shaft" / "ross_compressor.json"
    (tmp_path / "compressor.json").write_bytes(saved.read_bytes())
    (tmp_path / "other.json").write_text("[]")
    desk = DesignDesk(None, tmp_path)
    assert "refused" in desk.act("open", {"name": "other.json"}) and desk.design is None
    assert "refused" not in desk.act("open", {"name": "compressor.json"}) and desk.remark
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotCarried)
        assert desk.design.machine == from_ross(saved, "compressor")
    assert desk.design.path.suffix == ".toml" and not desk.design.path.exists()


TABLE = "speed [rpm];kxx [kN/mm];cxx [N*s/mm]\n0;10;1\n3000;20,5;1,5\n"


@pytest.mark.parametrize("name", ["plain_rotor", "pump_on_tables"])
def test_a_bearing_takes_the_table_of_a_csv_file_and_the_rest_of_the_text_stays(tmp_path, name):
    design = open_design(name, tmp_path)
    before, begun = design.machine, design.text
    design.tabulate("bearings.1", "supplier.csv", TABLE)
    (tmp_path / "supplier.csv").write_text(TABLE)
    taken = with_points(before, 1, bearing_points(tmp_path / "supplier.csv"))
    assert design.machine.bearings[1].points == taken.bearings[1].points
    assert design.machine.bearings[0] == before.bearings[0] and design.machine.shaft == before.shaft
    design.undo()
    assert design.text == begun


@pytest.mark.parametrize(
    ("path", "content"),
    [("bearings.0", "speed [rpm],kxx [MN/m]\n0,10\n"), ("bearings.0", ""), ("bearings.0", "speed,kxx\n0,1\n1,1\n"),
     ("bearings.0", TABLE.replace("3000", "much")), ("bearings.9", TABLE), ("discs.0", TABLE), ("", TABLE)],
)  # fmt: skip
def test_a_table_that_no_bearing_can_have_is_refused_with_the_name_of_its_file(design, path, content):
    before = design.text
    with pytest.raises(RefusedError) as error:
        design.tabulate(path, "supplier.csv", content)
    assert (error.value.argument, error.value.value) == (path, "supplier.csv") and design.text == before


def begun_by(desk):
    """Children that run their own program: one stopped before would hold the desk in its system call."""
    return [one for one in psutil.Process(desk.pid).children() if "rotorsim.base.processes" in one.cmdline()]


@contextmanager
def computing(tmp_path, name, asked):
    """A desk, its child that computes what was asked and the connection that waits for it.

    The child is stopped, so that a desk that waits for it never ends.
    """
    path = tmp_path / "rotor.toml"
    path.write_bytes(machine_text(name).encode())
    words = [sys.executable, "-m", "rotorsim", "desk", str(path), "--no-browser", "--keep-open"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as desk:
        address = urlsplit(desk.stdout.readline().split()[-1])
        waiting = HTTPConnection(address.netloc)
        waiting.request("GET", f"/?{address.query}")
        with waiting.getresponse() as welcome:
            cookie = {"Cookie": welcome.headers["set-cookie"].partition(";")[0]}
            welcome.read()
        content = orjson.dumps({"window": "w", "panels": ["campbell"]}) if asked == "answers" else None
        waiting.request("POST" if content else "GET", f"/{asked}", content, cookie)
        child = until(lambda: begun_by(desk), desk)[0]
        child.suspend()
        try:
            yield desk, child, waiting
            desk.send_signal(signal.SIGINT)
            assert desk.wait(PATIENCE) == 0
            assert "Traceback" not in desk.stderr.read()
            assert not psutil.wait_procs([child], PATIENCE)[1]
        finally:
            waiting.close()
            desk.kill()
            with suppress(psutil.NoSuchProcess):
                child.kill()


FILMS = "rigid_rotor_self_acting"


@pytest.mark.parametrize(("name", "asked"), [(FILMS, "answers"), (FILMS, "report"), ("pump_on_tables", "report")])
def test_ctrl_c_ends_a_desk_whose_child_computes_and_the_child(tmp_path, name, asked):
    with computing(tmp_path, name, asked):
        pass


def test_a_report_that_nobody_waits_for_any_more_is_given_up(tmp_path):
    with computing(tmp_path, "plain_rotor", "report") as (desk, child, waiting):
        waiting.close()
        assert not psutil.wait_procs([child], PATIENCE)[1] and desk.poll() is None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
@pytest.mark.parametrize("name", ["plain_rotor", FILMS])
def test_a_panel_answers_while_a_report_is_under_way(tmp_path, name):
    """The report reads a pipe: it is under way once the pipe is open, and ends with what is written there later."""
    text = machine_text(name)
    answers, design = PanelStream(), Design(text, tmp_path / "rotor.toml")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    async def both():
        request = Request({"type": "http"}, asyncio.Event().wait)
        report = asyncio.create_task(answers.whole(request, Path.read_text, pipe))
        with await asyncio.to_thread(open, pipe, "w") as writer:
            lines = [orjson.loads(line) async for line in answers.stream(design, "w", ["modes"], DeskPoint(top=3000.0))]
            under_way = not report.done()
            writer.write("the report")
        return lines, under_way, await report

    try:
        lines, under_way, page = asyncio.run(both())
    finally:
        answers.close()
    assert [line["panel"] for line in lines] == ["modes"] and "error" not in lines[0]["answer"]
    assert under_way and page == "the report"


def test_a_program_reads_the_answers_as_the_page_of_the_docs_shows(tmp_path):
    """The program's names are those of its page; each key of an answer stands there."""
    page = (ROOT / "docs" / "desk.md").read_text(encoding="utf-8")
    (program,) = [block.text for block in blocks_of(ROOT / "docs" / "desk.md") if block.language == "python"]
    words = [sys.executable, "-m", "rotorsim", "desk", "plain_rotor", "--no-browser", "--keep-open"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=tmp_path) as desk:
        space, address = {}, desk.stdout.readline().split()[-1]
        try:
            exec(program.replace("http://127.0.0.1:8760/?token=...", address), space)
        finally:
            desk.send_signal(signal.SIGINT)
    line, text = orjson.loads(space["line"]), machine_text("plain_rotor")
    expected = orjson.loads(orjson.dumps(answer_of(text, DeskPoint(top=9000.0), "campbell")))
    assert space["panels"] == list(PANELS) and line["panel"] == "campbell"
    assert line["answer"] == expected and expected["rows"]
    answers = [answer_of(text, DeskPoint(), name) for name in (*FIRST, "modes", "static")]
    keys = {"error", *line}.union(expected, *answers, expected["x"], *(one["y"] for one in answers))
    assert {key for key in keys if f"`{key}`" not in page} == set()


@pytest.mark.nightly
def test_forty_minutes_of_edits_lose_none_and_are_all_undone(tmp_path):
    """Two acts a second at a machine on springs; every tenth design is answered."""
    desk = DesignDesk(None, tmp_path)
    desk.act("start", {"key": "springs"})
    design, begun = desk.design, desk.design.text
    for number, (act, values) in enumerate(edits(np.random.default_rng(5), design, 40 * 60 * 2)):
        assert desk.act(act, values).keys() <= {"chosen", "refused"}
        assert design.machine is not None and not design.problems and not design.unkept
        kept = design.unsaved.read_text(encoding="utf-8") if design.unsaved.exists() else begun
        assert kept == design.text
        if number % 10 == 0:
            for name in ("campbell", "static", "limits"):
                assert answer_of(design.text, DeskPoint(), name)["title"]
    while design.before:
        design.undo()
    assert design.text == begun


def test_what_is_imported_is_the_collectors_again_behind_the_desk(tmp_path, monkeypatch):
    """Behind a desk that cannot begin too; the child that computes films leaves its imports out as well."""
    frozen = []
    monkeypatch.setattr(server, "application", lambda *_: None)
    monkeypatch.setattr(server.pages, "on_shutdown", lambda _: None)
    monkeypatch.setattr(server, "serve", lambda *_, **__: frozen.append(gc.get_freeze_count()))
    server.serve_desk("plain_rotor", tmp_path)
    assert frozen[0] > 1000 and gc.get_freeze_count() == 0
    with pytest.raises(MachineFileError):
        server.serve_desk("no_such_machine", tmp_path)
    assert gc.get_freeze_count() == 0
    answers = PanelStream()
    try:
        assert answers._call(gc.get_freeze_count) > 1000
    finally:
        answers.close()


def test_the_tables_of_a_design_are_its_own(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    design.tables["bearings"][0]["kxx"] = "changed"
    assert design.tables["bearings"][0]["kxx"] != "changed"
