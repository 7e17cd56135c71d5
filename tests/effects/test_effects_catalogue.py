"""Catalogue of effects: each has a signature test, a section in the docs, equation and source."""

import importlib.util
import json
import re
from dataclasses import fields
from pathlib import Path

import pytest

from rotorsim.base.quantity import quantity_of
from rotorsim.base.references import references
from rotorsim.base.units import parse, show
from rotorsim.cli import main
from rotorsim.commands.machine import _print_effect
from rotorsim.effects import REGISTRY
from rotorsim.effects.base import WHERE
from rotorsim.machine.catalogue import catalogue, describe, page

HERE = Path(__file__).parent
SHIPPED = sorted(n for n, e in REGISTRY.items() if e.__module__.startswith("rotorsim.effects."))
DOCS = HERE.parents[1] / "docs"


def signatures():
    """Name of effect -> the test that shows it, from all files of this folder."""
    found = {}
    for path in sorted(HERE.glob("test_effects_*.py")):
        if "\nSIGNATURES = {" in path.read_text(encoding="utf-8"):
            spec = importlib.util.spec_from_file_location(path.stem, path)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            found |= module.SIGNATURES
    return found


def test_every_shipped_effect_has_a_test_of_its_signature():
    found = signatures()
    assert sorted(found) == SHIPPED
    assert all(test.__name__.startswith("test_") for test in found.values())
    assert len(set(found.values())) == len(found)


def test_the_page_of_the_docs_is_the_one_that_the_effects_make():
    """When this fails: python -m rotorsim.machine.catalogue docs/effects.md"""
    assert (DOCS / "effects.md").read_text(encoding="utf-8") == page()
    for name in ("index.md", "machine_files.md"):
        assert "(effects.md)" in (DOCS / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", SHIPPED)
def test_an_effect_states_its_equation_its_source_and_what_its_parameters_are(name):
    entry = describe(REGISTRY[name])
    assert entry["equation"] and entry["source"] and entry["title"].endswith(".")
    for parameter in entry["parameters"]:
        assert parameter["doc"].endswith(".")
    assert entry["equation"].count("{") == entry["equation"].count("}")


@pytest.mark.parametrize("name", SHIPPED)
def test_a_parameter_has_finite_limits_round_its_neutral_value_and_takes_them_as_text(name):
    for field in fields(REGISTRY[name]):
        quantity = quantity_of(field)
        low, high = quantity.bounds
        assert -1e299 < low < high < 1e299
        assert field.name in WHERE or low <= field.default <= high
        for value in (low, high):
            assert quantity.parse(show(value, quantity.unit) if quantity.unit != "1" else value) == value
        assert parse(show(high, quantity.unit) if quantity.unit != "1" else high, quantity.unit) == high


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as caught:
        main(["machine", "effects", *arguments])
    out, err = capsys.readouterr()
    return caught.value.code or 0, out, err


def test_the_command_lists_all_effects_and_shows_one(capsys):
    code, out, _ = run(capsys)
    assert code == 0 and all(re.search(rf"^{name} ", out, re.MULTILINE) for name in SHIPPED)
    code, out, _ = run(capsys, "crack")
    assert code == 0 and "[effects.crack]" in out and "weight_direction" in out and "Gasch (1993)" in out
    code, out, err = run(capsys, "crak")
    assert code == 2 and not out and err == "crak: unknown effect; did you mean 'crack'?\n"


def test_an_effect_without_text_shows_what_there_is(capsys):
    entry = describe(REGISTRY["gravity"]) | {"about": "", "source": "", "equation": "", "references": []}
    _print_effect(entry | {"title": "", "summary": "Pull of a belt."})
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == ["[effects.gravity]  Pull of a belt.", "", lines[2]] and lines[2].startswith("Acts ")


def test_the_command_gives_the_catalogue_as_json_and_has_an_example(capsys):
    assert json.loads(run(capsys, "--json")[1]) == catalogue()
    assert json.loads(run(capsys, "noise", "--json")[1]) == describe(REGISTRY["noise"])
    assert "Example: rotorsim machine effects" in run(capsys, "--help")[1]


def test_every_source_with_a_year_is_cited_by_its_key():
    """That no key is unused: tests/docs/test_citations.py."""
    assert {key for name in SHIPPED for key in REGISTRY[name].cites} <= references().keys()
    for name in SHIPPED:
        years = set(re.findall(r"\((\d{4})\)", describe(REGISTRY[name])["source"]))
        found = {key.rpartition("_")[2] for key in REGISTRY[name].cites}
        assert years <= found, name
