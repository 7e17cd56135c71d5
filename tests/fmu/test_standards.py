"""Units and systems against the official schemas and FMPy's validation."""

import io
import zipfile
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from law_models import scheduled_law
from lpv_models import make_lpv

from fmu.check import findings

KINDS = ("1", "2", "3", "blackbox")


@pytest.fixture(scope="session")
def all_files(files, model, tmp_path_factory):
    """Return every kind of unit and system by name, of FMI 2.0 and 3.0."""
    from fmu.export import choose, export, linear_unit
    from fmu.linear_units import LawUnit
    from fmu.ssp import write_system

    folder, host = tmp_path_factory.mktemp("kinds"), choose("host")
    law = LawUnit(scheduled_law())
    made = {f"plant {v}": path for v, path in files.items()}
    made |= {f"law {v}": path for v, path in export(law, folder / "law.fmu", (2, 3), host).items()}
    for kind in KINDS:
        make_lpv(kind).save(folder / f"{kind}.json")
        unit = linear_unit(folder / f"{kind}.json")
        made |= {f"linear {kind} {v}": p for v, p in export(unit, folder / f"{kind}.fmu", (2, 3), host).items()}
    for v in (2, 3):
        both = {name: made[f"{name} {v}"].read_bytes() for name in ("plant", "law")}
        made[f"system {v}"] = write_system(model, law, both, folder / f"loop{v}.ssp")
    return made


UNITS = [f"{kind} {v}" for kind in ("plant", "law", *(f"linear {k}" for k in KINDS)) for v in (2, 3)]


@pytest.mark.parametrize("name", [*UNITS, "system 2", "system 3"])
def test_the_official_schemas_find_nothing(all_files, name):
    assert findings(all_files[name]) == []


@pytest.mark.parametrize("name", UNITS)
def test_fmpy_finds_no_problem(all_files, name):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(all_files[name])) == []


@pytest.mark.parametrize(
    ("name", "file", "old", "new"),
    [
        ("plant 2", "modelDescription.xml", b' guid="', b' token="'),
        ("plant 3", "modelDescription.xml", b' instantiationToken="', b' guid="'),
        ("law 3", "terminalsAndIcons/terminalsAndIcons.xml", b' suggestedScalingFactorTo_mm="0.1"', b""),
        ("law 3", "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml", b"fmi-ls:fmi-ls-version=", b"version="),
        ("system 2", "SystemStructure.ssd", b' startConnector="meas.disc_x"', b""),
        ("system 2", "SystemStructure.ssd", b' value="300000.0"', b' value="much"'),
    ],
)
def test_the_schemas_find_what_is_broken(all_files, tmp_path, name, file, old, new):
    broken = io.BytesIO()
    with zipfile.ZipFile(all_files[name]) as given, zipfile.ZipFile(broken, "w") as copy:
        for entry in given.namelist():
            content = given.read(entry)
            assert entry != file or old in content
            copy.writestr(entry, content.replace(old, new) if entry == file else content)
    (tmp_path / "broken").write_bytes(broken.getvalue())
    found = findings(tmp_path / "broken")
    assert found and all(file in sentence for sentence in found)


def test_a_system_of_ssp_2_has_connectors_and_start_values_in_files_of_their_own(all_files, model, tmp_path):
    """Its schemas come with pyssp-standard alone, of the nightly job on importers; here every reference is followed."""

    from fmu.linear_units import LawUnit
    from fmu.ssp import DRIVEN, CoupledUnits, write_system

    both = {name: all_files[f"{name} 3"].read_bytes() for name in ("plant", "law")}
    started = replace(model, speed=200.0, pressure=0.5e6)  # its units start at 0 and 0.3 MPa by themselves
    file = write_system(started, LawUnit(scheduled_law()), both, tmp_path / "loop.ssp", 2)
    [sentence] = findings(file)
    assert "SystemStructure.ssd" in sentence and "SSP 2.0" in sentence
    read = read_system(file)
    assert set(DRIVEN) == {name for element, name in read["start"] if element == "plant"}
    n = 50
    inputs = {"shaft.speed_ref": np.full(n, 200.0), "injection.pressure": np.full(n, 0.5e6)}
    force, shown = {"disc.force_x": np.full(n, 5.0)}, ("disc.x", "disc.y")
    with CoupledUnits(all_files["system 3"]) as old:
        truth, at_rest = (old.run(given | force, shown) for given in (inputs, {}))
    found = played(read, tmp_path, force, shown)
    assert np.array_equal(found, truth) and not np.array_equal(found, at_rest)


def read_system(file):
    """Units, start values by element and variable, and connections of a system, as its files state them."""
    from xml.etree import ElementTree

    def tagged(root, tag):
        return [one for one in root.iter() if one.tag.endswith("}" + tag)]

    with zipfile.ZipFile(file) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    root = ElementTree.fromstring(files["SystemStructure.ssd"])
    assert root.get("version") == "2.0"
    units, start = {}, {}
    for part in tagged(root, "Component"):
        units[part.get("name")] = files[part.get("source")]
        for binding in tagged(part, "ParameterBinding"):
            values, mapping = (
                ElementTree.fromstring(files[one.get("source")])
                for one in (binding, *tagged(binding, "ParameterMapping"))
            )
            given = {one.get("name"): float(one[0].get("value")) for one in tagged(values, "Parameter")}
            for entry in tagged(mapping, "MappingEntry"):
                start[part.get("name"), entry.get("target")] = given[entry.get("source")]
    keys = ("startElement", "startConnector", "endElement", "endConnector")
    wires = [tuple(one.get(key) for key in keys) for one in tagged(root, "Connection")]
    outer = tagged(root, "System")[0][0]
    kinds = {one.get("name"): one.get("kind") for one in outer}
    assert {name for name, kind in kinds.items() if kind == "input"} == {b for a, b, _, _ in wires if a is None}
    assert {name for name, kind in kinds.items() if kind == "output"} == {b for _, _, a, b in wires if a is None}
    return {"units": units, "start": start, "wires": wires}


def played(read, folder, inputs, outputs):
    """Outputs (n + 1, outputs) of a system for inputs (n,), both at its own connectors, over its own wires alone."""
    from fmu.importer import ImportedUnit

    with ExitStack() as stack:
        parts = {}
        for name, data in read["units"].items():
            (folder / f"{name}.fmu").write_bytes(data)
            parts[name] = stack.enter_context(ImportedUnit(folder / f"{name}.fmu")).instance(name)
        for name, part in parts.items():
            part.initialise({v: x for (element, v), x in read["start"].items() if element == name})
        rows = []
        for k in range(len(next(iter(inputs.values()))) + 1):
            for element, name, to, target in read["wires"]:
                if element and to:
                    parts[to].set({target: parts[element].get([name])[0]})
                elif to and name in inputs and k < len(inputs[name]):
                    parts[to].set({target: inputs[name][k]})
            ends = {target: parts[element].get([name])[0] for element, name, to, target in read["wires"] if not to}
            rows.append([ends[name] for name in outputs])
            if k < len(next(iter(inputs.values()))):
                for part in parts.values():
                    part.step(k * 2e-4, 2e-4)
        for part in parts.values():
            part.close()
    return np.array(rows)
