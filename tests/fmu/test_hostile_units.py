"""Units of other people: what is no unit, or a dangerous one, ends in a sentence and writes nothing elsewhere."""

import json
import zipfile
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from fmu.check import Check, _guarded, _pace, findings, model_of
from fmu.importer import ImportedUnit, info
from fmu.ssp import CoupledUnits
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.cli import command

DESCRIPTION = """<?xml version="1.0"?>{}
<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="x">
<CoSimulation modelIdentifier="{}"/><ModelVariables/><ModelStructure/></fmiModelDescription>"""
FACTS = {
    "model": "m", "software": "s", "model_hash": "h", "targets": ["host"], "cpu": "portable",
    "start": {"speed": 0, "pressure": 0},
}  # fmt: skip
DEEP = b"[" * 100_000 + b"]" * 100_000
LAUGHS = "<!DOCTYPE x [" + '<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(20)
) + "]>"  # fmt: skip


@pytest.fixture
def unit(tmp_path):
    """Write an archive that claims to be a unit; further files by name, None to leave one out, a number for zeros."""

    def write(files=(), prologue="", identifier="m", **facts):
        content = {
            "modelDescription.xml": DESCRIPTION.format(prologue, identifier).encode(),
            "resources/model.json": json.dumps(FACTS | facts).encode(),
        } | dict(files)  # fmt: skip
        path = tmp_path / "unit.fmu"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
            for name, data in content.items():
                if data is not None:
                    made.writestr(name, bytes(data))
        return path

    return write


@pytest.mark.parametrize("kind", ["law", "lpv"])
@pytest.mark.parametrize("up", [True, False])
def test_the_name_in_a_unit_is_no_path_to_write_to(unit, tmp_path, kind, up):
    outside = tmp_path / "outside"
    outside.mkdir()
    name = ("../" * 40 if up else "/") + str(outside / "planted").lstrip("/")
    with pytest.raises(RotorsimError):
        model_of(unit({f"resources/{kind}.json": b"{}"}, model=name))
    assert list(outside.iterdir()) == [] and sorted(p.name for p in tmp_path.iterdir()) == ["outside", "unit.fmu"]


HOSTILE = {
    "no description": {"files": {"modelDescription.xml": None}},
    "no facts": {"files": {"resources/model.json": None}},
    "nested facts": {"files": {"resources/model.json": DEEP}},
    "facts of another kind": {"files": {"resources/model.json": b"[1]"}},
    "broken description": {"files": {"modelDescription.xml": b"<a><b></a>"}},
    "empty description": {"files": {"modelDescription.xml": b""}},
    "entities": {"prologue": LAUGHS},
    "a file of the computer": {"prologue": '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>'},
    "nested law": {"files": {"resources/law.json": DEEP}},
    "nested model": {"files": {"resources/lpv.json": DEEP}},
    "machine that is no text": {"files": {"resources/machine.toml": b"\xff\xfe"}},
    "nested machine": {"files": {"resources/machine.toml": b"a = " + DEEP}},
    "library elsewhere": {"identifier": "../../../../evil"},
    "upwards": {"files": {"../up": b""}},
    "absolute": {"files": {"/up": b""}},
    "bomb": {"files": {"resources/a": 60_000_000}},
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize("what", ["info", "check"])
def test_a_hostile_unit_ends_a_command_in_a_sentence(unit, capsys, kind, what):
    path = unit(**HOSTILE[kind])
    with pytest.raises(SystemExit) as ended:
        command(["fmu", what, str(path)])
    printed = capsys.readouterr()
    lines = [line for line in printed.err.splitlines() if "will run as you" not in line]
    if ended.value.code == 0:
        assert what == "info" and kind.startswith(("library elsewhere", "nested", "machine"))
        return
    assert ended.value.code in (1, 2) and "Traceback" not in printed.err + printed.out
    assert len(lines) == (ended.value.code == 2) and all(line.isprintable() for line in lines)


@pytest.mark.parametrize("kind", ["upwards", "absolute", "bomb"])
def test_no_reader_of_units_takes_a_hostile_archive(unit, kind):
    path = unit(**HOSTILE[kind])
    for reader in (info, findings, ImportedUnit, CoupledUnits):
        with pytest.raises(DataError):
            reader(path)


def test_a_unit_that_holds_itself_ends(tmp_path):
    inner = tmp_path / "unit.fmu"
    for _ in range(30):
        outer = tmp_path / "outer.fmu"
        with zipfile.ZipFile(outer, "w") as made:
            made.writestr("unit.fmu", inner.read_bytes() if inner.exists() else b"")
        outer.rename(inner)
    assert findings(inner) == []


def test_checking_says_before_it_that_code_will_run(unit, capsys):
    with pytest.raises(SystemExit):
        command(["fmu", "check", str(unit(identifier="a-b"))])
    first = capsys.readouterr().err.splitlines()[0]
    assert "its machine code will run as you" in first


def test_whatever_a_unit_makes_of_a_check_is_a_check_that_failed():
    def job():
        raise ZeroDivisionError("a\x1bb\nc")
        yield

    (found,) = _guarded(job)
    assert not found.passed and "ZeroDivisionError" in found.value
    with pytest.raises(DataError):
        list(_guarded(lambda: Path("x") and (_ for _ in ()).throw(DataError("its sentence"))))


def test_times_of_a_busy_computer_are_remarks_and_no_verdict(unit, monkeypatch, capsys):
    monkeypatch.setattr("fmu.check.step_cost", lambda *_: 3600.0)
    found = list(_pace(MagicMock(), SimpleNamespace(sample=2e-4), Path("a.fmu")))
    assert [one.passed for one in found] == [None, None] and "real time" in found[1].value
    path = unit(identifier="a")
    for last, code in ((Check("standard", "", True), 0), (Check("standard", "", False), 1)):
        monkeypatch.setattr("fmu.importer.info", lambda _: {})
        monkeypatch.setattr("fmu.check.check", lambda *_, last=last: iter([*found, last]))
        with pytest.raises(SystemExit) as ended:
            command(["fmu", "check", str(path)])
        assert (ended.value.code or 0) == code and "info  doStep" in capsys.readouterr().out
