"""Plant unit bit-identical to the Python plant through FMPy, in FMI 2.0 and 3.0, for any communication step."""

import importlib

import numpy as np
import pytest
from law_models import scheduled_law
from lpv_models import make_lpv

from fmu.check import plant_outputs, plant_rows, run
from fmu.export import choose, export
from fmu.importer import ImportedUnit, reference_inputs
from fmu.linear_units import LawUnit, LinearUnit

SAMPLE = 2e-4


def busy(model, n, step):
    """Run-up, steps of pressure and reference, a hit, and the drive off at the end."""
    inputs = reference_inputs(model, n, step)
    inputs["drive.on"][-n // 5 :] = 0.0
    return inputs


@pytest.mark.parametrize(("step", "n"), [(SAMPLE, 600), (5 * SAMPLE, 150)])
def test_a_run_of_the_unit_has_the_bits_of_the_python_plant(unit, running, model, step, n):
    inputs = busy(model, n, step)
    truth = plant_outputs(model, inputs, step)
    rows = running.run(inputs, step, list(truth))
    assert {"disc.x", "meas.disc_x", "meas.speed", "film.h_min", "piezo.position_4", "film.touchdown"} <= set(truth)
    for k, (name, (values, good)) in enumerate(truth.items()):
        assert good.sum() > 0.9 * n, name
        assert values[good].tobytes() == rows[good, k].tobytes(), name


def test_the_first_outputs_are_those_of_the_equilibrium_at_the_values_set(unit, fresh, model):
    speed, pressure, me = 300.0, 0.4e6, 1e-5
    fresh.initialise({"shaft.speed_ref": speed, "injection.pressure": pressure, "effects.unbalance.me": me})
    rest = model.plant.equilibrium(speed, pressure)
    found = fresh.get(["disc.x", "disc.y", "bearing.x", "bearing.y", "film.h_min", "shaft.speed"])
    assert found == pytest.approx([*rest.disc, *rest.journal, rest.h_min, speed], rel=1e-12, abs=1e-18)
    assert fresh.get(["effects.unbalance.me"])[0] == me


def test_outputs_read_before_initialisation_ends_are_those_after_it(unit, model):
    instance = unit.instance()
    s = instance.slave
    if not unit.is_3:
        s.setupExperiment(startTime=0.0)
    s.enterInitializationMode()
    instance.set({"shaft.speed_ref": 100.0})
    early = instance.get(["disc.x", "disc.y", "meas.disc_x"])
    instance.set({"injection.pressure": 0.5e6})
    later = instance.get(["disc.x", "disc.y", "meas.disc_x"])
    s.exitInitializationMode()
    assert later.tobytes() == instance.get(["disc.x", "disc.y", "meas.disc_x"]).tobytes() != early.tobytes()
    s.freeInstance()


def test_a_parameter_set_in_the_unit_acts_as_in_the_machine_file(unit, fresh, model):
    from fmu.export import plant_unit
    from rotorsim.plant import Plant

    machine = model.plant.machine.replace("effects.unbalance.me", "12 g*mm").replace("effects.creep.gain", 0.05)
    other = plant_unit(Plant(machine), 0.0, 0.3e6)
    inputs = busy(model, 200, SAMPLE)
    truth = plant_outputs(other, inputs, SAMPLE)
    fresh.initialise({"effects.unbalance.me": 12e-6, "effects.creep.gain": 0.05})
    rows = fresh.run(inputs, SAMPLE, ["disc.x", "disc.y"])
    assert rows[:, 0].tobytes() == truth["disc.x"][0].tobytes()


def test_hits_on_the_sleeve_have_the_bits_of_the_python_plant(unit, fresh, model):
    """Near contact a step follows its error: it is repeated as smaller ones in the unit as in the plant."""
    from fmu.export import plant_unit
    from rotorsim.plant import Plant
    from rotorsim.plant.simulation import Simulation

    other = plant_unit(Plant(model.plant.machine.replace("effects.unbalance.me", "60 g*mm")), 0.0, 0.3e6)
    inputs = busy(model, 300, SAMPLE)
    inputs["shaft.speed_ref"] += 600.0
    inputs["disc.force_x"][50:60], inputs["disc.force_y"][150:160] = 250.0, -300.0
    truth = plant_outputs(other, inputs, SAMPLE)
    fresh.initialise({"effects.unbalance.me": 60e-6})
    rows = fresh.run(inputs, SAMPLE, list(truth))
    run = Simulation.at_equilibrium(other.assembly, other.speed, other.pressure)
    run.advance(plant_rows(other, inputs, SAMPLE))
    assert truth["film.touchdown"][0].any() and run.counters["substeps"] > 20
    for k, (name, (values, good)) in enumerate(truth.items()):
        assert values[good].tobytes() == rows[good, k].tobytes(), name


def test_the_film_pressure_is_an_array_in_fmi_3(units, model):
    inputs = busy(model, 50, SAMPLE)
    instance = units[3].instance()
    instance.initialise()
    instance.run(inputs, SAMPLE, ["disc.x"])
    simulation = model.plant.start(0.0, 0.3e6)
    from fmu.check import plant_rows

    simulation.advance(plant_rows(model, inputs, SAMPLE))
    assert instance.film_pressure().tobytes() == simulation.film_pressure().tobytes()
    assert instance.film_pressure().shape == (16, 8)
    instance.close()


def test_friction_torque_and_pin_differences_follow_from_the_state(units, model):
    from reynolds.kernels import friction_torque

    inputs = busy(model, 50, SAMPLE)
    inputs["drive.on"][:] = 1.0
    instance = units[3].instance()
    instance.initialise()
    rows = instance.run(
        inputs, SAMPLE, ["film.friction_torque", "piezo.diff_x", "piezo.position_2", "piezo.position_4"]
    )
    simulation = model.plant.start(0.0, 0.3e6)
    from fmu.check import plant_rows

    simulation.advance(plant_rows(model, inputs, SAMPLE))
    a = model.assembly
    torque = friction_torque(simulation.w, a.P.film_0, a.film, simulation.w[a.rotor.speed])
    assert rows[-1, 0] == pytest.approx(torque, rel=1e-12)
    assert rows[-1, 1] == pytest.approx(rows[-1, 2] - rows[-1, 3], abs=1e-18)
    instance.close()


def test_a_master_that_counts_integer_nanoseconds_changes_no_bit(unit, model):
    inputs = busy(model, 100, SAMPLE)
    tables = []
    for nanoseconds in (False, True):
        instance = unit.instance()
        instance.initialise()
        rows = []
        for k in range(100):
            instance.set({name: float(values[k]) for name, values in inputs.items()})
            now = (k * 200_000) * 1e-9 if nanoseconds else k * SAMPLE
            instance.step(now, 200_000 * 1e-9 * (1 + 1e-9 * nanoseconds))
            rows.append(instance.get(["disc.x", "meas.disc_y"]))
        tables.append(np.array(rows))
        instance.close()
    assert tables[0].tobytes() == tables[1].tobytes()


def test_bounded_steps_have_the_bits_of_python_and_show_their_work(exported_plant):
    from fmu.export import CORRECTIONS, bounded
    from rotorsim.plant import Plant

    plant = bounded(Plant("dtu_gas_bearing", n_theta=16, n_z=8, dt=SAMPLE))
    _, unit = exported_plant(plant, 600.0, 0.3e6)
    n = 400
    inputs = {"disc.force_x": np.where(np.arange(n) % 100 == 50, 1500.0, 0.0), "piezo.ref_x": np.full(n, 5.0)}
    instance = unit.instance()
    instance.initialise()
    names = ["disc.x", "film.h_min", "solver.error_left", "solver.corrections", "solver.overruns"]
    rows = instance.run(inputs, SAMPLE, names)
    instance.close()
    simulation = plant.start(600.0, 0.3e6)
    table = simulation.advance(np.stack([[600.0, 0.3e6, 5.0, 0.0, f, 0.0] for f in inputs["disc.force_x"]]))
    assert rows[:-1, 0].tobytes() == table[:, 0].tobytes()
    counters = simulation.counters
    assert 0 < rows[-1, 4] == counters["overruns"]
    assert rows[:, 3].sum() == counters["iterations"] + 10 * counters["factorisations"]
    assert rows[:, 3].max() <= CORRECTIONS
    assert ((rows[1:, 2] > 0) == (np.diff(rows[:, 4]) > 0)).all()


@pytest.mark.parametrize("subject", [["--law", "law.json"], ["--model", "lpv.json"]])
def test_laws_and_models_refuse_to_be_bounded(subject, capsys):
    from rotorsim.cli import main

    with pytest.raises(SystemExit) as ended:
        main(["fmu", "export", *subject, "--real-time"])
    assert ended.value.code == 2 and "--real-time" in capsys.readouterr().err


BETWEEN = {
    "plant": ("disc.force_x", 20.0, "disc.x"),
    "linear": ("piezo.ref_x", 1.0, "disc.x"),
    "sampled": ("piezo.ref_x", 1.0, "disc.x"),
    "law": ("meas.disc_x", 1e-5, "piezo.ref_x"),
}
"""Input that is moved in each kind of unit, its value, and the output that is read between samples."""


@pytest.fixture(scope="module", params=BETWEEN)
def between(request, units, tmp_path_factory):
    """A loaded unit of each kind, and what is moved and read in it."""
    if request.param == "plant":
        yield units[3], *BETWEEN["plant"]
        return
    kind = {"linear": "2", "sampled": "blackbox"}.get(request.param)
    law = LawUnit(scheduled_law(average=0.0, start=0.0, fade=2e-4), speed=300.0, pressure=5e5)
    unit = LinearUnit(make_lpv(kind), "bearing", 300.0, 5e5) if kind else law
    file = export(unit, tmp_path_factory.mktemp("between") / "unit.fmu", (3,), choose("host"))[3]
    with ImportedUnit(file) as loaded:
        yield loaded, *BETWEEN[request.param]


@pytest.fixture
def stepped(between):
    """A function that plays a step of five samples with a callback between them: what it showed, the time reached."""
    from fmpy.fmi3 import FMU3Slave, fmi3IntermediateUpdateCallback

    unit, moved, value, read = between
    force, x = (unit.variables[name].valueReference for name in (moved, read))

    def play(answer, early):
        d = unit.description
        slave = FMU3Slave(
            guid=d.guid,
            unzipDirectory=unit.folder,
            modelIdentifier=d.coSimulation.modelIdentifier,
            instanceName="between",
        )
        shown = []

        def update(environment, time, may_set, may_get, finished, may_return, asked, until):
            shown.append((time, slave.getFloat64([x])[0], may_return))
            answer(slave, len(shown), asked, until)

        slave.instantiate(earlyReturnAllowed=early, intermediateUpdate=fmi3IntermediateUpdateCallback(update))
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slave.setFloat64([force], [value])
        _, _, returned, reached = slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=5 * SAMPLE)
        shown.append((reached, slave.getFloat64([x])[0], returned))
        slave.freeInstance()
        return shown

    return play


