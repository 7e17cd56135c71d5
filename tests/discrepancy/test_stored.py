"""Diagnosis stored and loaded: the same page, numbers and machine; files that cannot be used end in a sentence."""

import io
import json
import pickle
import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.cli import main
from rotorsim.commands.diagnosis import show
from rotorsim.discrepancy import Diagnosis, diagnose, load_diagnosis, reduction, save_diagnosis
from rotorsim.discrepancy.discovery import DiscoveredLaw
from rotorsim.discrepancy.files import StoredPlan
from rotorsim.discrepancy.hidden_mass import HiddenMass
from rotorsim.discrepancy.result import LAW_FILE, NOT_TRUSTED
from rotorsim.machine import load_machine
from small_diagnosis import blocked, small_diagnosis

PLAN = {"sentence": "Next: impact.", "entropy_bit": 1.0, "rivals": ["a", "b"], "unbreakable": [],
        "proposals": [{"experiment": "impact of 40 N at 300 rpm", "minutes": 3.0, "entropy_bit": 0.1,
                       "chance_of_decision": 0.9}]}  # fmt: skip
CASES = {
    "named": small_diagnosis(),
    "injector": small_diagnosis("dtu_gas_bearing", effects=[blocked()]),
    "tie": small_diagnosis(status="tie", ties=(("shaft_bow.bow", "coupling.force_2x"),)),
    "unknown": small_diagnosis(status="unknown", effects=[]),
    "planned": small_diagnosis(planned=StoredPlan(PLAN, 'name = "next"\n')),
}


def text_of(page):
    """A page without the names that its figures are drawn under, which are random."""
    return re.sub(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "", page.read_text(encoding="utf-8"))


def same(one: Diagnosis, other: Diagnosis) -> bool:
    """Whether two diagnoses have the same numbers."""
    texts = [json.dumps(d.as_dict(), default=float) for d in (one, other)]
    return texts[0] == texts[1] and one.gap.identical(other.gap) and one.sentence == other.sentence


@pytest.mark.parametrize("case", CASES)
def test_a_loaded_diagnosis_has_the_same_numbers_machine_and_page(case, tmp_path):
    found = CASES[case]
    save_diagnosis(found, tmp_path)
    again = load_diagnosis(tmp_path)
    assert same(again, found) and reduction(again.gap) == reduction(found.gap)
    assert repr(again.explanations) == repr(found.explanations)  # with a NaN, which is unlike itself
    assert again.effects == found.effects
    assert again.apply() == found.apply() and again.apply()._source == found.apply()._source
    again.report(tmp_path / "again.html")
    assert text_of(tmp_path / "again.html") == text_of(tmp_path / "report.html")


LAW = DiscoveredLaw("law", "disc 1", 0.3, "", {}, {}, ("cubic",), "register_me = 1\n", "", 0.99)
HEAVY = HiddenMass(0.31, 0.02, 390.0, 0.03).table


@pytest.mark.parametrize(
    ("more", "written", "apart"),
    [
        ({}, True, True),
        ({"worse": ("untouched_1",)}, True, True),
        ({"discovered": replace(LAW, source="")}, False, True),
        ({"discovered": replace(LAW, source="", bearing=HEAVY)}, False, False),
        ({"status": "named", "discovered": None}, False, False),
    ],
)
def test_a_machine_file_states_at_its_top_a_law_that_it_does_not_hold(more, written, apart, tmp_path, capsys):
    """Its numbers were fitted next to the law; a hidden mass is in the file."""
    found = small_diagnosis(**({"status": "discovered", "effects": [], "discovered": LAW} | more))
    files = save_diagnosis(found, tmp_path)
    text = Path(files["machine"]).read_text()
    top = text.partition("\nname")[0]
    assert ("law" in files, bool(found.file_notes)) == (written, apart)
    assert ("does not hold the law" in top, f"import {Path(LAW_FILE).stem}" in top) == (apart, written)
    assert ("re-calibrated numbers were fitted" in top.replace("\n# ", " ")) == (apart and not found.worse)
    assert all(len(line) <= 120 for line in top.splitlines()[2:])
    show(found, files, as_json=False)
    for shown in (text_of(Path(files["report"])).partition("The gap, record by record")[0], capsys.readouterr().out):
        assert ("does not hold the law" in shown) == apart
    assert load_machine(files["machine"]) == found.apply()


