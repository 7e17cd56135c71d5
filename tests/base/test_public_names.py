"""Public surface: every name of the packages loads, is listed, and a misspelt one gets the nearest."""

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import identification as idn
import rotorsim as rs
from rotorsim.base import public as public_names
from rotorsim.base.public import _listed

PACKAGES = [name for name in dir(rs) if isinstance(getattr(rs, name), ModuleType)]
HEAVY = ("numpy", "xarray", "numba", "control", "pyvista", "vtk", "vtkmodules", "fmpy", "plotly", "pint", "pandas")

FEW = 80
"""New modules with which the import of `rotorsim` takes some hundredths of a second."""


def public(name):
    """A package below `rs` by its name."""
    return getattr(rs, name)


def test_the_packages_that_users_reach_for_are_there():
    assert {"control", "analysis", "report", "discrepancy", "campaign", "experiments", "verify", "balance", "live",
            "machine", "plant", "errors", "signals", "effects", "fmu", "identification", "fe_shaft",
            "reynolds", "study", "desk"} == set(PACKAGES)  # fmt: skip


@pytest.mark.parametrize("name", PACKAGES)
def test_every_listed_name_of_a_package_loads(name):
    package = public(name)
    assert dir(package) == sorted(package.__all__) and dir(package)
    assert all(getattr(package, one) is not None for one in dir(package))


def test_identification_lists_what_its_users_call():
    assert {"identify", "fit_lpv", "load_model", "read"} <= set(dir(rs.identification))


@pytest.mark.parametrize("name", PACKAGES)
def test_a_module_of_the_same_name_never_stands_in_the_place_of_a_public_name(name):
    """`rotorsim.analysis.campbell` is a function, whether or not its module was imported before."""
    package = public(name)
    files = {one.name for one in pkgutil.iter_modules(getattr(package, "__path__", []))}
    twice = sorted(files & {one for one in dir(package) if not isinstance(getattr(package, one), ModuleType)})
    program = (
        f"import {package.__name__} as package; from importlib import import_module; from types import ModuleType\n"
    )
    program += f"for one in {twice!r}: import_module(f'{package.__name__}.{{one}}')\n"
    program += f"assert not any(isinstance(getattr(package, one), ModuleType) for one in {twice!r})"
    subprocess.run([sys.executable, "-c", program], check=True)
    assert twice or name not in ("analysis", "verify")


@pytest.mark.parametrize(
    ("package", "name", "near"),
    [
        ("rotorsim", "controls", "control"),
        ("rotorsim", "load_machin", "load_machine"),
        ("rotorsim", "LinearPlant", "rotorsim.plant.LinearPlant"),
        ("rotorsim", "DataError", "rotorsim.errors.DataError"),
        ("rotorsim", "safe_sped", "rotorsim.verify.safe_speed"),
        ("rotorsim.analysis", "operating_mp", "operating_map"),
        ("rotorsim.effects", "REGISTER", "REGISTRY"),
        ("identification", "identif", "identify"),
        ("fe_shaft", "Roto", "Rotor"),
    ],
)
def test_a_misspelt_name_gets_the_nearest_in_one_sentence(package, name, near):
    with pytest.raises(AttributeError, match=f"^{package} has no '{name}'; did you mean '{near}'\\?$"):
        getattr(importlib.import_module(package), name)


def test_the_hint_knows_the_names_of_every_package_without_its_import():
    for name in PACKAGES:
        assert sorted(_listed(public(name).__name__)) == dir(public(name)), name


def test_the_import_of_a_module_from_a_package_looks_for_no_similar_name(monkeypatch):
    def look(*names):
        raise AssertionError("looked for a similar name")

    monkeypatch.setattr(public_names, "closest", look)
    with pytest.raises(AttributeError):
        public_names.refuse("reynolds", "film", ["GasBearing"])
    with pytest.raises(AssertionError):
        public_names.refuse("reynolds", "filn", ["GasBearing"])


def test_a_name_like_no_other_points_to_the_list():
    with pytest.raises(AttributeError, match=r"^rotorsim has no 'qqq'; dir\(rotorsim\) lists its names$"):
        rs.qqq  # noqa: B018


def test_the_import_is_silent_and_loads_few_modules_and_no_heavy_package():
    program = f"""import sys
before = set(sys.modules)
import rotorsim
assert len(set(sys.modules) - before) < {FEW}, sorted(set(sys.modules) - before)
print(*sorted(set({HEAVY!r}) & set(sys.modules)))"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (ran.stdout, ran.stderr) == ("\n", "")


def test_a_machine_imports_the_effects_that_it_has_and_an_experiment_its_own_file():
    code = (
        "import sys, rotorsim as rs; machine = rs.load_machine('dtu_gas_bearing'); rs.experiments.EXPERIMENTS['prbs']; "
        "print(*machine.effects); print(*(n for n in sys.modules if n.count('.') == 3))"
    )
    given, loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    effects = {name.rpartition(".")[2] for name in loaded.split() if name.startswith("rotorsim.effects.")}
    assert set(given.split()) <= effects and "crack" in rs.effects.REGISTRY and "crack" not in effects
    experiments = {name for name in loaded.split() if name.startswith("rotorsim.experiments.catalogue.")}
    assert experiments == {"rotorsim.experiments.catalogue.prbs"} and len(rs.experiments.EXPERIMENTS) > 5


def test_a_registry_lists_what_it_has_not_imported():
    known = public_names.Registry(public_names.modules_below("identification", Path(idn.__file__).parent))
    assert "writers" in known and len(known) == len(set(known)) > 5 and known.get("nothing") is None
    with pytest.raises(KeyError):  # a module that registers nothing under its name
        known["writers"]
    known["own"] = 1
    assert known.pop("own") == 1 and "own" not in known and list(known)[-1] != "own"


def test_every_public_call_and_class_has_a_docstring():
    for name in ["", *PACKAGES]:
        package = public(name) if name else rs
        for one in dir(package):
            value = getattr(package, one)
            if callable(value):
                assert value.__doc__, f"{package.__name__}.{one}"


@pytest.mark.parametrize("package", ["rotorsim", "identification", "fe_shaft", "reynolds", "fmu"])
def test_the_packages_say_that_they_are_typed(package):
    assert (Path(__file__).parents[2] / package / "py.typed").exists()


def test_the_version_is_that_of_the_package():
    from importlib.metadata import version

    assert rs.__version__ == version("rotorsim")


def test_values_of_a_machine_are_given_as_a_mapping_or_by_name():
    machine, values = rs.load_machine("dtu_gas_bearing"), {"effects.unbalance.me": 1.2e-5}
    assert machine.with_(**values) == machine.with_(values) != machine


@pytest.mark.parametrize("name", ["fe_shaft", "fmu", "identification", "reynolds"])
def test_a_users_file_with_the_name_of_a_package_is_named_and_no_traceback(name, tmp_path):
    (tmp_path / f"{name}.py").write_text("", encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "-m", "rotorsim", "--version"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ended.returncode == 2 and ended.stdout == ""
    (sentence,) = ended.stderr.splitlines()
    assert sentence.startswith(str(tmp_path / f"{name}.py")) and "rename" in sentence
    script = tmp_path / "script.py"
    script.write_text("import rotorsim", encoding="utf-8")
    ended = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 1 and ended.stderr.splitlines()[-1] == f"ImportError: {sentence}"
