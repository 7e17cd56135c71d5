"""A small rig and a plain rotor exported once for all FMU tests; skipped without FMPy or a compiler."""

import importlib.util
import shutil
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from rotorsim.machine import Machine, machine_text
from rotorsim.plant import Plant

sys.path.insert(0, str(Path(__file__).parent))  # for lpv_models.py, which several tests share
PRESSURE = 0.3e6
PROBE = """
[[probes]]
name = "{}"
angle = "{} deg"
quantity = "{}"
{}
"""
PLACE = 'position = "133 mm"'
PROBES = "".join(
    PROBE.format(*row)
    for row in (
        ("DE_x", 45, "relative_displacement", PLACE + '\nsensitivity = "7.87 V/mm"'),
        ("DE_y", 135, "absolute_displacement", PLACE + '\nsense = "-"'),
        ("V", 30, "housing_velocity", ""),
        ("A", 60, "housing_acceleration", 'sensitivity = "100 mV/g"'),
    )
)
SHAKEN = '\n[effects.base_vibration]\nx = "2 m/s^2"\nfrequency = "47 Hz"\n'


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
def exported_plant(gcc, tmp_path_factory):
    """Export of a plant with its speed and pressure: the model and its unit, loaded until the tests end."""
    from fmu.export import choose, export, plant_unit
    from fmu.importer import ImportedUnit

    with ExitStack() as loaded:

        def make(*plant):
            model = plant_unit(*plant)
            files = export(model, tmp_path_factory.mktemp("units") / "unit.fmu", (3,), choose("host"))
            return model, loaded.enter_context(ImportedUnit(files[3]))

        yield make


@pytest.fixture(scope="session")
def probes():
    """Return a machine file's text of probes that turn, are reversed, move with the shaft or stand on the housing."""
    return PROBES


@pytest.fixture(scope="session")
def probed_rotor(exported_plant, probes):
    """Model and loaded unit of a plain rotor with probes on a shaken base, sampled at 50 kHz."""
    machine = Machine.from_text(machine_text("plain_rotor") + SHAKEN + probes)
    return exported_plant(Plant(machine.with_({"solver.sampling_rate": 50e3, "solver.time_step": 2e-5})), 250.0)


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
