"""Control laws as units and plant with law as a system: bit-identical to the Python loop."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from law_models import RATED, TABLE, faulty_inputs, plausible_law, scheduled_law

from fmu.linear_units import ALARM, ANGLE, INPUTS, OUTPUTS, LawUnit, answered
from identification.local.greybox import STRUCTURES
from identification.local.models import LinearModel
from rotorsim.base.errors import DataError
from rotorsim.control import LawError, lqr


@pytest.fixture(scope="module")
def exported(gcc, tmp_path_factory):
    """Return the unit and its files by FMI version."""
    from fmu.export import choose, export

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
def test_a_law_unit_holds_fades_out_and_comes_back_with_the_bits_of_the_law(exported, version):
    """NaN and infinite samples of each input, short and long, also while the law seeks its centre and fades in."""
    from fmu.importer import ImportedUnit

    unit, files = exported
    inputs = {name: unit.stimuli(1200, unit.sample)[name].copy() for name in INPUTS}
    lost = (
        ("meas.disc_x", 15, 3, np.nan),
        ("meas.disc_y", 40, 2, -np.inf),
        ("meas.speed", 100, 1, np.nan),
        ("meas.pressure", 200, 30, np.inf),
        ("meas.disc_x", 400, 300, np.nan),
        ("meas.disc_y", 703, 1, np.nan),
        ("meas.disc_y", 760, 1, 9e99),
    )
    for name, first, count, bad in lost:
        inputs[name][first : first + count] = bad
    law = unit.law.with_()
    codes = [0]
    for x, y, speed, pressure in zip(*inputs.values(), strict=True):
        law.step((x, y), speed, pressure)
        codes.append(law.alarm_code)
    with ImportedUnit(files[version]) as loaded:
        instance = loaded.instance()
        instance.initialise()
        rows = instance.run(inputs, unit.sample, [*OUTPUTS, ALARM])
        instance.close()
    np.testing.assert_array_equal(rows[:, :2], answered(unit.law, inputs))
    np.testing.assert_array_equal(rows[:, 2], codes)
    assert np.isfinite(rows).all() and set(codes) == {0, 1, 2} and not rows[600:700, :2].any()


@pytest.mark.parametrize("runout", [None, TABLE], ids=["", "runout"])
def test_a_law_unit_with_plausibility_limits_has_the_bits_of_the_law(gcc, tmp_path, runout):
    """Spikes, frozen, reversed and swapped sensors, a displacement out of range, lost speed, samples missing often.

    A runout table is taken off before; its angle turns backwards too, is large and gets lost.
    """
    from fmu.export import choose, export
    from fmu.importer import ImportedUnit

    unit = LawUnit(plausible_law().with_(runout=runout))
    inputs = faulty_inputs(12000)
    if runout is not None:
        angle = 1e5 * np.sin(np.arange(12000) / 900.0)
        angle[7000:7003] = np.nan, 9e99, -6e19
        inputs[ANGLE] = angle
        inputs["meas.disc_x"] = inputs["meas.disc_x"] + np.where(
            np.isfinite(angle), runout.at(np.nan_to_num(angle))[:, 0], 0
        )
        inputs["meas.disc_x"][2500:2900] = inputs["meas.disc_x"][2500]
    law, rows = unit.law.with_(), [[0.0, 0.0, 0.0]]
    for x, y, *point in zip(*inputs.values(), strict=True):
        rows.append([*law.step((x, y), *point), law.alarm_code])
    file = export(unit, tmp_path / "law.fmu", (2,), choose("host"))[2]
    with ImportedUnit(file) as loaded:
        instance = loaded.instance()
        instance.initialise()
        found = instance.run(inputs, unit.sample, [*OUTPUTS, ALARM])
        instance.close()
    np.testing.assert_array_equal(found, rows)
    assert {0, 4, 6, 7} | ({5, 12} if runout is None else {13}) <= set(found[:, 2])
    assert set(found[:, 2]) & {8, 9, 10, 11}


@pytest.mark.parametrize("version", [2, 3])
def test_every_check_of_the_command_passes_for_a_law(exported, version):
    from fmu.check import check

    found = list(check(exported[1][version], 0.05))
    assert "0.05 s against the law in Python" in [c.name for c in found]
    assert [c.name for c in found if c.passed is False] == []


def test_a_file_that_is_no_law_is_refused(tmp_path):
    from fmu.export import law_unit

    (tmp_path / "no.json").write_text(json.dumps({"kind": "linear"}))
    with pytest.raises(LawError, match="not a law"):
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
    from fmu.ssp import CoupledUnits

    unit, path = system
    n = 150
    force = np.zeros((n, 2))
    force[30:35, 0] = 15.0
    record = model.plant.simulate(n * 2e-4, 0.0, 0.3e6, disc_force=force, controller=unit.law.with_())
    inputs = {"shaft.speed_ref": np.zeros(n), "injection.pressure": np.full(n, 0.3e6), "disc.force_x": force[:, 0]}
    with CoupledUnits(path) as loop:
        rows = loop.run(inputs, ("disc.x", "disc.y", *OUTPUTS))
    np.testing.assert_array_equal(rows[:n, :2], record.disc.values)
    np.testing.assert_array_equal(rows[:n, 2:], record.reference.values)
    assert np.abs(record.reference.values).max() > 0.1


def test_a_system_hands_the_shaft_angle_to_a_law_with_a_runout_table(gcc, files, model, tmp_path):
    from fmu.export import choose, export
    from fmu.ssp import CoupledUnits, write_system

    unit, n = LawUnit(scheduled_law(bias=(0.5, -0.2), runout=TABLE)), 150
    law = export(unit, tmp_path / "law.fmu", (2,), choose("host"))[2].read_bytes()
    path = write_system(model, unit, {"plant": files[2].read_bytes(), "law": law}, tmp_path / "loop.ssp")
    record = model.plant.simulate(n * 2e-4, 300.0, 0.3e6, controller=unit.law.with_())
    inputs = {"shaft.speed_ref": np.full(n, 300.0), "injection.pressure": np.full(n, 0.3e6)}
    with CoupledUnits(path) as loop:
        rows = loop.run(inputs, OUTPUTS)
    np.testing.assert_array_equal(rows[:n], record.reference.values)
    without = model.plant.simulate(n * 2e-4, 300.0, 0.3e6, controller=unit.law.with_(runout=None))
    assert np.abs(record.reference.values - without.reference.values).max() > 1e-3


def test_fmpy_runs_the_system_from_its_start_values(system):
    """FMPy's own master begins with zeros on every wire, so this is no comparison of trajectories."""
    simulation = pytest.importorskip("fmpy.ssp.simulation")
    path = system[1]
    found = simulation.simulate_ssp(str(path), stop_time=0.02, step_size=2e-4)
    assert len(found) >= 100
    for axis in "xy":
        assert 0 < np.abs(found[f"plant.disc.{axis}"]).max() < 30e-6  # 48 um without supply
        assert 0 < np.abs(found[f"plant.piezo.ref_{axis}"]).max() <= system[0].law.limit
    np.testing.assert_array_equal(found["plant.piezo.ref_x"][1:], found["law.piezo.ref_x"][1:])
    assert found["plant.meas.pressure"][-1] == pytest.approx(0.3e6, rel=0.02)