@pytest.mark.parametrize(
    ("status", "more", "warned"),
    [("partial", {}, True), ("partial", {"worse": ("untouched_1",)}, False), ("named", {}, False), ("tie", {}, False)],
)
def test_a_machine_file_of_a_partial_explanation_states_that_its_numbers_are_not_trusted(
    status, more, warned, tmp_path
):
    found = small_diagnosis(status=status, **more)
    found.apply().save(tmp_path / "new.toml")
    top = (tmp_path / "new.toml").read_text().partition("\nname")[0]
    assert ("not trusted" in top) == warned == (NOT_TRUSTED in found.file_notes)


def test_a_loaded_diagnosis_is_saved_again_as_it_was(tmp_path):
    first = save_diagnosis(CASES["planned"], tmp_path / "a")
    second = save_diagnosis(load_diagnosis(tmp_path / "a"), tmp_path / "b")
    assert first.keys() == second.keys()
    for kind in ("machine", "difference", "plan", "verdict"):
        assert Path(first[kind]).read_text() == Path(second[kind]).read_text(), kind


@pytest.mark.slow
def test_a_computed_diagnosis_is_the_same_when_it_is_loaded(machine, models, recorded, tmp_path):
    records, _ = recorded(("coupling.force_2x",), 4)
    found = diagnose(machine, records, effects=("coupling", "runout"), models=models)
    save_diagnosis(found, tmp_path)
    again = load_diagnosis(tmp_path)
    again.report(tmp_path / "again.html")
    assert same(again, found) and text_of(tmp_path / "again.html") == text_of(tmp_path / "report.html")


@pytest.fixture
def stored(tmp_path):
    """A folder with a diagnosis."""
    save_diagnosis(CASES["named"], tmp_path / "d")
    return tmp_path / "d"


def rewrite(folder, change):
    """Write the stored data again with its arrays, a JSON text among them, changed."""
    path = folder / "report_data.npz"
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    change(arrays)
    np.savez(path, **arrays)


def content_as(**values):
    """A change of the JSON text."""

    def change(arrays):
        content = json.loads(arrays["content"].tobytes()) | values
        arrays["content"] = np.frombuffer(json.dumps(content).encode(), np.uint8)

    return change


