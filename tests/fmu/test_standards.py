"""Units and systems against the official schemas and FMPy's validation."""

import io
import zipfile

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
    from xml.etree import ElementTree

    from fmu.linear_units import LawUnit
    from fmu.ssp import DRIVEN, CoupledUnits, write_system

    both = {name: all_files[f"{name} 3"].read_bytes() for name in ("plant", "law")}
    file = write_system(model, LawUnit(scheduled_law()), both, tmp_path / "loop.ssp", 2)
    with zipfile.ZipFile(file) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
        names = {name.split("}")[1] for one in root.iter() for name in [one.tag]}
        sources = [one.get("source") for one in root.iter() if one.get("source")]
        assert set(sources) <= set(archive.namelist()) and len(sources) == 4
        values, mapping = (ElementTree.fromstring(archive.read(f"resources/start.{end}")) for end in ("ssv", "ssm"))
    assert root.get("version") == values.get("version") == mapping.get("version") == "2.0"
    assert "ParameterMapping" in names
    given = {one.get("name") for one in values.iter() if one.tag.endswith("Parameter")}
    assert given == {one.get("source") for one in mapping} and {one.get("target") for one in mapping} == set(DRIVEN)
    system = next(one for one in root if one.tag.endswith("System"))
    outer = {one.get("name") for one in system[0]}
    ends = [one for one in root.iter() if one.tag.endswith("}Connection")]
    open_ends = {one.get("startConnector") for one in ends if not one.get("startElement")}
    open_ends |= {one.get("endConnector") for one in ends if not one.get("endElement")}
    assert set(DRIVEN) < outer == open_ends
    inputs = {"disc.force_x": np.full(50, 5.0)}
    with CoupledUnits(file) as new, CoupledUnits(all_files["system 3"]) as old:
        np.testing.assert_array_equal(new.run(inputs), old.run(inputs))
