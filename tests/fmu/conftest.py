"""A small rig exported once for all FMU tests; skipped without FMPy or a compiler."""

import importlib.util
import shutil
import sys
from pathlib import Path

import pytest

from rotorsim.plant import Plant

sys.path.insert(0, str(Path(__file__).parent))  # for lpv_models.py, which several tests share
PRESSURE = 0.3e6


@pytest.fixture(scope="session")
def importer() -> None:
    """Skip without FMPy."""
    if not importlib.util.find_spec("fmpy"):
        pytest.skip("fmpy is not installed: pip install fmpy")


@pytest.fixture(scope="session")
def gcc(importer) -> str:
    """Return gcc's path; skip without it (FMPy carries the headers)."""
    found = shutil.which("gcc")
    if not found:
        pytest.skip("gcc is not installed")
    return found


@pytest.fixture(scope="session")
def model():
    """Return the model of the rig on a coarse grid, at rest at 0.3 MPa."""
    from fmu.export import plant_unit

    return plant_unit(Plant("dtu_gas_bearing", n_theta=16, n_z=8, dt=2e-4), 0.0, PRESSURE)


@pytest.fixture(scope="session")
def files(gcc, model, tmp_path_factory) -> dict[int, Path]:
    """Return the unit's files by FMI version."""
    from fmu.export import choose, export

    return export(model, tmp_path_factory.mktemp("units") / "rig.fmu", (2, 3), choose("host"))


@pytest.fixture(scope="session")
def units(files):
    """Return the loaded units by FMI version."""
    from fmu.importer import ImportedUnit

    loaded = {version: ImportedUnit(path) for version, path in files.items()}
    yield loaded
    for unit in loaded.values():
        unit.__exit__(None, None, None)


@pytest.fixture(params=[2, 3])
def unit(units, request):
    """Return a loaded unit, of FMI 2.0 and of 3.0."""
    return units[request.param]


@pytest.fixture
def fresh(unit):
    """Return a new instance, not initialised; it is freed at the end."""
    instance = unit.instance()
    yield instance
    instance.slave.freeInstance()


@pytest.fixture
def running(fresh):
    """Return an initialised instance."""
    fresh.initialise()
    return fresh