def with_pickle(folder):
    """An array of objects in the archive, which numpy would unpickle."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.array([{}], object), allow_pickle=True)
    with zipfile.ZipFile(folder / "report_data.npz", "a") as file:
        file.writestr("evil.npy", buffer.getvalue())


def cut(folder, name):
    """The first half of a file."""
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data[: len(data) // 2])


def edited(folder):
    """Another verdict."""
    path = folder / "diagnosis.json"
    path.write_text(path.read_text().replace('"named"', '"unknown"'))


BROKEN = {
    "no verdict": (lambda d: (d / "diagnosis.json").unlink(), "has no diagnosis.json, so no verdict"),
    "no data": (lambda d: (d / "report_data.npz").unlink(), "has no report_data.npz, from which"),
    "cut data": (lambda d: cut(d, "report_data.npz"), "report_data.npz: is damaged"),
    "empty data": (lambda d: (d / "report_data.npz").write_bytes(b""), "is damaged"),
    "pickle": (lambda d: (d / "report_data.npz").write_bytes(pickle.dumps({"a": 1})), "is damaged"),
    "pickled array": (with_pickle, "is damaged"),
    "cut verdict": (lambda d: cut(d, "diagnosis.json"), "a verdict that is not JSON"),
    "edited verdict": (edited, "does not belong to the verdict next to it"),
    "another verdict": (lambda d: (d / "diagnosis.json").write_text("{}"), "does not belong to the verdict"),
    "another version": (lambda d: rewrite(d, content_as(version=99)), "is of another version of rotorsim"),
    "another kind": (lambda d: rewrite(d, content_as(kind="a record")), "is of another version of rotorsim"),
    "edited data": (lambda d: rewrite(d, content_as(fields={})), "was changed since it was written"),
    "missing array": (lambda d: rewrite(d, lambda a: a.pop("array_1")), "was changed since it was written"),
    "no content": (lambda d: rewrite(d, lambda a: a.pop("content")), "has no content that can be read"),
    "no JSON": (lambda d: rewrite(d, lambda a: a.update(content=np.zeros(3, np.uint8))), "has no content that can be"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_files_that_cannot_be_used_are_refused_in_a_sentence(case, stored, tmp_path, capsys):
    broken, sentence = BROKEN[case]
    broken(stored)
    with pytest.raises(DataError) as refused:
        load_diagnosis(stored)
    assert sentence in str(refused.value) and "\n" not in str(refused.value)
    with pytest.raises(SystemExit) as ended:
        main(["report", "diagnosis", str(stored), "--out", str(tmp_path / "page.html")])
    assert ended.value.code == 2 and capsys.readouterr().err == f"{refused.value}\n"
    assert not (tmp_path / "page.html").exists()


def test_fields_that_do_not_fit_are_refused_with_their_place(stored, monkeypatch):
    """As of a file of another version that has the same number."""
    monkeypatch.setattr("rotorsim.discrepancy.files._seal", lambda arrays: np.zeros(0))
    rewrite(stored, lambda arrays: arrays.update(seal=np.zeros(0)))
    rewrite(stored, content_as(fields={"status": "named"}))
    with pytest.raises(DataError, match=r"another version of rotorsim \(effects is missing\)"):
        load_diagnosis(stored)
    rewrite(stored, content_as(machine="name = 3"))
    with pytest.raises(DataError, match=r"another version of rotorsim \(its machine: "):
        load_diagnosis(stored)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with refused(DataError, "folder", tmp_path / "none"):
        load_diagnosis(tmp_path / "none")


def test_a_diagnosis_without_a_page_gets_one_by_the_command(tmp_path, capsys):
    save_diagnosis(CASES["named"], tmp_path / "d", report=False)
    page = tmp_path / "d" / "report.html"
    for _ in range(2):  # the second time in place of the first page
        with pytest.raises(SystemExit) as ended:
            main(["report", "diagnosis", str(tmp_path / "d")])
        assert not ended.value.code and f"report: {page}" in capsys.readouterr().out
    CASES["named"].report(tmp_path / "page.html")
    assert text_of(page) == text_of(tmp_path / "page.html")


def test_another_page_is_not_replaced_without_force(stored, capsys):
    page = stored / "mine.html"
    page.write_text("mine")
    with pytest.raises(SystemExit) as ended:
        main(["report", "diagnosis", str(stored), "--out", str(page)])
    assert ended.value.code == 2 and "is there already" in capsys.readouterr().err and page.read_text() == "mine"


def test_a_page_in_other_units_and_its_figures_are_made_from_the_folder(stored, capsys):
    with pytest.raises(SystemExit):
        main(["report", "diagnosis", str(stored), "--units", "imperial", "--figures", "csv", "--json"])
    assert json.loads(capsys.readouterr().out)["files"]["figures"].endswith("report_*.csv")
    assert "position along the shaft [in]" in (stored / "report.html").read_text()
    assert (stored / "report_where_on_the_machine.csv").is_file()


def test_an_explanation_is_stored_field_by_field(tmp_path):
    judged = (replace(CASES["named"].explanations[0], alike=(("a", "b"), ("c",))),)
    save_diagnosis(replace(CASES["named"], explanations=judged), tmp_path)
    again = load_diagnosis(tmp_path)
    assert again.explanations == judged and again.odds == {judged[0].name: 0.95}