def test_every_input_of_a_system_is_wired_or_has_a_start_value(system, model):
    from fmpy.ssp.ssd import read_ssd

    read = read_ssd(str(system[1])).system
    assert not read.connectors  # libcosim and ecos refuse connections to a system's own
    plant = next(part for part in read.elements if part.name == "plant")
    given = {p.name: float(p.value) for p in plant.parameterBindings[0].parameterValues[0].parameters}
    wired = {c.endConnector for c in read.connections if c.endElement == "plant"}
    inputs = {v.name: v.start for v in model.variables if v.store == "input" and v.kind == "real"}
    assert set(inputs) == set(given) | wired and not set(given) & wired
    assert given["injection.pressure"] == 0.3e6 and all(given[name] == inputs[name] for name in given)


def test_a_system_names_its_step_where_the_open_simulation_platform_looks_for_it(system):
    import zipfile
    from xml.etree import ElementTree

    with zipfile.ZipFile(system[1]) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    spaces = {
        "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
        "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
        "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    }
    path = "ssd:DefaultExperiment/ssd:Annotations/ssc:Annotation[@type='com.opensimulationplatform']"
    step = root.find(f"{path}/osp:Algorithm/osp:FixedStepAlgorithm", spaces)
    assert step is not None and float(step.get("baseStepSize")) == 2e-4


def test_periods_that_differ_are_refused(model):
    from fmu.ssp import check_periods

    with pytest.raises(DataError, match="the plant samples every"):
        check_periods(model, LawUnit(scheduled_law(Ts=1e-3)))


def test_a_law_designed_on_model_2_with_rates_has_the_bits_of_the_law(gcc, tmp_path):
    from fmu.export import choose, export
    from fmu.importer import ImportedUnit

    model = LinearModel(*STRUCTURES["2-rate"].matrices(np.array(RATED)), speed=0.0, pressure=3e5)
    unit = LawUnit(lqr.design(model, lqr.Spec(speed=0.0, pressure=3e5)))
    file = export(unit, tmp_path / "law.fmu", (3,), choose("host"))[3]
    t = unit.sample * np.arange(4000)  # long enough for the law to come in
    swing = 2e-6 * np.sin(750 * t)
    inputs = dict(zip(INPUTS, (swing, np.roll(swing, 3), 0 * t, 3e5 + 0 * t), strict=True))
    with ImportedUnit(file) as loaded:
        instance = loaded.instance()
        instance.initialise()
        rows = instance.run(inputs, unit.sample, list(OUTPUTS))
        instance.close()
    truth = answered(unit.law, inputs)
    np.testing.assert_array_equal(rows, truth)
    assert np.abs(truth[:, :2]).max() > 0.1


@pytest.fixture(scope="module")
def clocked(gcc, tmp_path_factory):
    """Return the unit of a law with a clock and its file."""
    from fmu.export import choose, export

    unit = LawUnit(scheduled_law(bias=(0.5, -0.2)), clocked=True)
    return unit, export(unit, tmp_path_factory.mktemp("clocked") / "law.fmu", (3,), choose("host"))[3]


def test_a_law_with_a_clock_answers_at_its_ticks_with_the_bits_of_the_law(clocked):
    """While the clock ticks a master may try inputs; the memory moves on once, with the last of them."""
    from fmu.importer import ImportedUnit

    unit, file = clocked
    inputs = {name: unit.stimuli(400, unit.sample)[name] for name in INPUTS}
    truth = answered(unit.law, inputs)[1:]
    with ImportedUnit(file) as loaded:
        instance = loaded.instance()
        instance.initialise()
        slave, found = instance.slave, []
        for k, row in enumerate(zip(*inputs.values(), strict=True)):
            slave.setClock(instance.clocks, [True])
            instance.set(dict.fromkeys(inputs, 1e-6))
            instance.get(OUTPUTS)
            instance.set(dict(zip(inputs, row, strict=True)))
            found.append(instance.get(OUTPUTS))
            slave.updateDiscreteStates()
            assert not slave.getClock(instance.clocks)[0]
            slave.enterStepMode()
            slave.doStep(currentCommunicationPoint=k * unit.sample, communicationStepSize=unit.sample)
            slave.enterEventMode()
        instance.close()
    np.testing.assert_array_equal(found, truth)


def test_the_host_of_the_docs_gets_the_bits_of_the_law(clocked):
    unit, file = clocked
    page = (Path(__file__).parents[2] / "docs" / "fmu.md").read_text(encoding="utf-8")
    [text] = [one for one in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "law.clock" in one]
    shown = {}
    exec(compile(text.replace('"law.fmu"', repr(str(file))), "fmu.md", "exec"), shown)
    rows = np.tile([0.0, 0.0, 300.0, 0.5e6], (500, 1))
    rows[:, 0] = 1e-6 * np.sin(0.1 * np.arange(500))
    truth = answered(unit.law, dict(zip(INPUTS, rows.T, strict=True)))[1:, :2]
    np.testing.assert_array_equal(shown["answers"], truth)


def test_every_check_of_the_command_passes_for_a_law_with_a_clock(clocked):
    from fmu.check import check

    assert [c.name for c in check(clocked[1], 0.05) if c.passed is False] == []


def test_a_law_with_a_clock_refuses_steps_over_a_tick_and_masters_without_events(clocked):
    from fmu.importer import ImportedUnit

    with ImportedUnit(clocked[1]) as loaded:
        with pytest.raises(DataError):
            loaded.instance(eventModeUsed=False)
        instance = loaded.instance()
        instance.initialise()
        instance.slave.enterStepMode()
        with pytest.raises(Exception, match="fmi3SetClock"):
            instance.slave.setClock(instance.clocks, [True])
        with pytest.raises(Exception, match="fmi3DoStep"):
            instance.slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=4e-4)
        assert instance.messages[-1].startswith("communication step = 0.0004 s: law.clock ticks")
        instance.close()


def test_what_has_no_clock_is_refused(model, tmp_path, clocked):
    from fmu.export import choose, clocked as ticking, export

    with pytest.raises(DataError) as refused:
        ticking(model)
    assert refused.value.argument == "clocked"
    with pytest.raises(DataError) as refused:
        export(clocked[0], tmp_path / "law.fmu", (2, 3), choose("host"))
    assert refused.value.argument == "clocked"
