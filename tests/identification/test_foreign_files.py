"""Proposals for files named by others: right or left out, never wrong, most of them fit for use."""

import re
import tomllib
from functools import cache

import pytest
from foreign_files import FILES, made

import identification as idn
from identification.records.columns import agree, is_unit_of

SECTIONS = {
    "time": "time", "keyphasor": "keyphasor", "probes": "probe", "channels.disc_measured": "probe", "hammer": "force",
    "channels.disc_force": "force", "channels.speed": "speed", "channels.pressure": "pressure",
    "channels.reference": "reference", "channels.angle": "angle",
}  # fmt: skip
OF = {"m": "probe", "m/s": "velocity", "m/s^2": "acceleration"}


def entries(tables, path=""):
    for name, table in tables.items():
        where = f"{path}.{name}" if path else name
        if isinstance(table, dict) and "column" in table:
            yield where, table
        elif isinstance(table, dict):
            yield from entries(table, where)


def kind_of(where, entry):
    for section, kind in SECTIONS.items():
        if where == section or where.startswith(f"{section}."):
            return kind
    if where.startswith("channels.probe_measured"):
        over = entry.get("sensitivity", f"/{entry['unit']}").partition("/")[2].strip("()")
        return next((kind for si, kind in OF.items() if is_unit_of(over, si)), "?")
    return where


@cache
def judged(name, folder):
    """Right, wrong and left out columns of a file, and whether the proposal makes a usable record."""
    text, truth = made(name)
    path = folder / f"{name}.{'lvm' if name == 'labview' else 'csv'}"
    path.write_text(text, encoding="latin-1")
    table = idn.columns(path)
    proposal, _ = idn.propose(table, path.name)
    (folder / f"{name}.toml").write_text(proposal, encoding="utf-8")
    found = {}
    for where, entry in entries(tomllib.loads(proposal)):
        column = entry["column"]
        number = column - 1 if isinstance(column, int) else [c.name for c in table.columns].index(column)
        found[number] = (where, entry)
    right, wrong, empty = [], [], []
    for k, (kind, unit) in enumerate(truth):
        heading = table.columns[k].name
        if k not in found:
            empty += [heading] if kind else []
            continue
        where, entry = found[k]
        stated = entry.get("unit", table.columns[k].unit or "")
        good = kind_of(where, entry) == kind and (not unit or agree(stated, unit))
        axis = {"x": "x", "X": "x", "y": "y", "Y": "y"}.get(where.rpartition(".")[2], "")
        words = re.findall(r"(?<![a-z])[xy](?![a-z])", heading.lower())
        good = good and not (axis and words and words[-1] != axis and "." in where and "probes" not in where)
        (right if good else wrong).append(f"{heading} -> {where} {stated}")
    try:
        record = idn.load(path, folder / f"{name}.toml")
        usable, why = not idn.examine(record).problems, str(idn.examine(record).problems)
    except Exception as error:
        usable, why = False, str(error)
    return right, wrong, empty, usable, why


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("foreign")


@pytest.mark.parametrize("name", FILES)
def test_no_proposal_is_wrong(name, folder):
    assert judged(name, folder)[1] == []


def test_most_columns_are_proposed_and_most_files_usable(folder):
    assert len(FILES) == 40
    parts = [judged(name, folder) for name in FILES]
    right, empty = (sum(len(part[k]) for part in parts) for k in (0, 2))
    assert right / (right + empty) >= 0.8
    assert sum(part[3] for part in parts) >= 36
