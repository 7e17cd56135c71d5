"""Citation keys: every key that a module, an effect or a machine cites has an entry, and every entry is cited."""

import ast
import json
import tomllib
from pathlib import Path

import pytest
from scipy.io import savemat

import rotorsim as rs
from rotorsim.analysis.citations import machine_sources
from rotorsim.base.references import bibtex, cited_by, entries, keys_of, references, shown
from rotorsim.cli import main
from rotorsim.effects import REGISTRY

ROOT = Path(__file__).parents[2]
PACKAGES = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu", "studies", "tests/support", "tests/fe_shaft")
SOURCES = {p: p.read_text(encoding="utf-8") for room in PACKAGES for p in sorted((ROOT / room).rglob("*.py"))}
EFFECTS = [effect for effect in REGISTRY.values() if effect.__module__.startswith("rotorsim.effects.")]


def cited():
    """Every key that is cited, by the place that cites it first."""
    found = {key: path.name for path, text in SOURCES.items() for key in keys_of(text)}
    found |= {key: effect.name for effect in EFFECTS for key in effect.cites}
    return found | {key: name for name, keys in machine_sources().items() for key in keys}


def test_every_key_has_an_entry_and_every_entry_is_cited():
    found = cited()
    assert found.keys() - entries().keys() == set(), "cited, without an entry"
    assert entries().keys() - found.keys() == set(), "entries that nothing cites"


def test_a_module_that_states_an_equation_cites_a_source():
    found = {
        p: t for p, t in SOURCES.items() if "math::" in t and ".. math::" in (ast.get_docstring(ast.parse(t)) or "")
    }
    bare = [path.stem for path, text in found.items() if not keys_of(text) and "cites = (" not in text]
    assert len(found) > 50 and bare in ([], ["pressure_transducer"]), (
        "add a line 'Cites: KEY.'; its sizes are data sheets'"
    )


def test_the_file_of_references_is_read_whole():
    text = (ROOT / "rotorsim" / "base" / "references.bib").read_text(encoding="utf-8")
    assert text.count("\n@") == len(bibtex()) == len(entries())
    assert list(entries()) == sorted(entries())
    for key, entry in entries().items():
        assert entry["author"], key
        assert key.endswith(entry.get("year", "")), key


def test_an_entry_reads_as_one_line():
    assert references()["cowper_1966"] == (
        "G. R. Cowper (1966), The shear coefficient in Timoshenko's beam theory, "
        "Journal of Applied Mechanics 33, 335-340"
    )
    assert shown({"author": "{ISO}", "title": "T", "doi": "1/2"}) == "ISO, T, doi:1/2"


def test_the_thesis_and_its_first_paper_are_in_the_citation_file():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    for word in ("Theisen", entries()["theisen_2016"]["doi"], entries()["theisen_2016"]["title"]):
        assert word in text
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "Theisen" in readme and entries()["theisen_2016"]["doi"] in readme


def test_the_version_of_the_citation_file_is_that_of_the_package():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_a_module_that_is_not_there_is_named():
    with pytest.raises(ModuleNotFoundError, match=r"reynolds\.oil"):
        cited_by("reynolds.oil")


def run(capsys, *words):
    with pytest.raises(SystemExit) as ended:
        main(["cite", *map(str, words)])
    return ended.value.code or 0, *capsys.readouterr()


def test_a_machine_stands_on_its_data_shaft_film_and_effects(capsys):
    code, out, _ = run(capsys, "dtu_gas_bearing", "--json")
    found = json.loads(out)
    assert code == 0 and {"machine file", "shaft", "film", "injectors", "actuators"} < found["parts"].keys()
    assert found["parts"]["effects.unbalance"] == ["thesis", "friswell_2010"]
    assert {"thesis", "nelson_1980", "hosea_1996", "kuhnen_2003"} <= found["references"].keys()
    code, out, _ = run(capsys, "bently_rk4")
    assert (
        code == 0 and "machine file: nouioua_2026" in out and "film:" not in out and "[nouioua_2026] M. Nouioua" in out
    )


def test_sources_are_printed_as_bibtex(capsys):
    code, out, _ = run(capsys, "plain_rotor", "--bibtex")
    assert code == 0 and out.startswith("@") and out.count("@") == out.count("\n}") > 5


def test_a_law_a_model_and_their_folder_stand_on_what_made_them(tmp_path, capsys):
    law = ROOT / "rotorsim" / "live" / "shipped" / "hinf.json"
    model = ROOT / "rotorsim" / "live" / "shipped" / "rig_model_2.json"
    assert "law hinf: thesis, doyle_1982, skogestad_2005, zhou_1996" in run(capsys, law)[1]
    assert "ljung_1999" in run(capsys, model)[1]
    rs.load_law(law).save(tmp_path / "one.mat")
    rs.load_model(model).save(tmp_path / "two.mat")
    assert run(capsys, tmp_path / "one.mat")[1] == run(capsys, law)[1]
    assert run(capsys, tmp_path / "two.mat")[1] == run(capsys, model)[1]
    for path in (law, model):
        (tmp_path / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    code, out, _ = run(capsys, tmp_path)
    assert code == 0 and "law hinf:" in out and "identification:" in out


def test_a_record_stands_on_its_machine_and_its_experiment(tmp_path, capsys):
    record = rs.experiments.impact(rs.Plant("plain_rotor"), hits=1)
    record.to_netcdf(tmp_path / "impact.nc", engine="h5netcdf")
    code, out, _ = run(capsys, tmp_path / "impact.nc")
    assert code == 0 and "experiment impact: thesis" in out and "shaft: " in out


@pytest.mark.parametrize(("text", "sentence"), [(None, "neither a shipped machine"), ("{}", "kind"), ("[", "")])
def test_what_stands_on_nothing_is_refused_in_a_sentence(tmp_path, capsys, text, sentence):
    path = tmp_path / ("thing.toml" if text is None else "thing.json")
    if text is not None:
        path.write_text(text, encoding="utf-8")
    code, out, err = run(capsys, path)
    assert code == 2 and not out and sentence in err and err.count("\n") == 1 and "Traceback" not in err


def test_a_matlab_file_that_states_no_kind_is_refused(tmp_path, capsys):
    savemat(tmp_path / "mine.mat", {"A": [[0.5]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]], "Ts": 2e-4})
    assert "mine.mat: states neither model nor law" in run(capsys, tmp_path / "mine.mat")[2]


def test_an_entry_names_no_key_that_is_not_printed_with_it():
    """A note of the thesis named its first paper by a key, whose entry was not among those printed."""
    for key, text in references().items():
        assert not [other for other in references() if other != "thesis" and other != key and other in text], key


def test_a_folder_without_results_is_refused(tmp_path, capsys):
    code, _, err = run(capsys, tmp_path)
    assert code == 2 and err.endswith("give a machine, a file or their folder\n")