def test_outputs_between_samples_are_those_of_single_steps(between, stepped):
    unit, moved, value, read = between
    shown = stepped(lambda *_: None, False)
    instance, rows = unit.instance(), []
    instance.initialise()
    instance.set({moved: value})
    for k in range(5):
        instance.step(k * SAMPLE, SAMPLE)
        rows.append(instance.get([read])[0])
    instance.close()
    assert [value for _, value, _ in shown] == rows and len(set(rows)) > 1
    assert [time for time, _, _ in shown] == pytest.approx(SAMPLE * np.arange(1, 6), rel=1e-12)


@pytest.mark.parametrize(("until", "samples"), [(2.0, 2), (2.5, 3), (0.0, 2)])
def test_a_master_ends_a_step_at_the_sample_that_it_asks_for(stepped, until, samples):
    def ask(slave, number, asked, time):
        if number == 2:
            asked[0], time[0] = True, until * SAMPLE

    shown = stepped(ask, True)
    assert shown[-1][0] == pytest.approx(samples * SAMPLE, rel=1e-12) and shown[-1][2]
    assert stepped(ask, False)[-1][0] == pytest.approx(5 * SAMPLE, rel=1e-12)  # it must not


def test_within_a_step_a_master_may_read_and_nothing_else(stepped):
    refused = []

    def misuse(slave, number, asked, time):
        calls = (
            slave.reset,
            slave.getFMUState,
            slave.terminate,
            lambda: slave.setFloat64([1], [1.0]),
            lambda: slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=SAMPLE),
        )
        for call in calls:
            with pytest.raises(Exception, match="fmi3"):
                call()
            refused.append(call)

    assert stepped(misuse, False) == stepped(lambda *_: None, False) and len(refused) == 20


