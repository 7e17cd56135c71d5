"""Control laws as units, and plant and law as a system: the bits of the loop in Python."""

import json

import numpy as np
import pytest

from fmu.law_unit import INPUTS, OUTPUTS, LawUnit, answered
from rotorsim.control import Law, LawError
from rotorsim.errors import DataError


def scheduled_law(**settings):
    """A law of three states over 3 x 2 operating points that winds up, saturates, seeks its centre and fades in."""
    rng = np.random.default_rng(4)
    shapes = {"A": (3, 3), "B": (3, 2), "C": (2, 3), "D": (2, 2), "W": (3, 2)}
    matrices = {name: rng.normal(size=(3, 2, *shape)) for name, shape in shapes.items()}
    matrices["A"] *= 0.3
    matrices["B"] *= 1e4
    matrices["D"] *= 2e5
    axes = {"speeds": [0.0, 300.0, 600.0], "pressures": [3e5, 7e5]}
    return Law(
        "trial",
        **matrices,
        **axes,
        **{"refresh": 7, "average": 0.004, "fade": 0.006, "start": 0.002, "limit": 0.6} | settings,
    )


@pytest.fixture(scope="module")
def exported(gcc, tmp_path_factory):
    """Return the unit and its files by FMI version."""
    from fmu.export import export
    from fmu.targets import choose

    unit = LawUnit(scheduled_law(bias=(0.5, -0.2)))
    return unit, export(unit, tmp_path_factory.mktemp("law") / "law.fmu", (2, 3), choose("host"))


@pytest.mark.parametrize("version", [2, 3])
def test_a_law_unit_has_the_bits_of_the_law(exported, version):
    from fmu.importer import ImportedUnit

    unit, files = exported
    inputs = {name: unit.stimuli(400, unit.sample)[name] for name in INPUTS}
    truth = answered(unit.law, inputs)
    with ImportedUnit(files[version]) as loaded:
        instance = loaded.instance()
        instance.initialise()
        rows = instance.run(inputs, unit.sample, list(OUTPUTS))
        instance.close()
    np.testing.assert_array_equal(rows, truth)
    assert np.abs(truth).max() == unit.law.limit  # it saturates
    assert not truth[:20].any()
    assert np.ptp(truth[60:], axis=0).min() > 0.1


@pytest.mark.parametrize("version", [2, 3])
def test_every_check_of_the_command_passes_for_a_law(exported, version):
    from fmu.check import check

    found = list(check(exported[1][version], 0.05))
    assert "0.05 s against the law in Python" in [c.name for c in found]
    assert [c.name for c in found if not c.passed and "doStep" not in c.name and "load" not in c.name] == []


def test_a_file_that_is_no_law_is_refused(tmp_path):
    from fmu.kinds import law_unit

    (tmp_path / "no.json").write_text(json.dumps({"kind": "linear"}))
    with pytest.raises(LawError, match="is no law"):
        law_unit(tmp_path / "no.json")


@pytest.fixture(scope="module")
def system(exported, files, model, tmp_path_factory):
    """Return the law's unit and an .ssp file of it and the coarse rig."""
    from fmu.ssp import write_system

    unit, laws = exported
    units = {"plant": files[2].read_bytes(), "law": laws[2].read_bytes()}
    return unit, write_system(model, unit, units, tmp_path_factory.mktemp("system") / "loop.ssp")


def test_a_system_keeps_the_standards_schema_and_wires_all_that_the_law_needs(system):
    ssd = pytest.importorskip("fmpy.ssp.ssd")

    read = ssd.read_ssd(str(system[1]))  # validates
    wires = {(c.startElement, c.startConnector, c.endElement) for c in read.system.connections}
    assert {("plant", name, "law") for name in INPUTS} | {("law", name, "plant") for name in OUTPUTS} <= wires


def test_a_system_runs_the_loop_of_python_bit_for_bit(system, model):
    from fmu.ssp import System

    unit, path = system
    n = 150
    force = np.zeros((n, 2))
    force[30:35, 0] = 15.0
    record = model.plant.simulate(n * 2e-4, 0.0, 0.3e6, disc_force=force, controller=unit.law.with_())
    inputs = {"shaft.speed_ref": np.zeros(n), "injection.pressure": np.full(n, 0.3e6), "disc.force_x": force[:, 0]}
    with System(path) as loop:
        rows = loop.run(inputs, ("disc.x", "disc.y", *OUTPUTS))
    np.testing.assert_array_equal(rows[:n, :2], record.disc.values)
    np.testing.assert_array_equal(rows[:n, 2:], record.reference.values)
    assert np.abs(record.reference.values).max() > 0.1


def test_another_importer_runs_the_system(system):
    """FMPy's own master begins with zeros on every wire, so this is no comparison of trajectories."""
    simulation = pytest.importorskip("fmpy.ssp.simulation")
    path = system[1]
    signals = {"shaft.speed_ref": lambda t: 0.0, "injection.pressure": lambda t: 0.3e6, "disc.force_x": lambda t: 0.0,
               "disc.force_y": lambda t: 0.0}  # fmt: skip
    found = simulation.simulate_ssp(str(path), stop_time=0.02, step_size=2e-4, input=signals)
    assert len(found) >= 100
    for axis in "xy":
        assert np.all(np.isfinite(found[f"plant.disc.{axis}"]))
        assert 0 < np.abs(found[f"plant.piezo.ref_{axis}"]).max() <= system[0].law.limit
    np.testing.assert_array_equal(found["plant.piezo.ref_x"][1:], found["law.piezo.ref_x"][1:])


def test_periods_that_differ_are_refused():
    from fmu.ssp import check_periods

    with pytest.raises(DataError, match="the plant samples every"):
        check_periods(LawUnit(scheduled_law(Ts=1e-3)))