@pytest.mark.slow
def test_a_unit_with_a_users_force_that_remembers_the_motion_has_the_bits_of_the_plant(
    exported_plant, tmp_path, monkeypatch
):
    """A spring behind dry friction at the disc, whose foot slips in each turn; its module is the one of a law."""
    from rotorsim.discrepancy.discovery import LawTerm, ProposedLaw, written
    from rotorsim.discrepancy.law_terms import SLIPPING_SPRING
    from rotorsim.effects import REGISTRY
    from rotorsim.machine import load_machine
    from rotorsim.plant import Plant

    none, one = np.zeros(0), LawTerm(SLIPPING_SPRING, (("reach", 1e-6),), one=True)
    text = written(ProposedLaw("disc 0", (one,), np.ones(1), 0, 0, 0, none, none), {"disc 0": 0.3}, "slider_of_unit")
    (tmp_path / "slider_of_unit.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("slider_of_unit")
    try:
        machine = load_machine("plain_rotor").replace("effects.slider_of_unit.hysteresis", "2e5 N/m")
        model, unit = exported_plant(Plant(machine), 250.0)
        inputs = reference_inputs(model, 300, model.sample)
        truth = plant_outputs(model, inputs, model.sample)
        rows = run(unit, inputs, model.sample, list(truth))
        for k, (name, (values, good)) in enumerate(truth.items()):
            assert values[good].tobytes() == rows[good, k].tobytes(), name
        free = exported_plant(Plant(machine.replace("effects.slider_of_unit.hysteresis", "0 N/m")), 250.0)[0]
        assert np.abs(plant_outputs(free, inputs, model.sample)["disc.x"][0] - truth["disc.x"][0]).max() > 1e-6
    finally:
        REGISTRY.pop("slider_of_unit")
