"""Numbers of the machine set before a unit starts: the bits of the machine that has them, or a sentence."""

import numpy as np
import pytest

from fmu.check import check, plant_outputs
from fmu.export import bounded, choose, export, plant_unit
from fmu.importer import info, reference_inputs
from fmu.turned import MOST_MACHINES, read_choices, turned_numbers, value_of
from fmu.variables import ROW
from rotorsim.base.errors import DataError
from rotorsim.fmu import state
from rotorsim.machine import load_machine
from rotorsim.machine.limits import hottest
from rotorsim.machine.numerics import HOT
from rotorsim.plant import Plant
from rotorsim.plant.assemble import assemble
from rotorsim.plant.kernels.layout import AT

SAMPLE = 2e-4
PATHS = {"bearing.": "bearings.1."}
TURNS = {
    "bearing.clearance": 31.7e-6,
    "gas.ambient_pressure": 84321.0,
    "gas.temperature": 331.3,
    "injection.pin_discharge": 0.163,
    "injection.curtain_discharge": 0.77,
}
OVER = {
    "discs.0.mass": ["1.2 kg"],
    "bearings.1.length": [0.036],
    "probe.position": ["301 mm"],
    "effects.unbalance.position": [0.1],
}
"""Values that a unit offers, by path."""
CHOSEN = {
    "discs[1].mass": 1.2, "bearing.length": 0.036, "probe.position": 0.301, "effects.unbalance.position": 0.1,
}  # fmt: skip
"""One of the machines offered, under the names of the unit, in the order of the paths."""
OTHERS = {"rigid_rotor_self_acting": 4, "aerostatic_spindle": 12, "dtu_paper_a": 5, "foil_turbo_rotor": 2}


def changed(machine, values, paths=PATHS):
    """Return the machine with values under the names of its unit."""
    for name, value in values.items():
        path = name
        for begin, own in paths.items():
            path = own + path.removeprefix(begin) if path.startswith(begin) else path
        machine = machine.with_({path: value})
    return machine


@pytest.mark.parametrize("values", [*({name: value} for name, value in TURNS.items()), TURNS], ids=str)
def test_a_unit_with_other_numbers_has_the_bits_of_the_machine_that_has_them(unit, fresh, model, values):
    other = plant_unit(Plant(changed(model.plant.machine, values)), model.speed, model.pressure)
    inputs = reference_inputs(model, 150, SAMPLE)
    truth, usual = plant_outputs(other, inputs, SAMPLE), plant_outputs(model, inputs, SAMPLE)
    fresh.initialise(values)
    rows = fresh.run(inputs, SAMPLE, list(truth))
    for k, (name, (found, good)) in enumerate(truth.items()):
        assert found[good].tobytes() == rows[good, k].tobytes(), name
    assert not np.array_equal(truth["disc.y"][0], usual["disc.y"][0])
    assert fresh.get(list(values)).tolist() == list(values.values())


@pytest.mark.parametrize(("name", "count"), OTHERS.items())
def test_what_a_unit_computes_anew_is_what_the_assembly_of_the_other_machine_has(name, count):
    machine = load_machine(name)
    a, rng = assemble(machine), np.random.default_rng(5)
    first, *_, last = (*machine.film_bearings, *machine.film_bearings)
    paths = {"bearing.": f"bearings.{first}.", "bearing_2.": f"bearings.{last}."}
    turned = turned_numbers(a)
    assert len(turned) == count
    values = {one.name: one.value * rng.uniform(0.6, 1.7) for one in turned}
    w, numbers = a.w.copy(), a.numbers.copy()
    for one in turned:
        for e in one.entries:
            target, x = (numbers if e.in_record else w), value_of(e.formula, values[one.name])
            part = slice(e.place, e.place + e.count)
            target[part] = np.minimum(target[part], x) if e.least else x
    named = {
        key.replace("orifices[1]", "orifices.0").replace("orifices[2]", "orifices.1"): v for key, v in values.items()
    }
    other = assemble(changed(machine, named, paths))
    assert other.w.tobytes() == w.tobytes() and other.numbers.tobytes() == numbers.tobytes()


def test_a_clearance_that_shapes_the_sleeve_too_stays_fixed():
    plant = plant_unit(Plant("foil_turbo_rotor"))
    stores = {v.name: v.store for v in plant.variables}
    assert stores["bearing.clearance"] == "constant" and stores["gas.temperature"] == "turned"
    assert turned_numbers(assemble(load_machine("plain_rotor"))) == ()


def test_numbers_that_leave_no_equilibrium_end_with_a_sentence_and_a_reset_makes_the_unit_usable(unit, fresh, model):
    with pytest.raises(Exception, match="status 3"):
        fresh.initialise({"bearing.clearance": 0.45e-3, "shaft.speed_ref": 10.0, "injection.pressure": 0.0})
    assert "no lift-off" in fresh.messages[-1]
    fresh.slave.reset()
    fresh.initialise()
    assert fresh.get(["bearing.clearance"])[0] == model.plant.machine.film.clearance
    rest = model.plant.equilibrium(model.speed, model.pressure)
    assert fresh.get(["disc.y"])[0] == pytest.approx(rest.disc[1], rel=1e-12)


def test_a_temperature_at_which_a_run_would_end_elsewhere_is_beyond_the_limit(model):
    machine = model.plant.machine
    warmest = {v.name: v for v in model.variables}["gas.temperature"].high
    assert HOT - 1e-3 < warmest <= HOT and hottest(machine.with_({"gas.temperature": warmest})) == hottest(machine)
    fed_hot = assemble(machine.with_({"gas.temperature": 450.0}))
    [low] = [one.low for one in turned_numbers(fed_hot) if one.name == "gas.temperature"]
    assert HOT <= low < HOT + 1e-3 and hottest(fed_hot.machine) == np.inf
    bounded_by_file = machine.replace("limits.temperature", "227 degC")
    [high] = [one.high for one in turned_numbers(assemble(bounded_by_file)) if one.name == "gas.temperature"]
    assert high > HOT


def test_a_number_beyond_those_that_were_compared_is_warned_of_once(fresh):
    fresh.initialise({"gas.temperature": 360.0})
    assert fresh.messages == []
    fresh.slave.reset()
    fresh.initialise({"gas.temperature": 390.0})
    fresh.step(0.0, SAMPLE)
    [sentence] = fresh.messages
    assert sentence.startswith("gas.temperature = 390 K")


def test_a_viscosity_that_is_set_holds_at_any_temperature(unit, fresh, model):
    machine = model.plant.machine.with_({"gas.temperature": 340.0, "gas.viscosity": 1.5e-5})
    truth = plant_outputs(
        plant_unit(Plant(machine), 300.0, model.pressure), reference_inputs(model, 20, SAMPLE), SAMPLE
    )
    fresh.initialise({"gas.viscosity": 1.5e-5, "gas.temperature": 340.0, "shaft.speed_ref": 300.0})
    rows = fresh.run(reference_inputs(model, 20, SAMPLE), SAMPLE, ["bearing.x"])
    assert rows[0, 0] == truth["bearing.x"][0][0]


def test_a_state_holds_the_numbers_that_were_set(unit, fresh, model):
    inputs = reference_inputs(model, 60, SAMPLE)
    first, last = ({name: row[part] for name, row in inputs.items()} for part in (slice(30), slice(30, 60)))
    fresh.initialise(TURNS)
    fresh.run(first, SAMPLE, ["disc.x"])
    saved = fresh.save()
    rows = [fresh.run(last, SAMPLE, ["disc.x", "bearing.y"], 30)]
    other = unit.instance("other")
    other.initialise()
    other.restore(saved)
    rows.append(other.run(last, SAMPLE, ["disc.x", "bearing.y"], 30))
    assert rows[0].tobytes() == rows[1].tobytes()
    assert other.get(["gas.temperature"])[0] == TURNS["gas.temperature"]
    other.close()


def test_a_pressure_below_vacuum_is_refused_at_the_ambient_pressure_that_was_set(unit, fresh):
    fresh.initialise({"gas.ambient_pressure": 5e4})
    fresh.set({"injection.pressure": -6e4})
    with pytest.raises(Exception, match="status 3"):
        fresh.step(0.0, SAMPLE)
    assert "below vacuum at gas.ambient_pressure = 50000 Pa" in fresh.messages[-1]
    fresh.set({"injection.pressure": 0.3e6})
    fresh.step(0.0, SAMPLE)


@pytest.mark.parametrize(("begin", "real_time"), [("orbit", False), ("moving", False), ("moving", True)])
def test_a_unit_goes_on_from_a_state_of_python_with_its_bits(units, exported_plant, model, begin, real_time):
    unit, inputs = units[3], reference_inputs(model, 60, SAMPLE)
    if real_time:
        model, unit = exported_plant(bounded(model.plant), 0.0, model.pressure)
    inputs["shaft.speed_ref"] += 300.0
    rows = np.column_stack([inputs.get(name, np.zeros(60)) for name in ROW])
    simulation = model.plant.start(300.0, model.pressure, 7, "orbit" if begin == "orbit" else "rest")
    if begin == "moving":
        simulation.advance(rows[:20])
    start = state(unit.path, simulation)
    truth = simulation.advance(rows)
    instance = unit.instance()
    instance.restore(start)
    found = instance.run(inputs, SAMPLE, ["disc.x", "disc.y", "shaft.speed", "meas.disc_x"])
    for k, name in enumerate(("disc_x", "disc_y", "speed", "disc_measured_x")):
        assert found[:-1, k].tobytes() == truth[:, AT[name]].tobytes(), name
    instance.close()


def test_a_state_of_python_holds_the_inputs_of_its_simulation(units, model):
    row = [310.0, 0.52e6, 1.0, -0.5, 3.0, 1.0]
    simulation = model.plant.start(300.0, 0.5e6)
    simulation.advance(np.tile(row, (20, 1)))
    instance, names = units[3].instance(), ["disc.x", "disc.y", "shaft.speed"]
    instance.restore(state(units[3].path, simulation))
    assert instance.get(ROW).tolist() == row
    found = [instance.get(names)]
    for k in range(3):
        instance.step(k * SAMPLE, SAMPLE)
        found.append(instance.get(names))
    truth = simulation.advance(np.tile(row, (4, 1)))
    assert np.array(found).tobytes() == truth[:, [AT["disc_x"], AT["disc_y"], AT["speed"]]].tobytes()
    instance.close()


def test_a_state_of_another_machine_is_refused(files):
    with pytest.raises(DataError, match="another machine"):
        state(files[3], Plant("dtu_gas_bearing").start(0.0, 0.3e6))


@pytest.fixture(scope="module")
def offering(exported_plant, model):
    """Model and unit of the rig that offers `OVER`."""
    return exported_plant(model.plant, 0.0, model.pressure, OVER)


@pytest.mark.parametrize("names", [*([name] for name in CHOSEN), list(CHOSEN)], ids=str)
def test_a_unit_with_a_disc_a_place_or_a_size_that_it_offers_has_the_bits_of_that_machine(offering, names):
    model, unit = offering
    values = {name: CHOSEN[name] for name in names}
    paths = dict(zip(CHOSEN, OVER, strict=True))
    machine = model.plant.machine.with_({paths[name]: value for name, value in values.items()})
    turned = {"bearing.clearance": 27.3e-6, "gas.temperature": 321.0}
    other = plant_unit(Plant(changed(machine, turned)), model.speed, model.pressure)
    inputs = reference_inputs(model, 100, SAMPLE)
    truth = plant_outputs(other, inputs, SAMPLE)
    instance = unit.instance()
    for start in (None, values | turned):  # the second one after a reset
        instance.initialise(start)
        rows = instance.run(inputs, SAMPLE, list(truth))
        same = [found[good].tobytes() == rows[good, k].tobytes() for k, (found, good) in enumerate(truth.values())]
        assert all(same) == (start is not None)
        instance.slave.reset()
    instance.slave.freeInstance()


def test_a_value_that_is_not_offered_is_refused_and_a_near_one_is_the_one_offered(offering):
    _, unit = offering
    instance = unit.instance()
    with pytest.raises(Exception, match="status 3"):
        instance.set({"discs[1].mass": 1.3})
    assert all(text in instance.messages[-1] for text in ("discs[1].mass", "1.3", "1.2", "1.5"))
    instance.set({"discs[1].mass": 1.2 * (1 + 1e-12)})
    instance.initialise()
    assert instance.get(["discs[1].mass"])[0] == 1.2
    instance.close()


@pytest.mark.parametrize("end", [1.2, 1.5])
def test_a_list_holds_a_little_beyond_its_ends_and_no_further(offering, end):
    _, unit = offering
    instance = unit.instance()
    for near in (end * (1 - 1e-12), end * (1 + 1e-12)):
        instance.set({"discs[1].mass": near})
        assert instance.get(["discs[1].mass"])[0] == end
    for far in (end * (1 - 1e-8), end * (1 + 1e-8), 0.1 * end, 1e3 * end, -end, np.nan, np.inf):
        with pytest.raises(Exception, match="status 3"):
            instance.set({"discs[1].mass": far})
        assert all(text in instance.messages[-1] for text in ("is not offered", "1.2", "1.5"))
    assert instance.get(["discs[1].mass"])[0] == end
    instance.set({"discs[1].mass": end})  # a good value ends the refusal
    instance.initialise()
    instance.close()


@pytest.mark.parametrize("value", ["1.2 kg", 1.2, np.float64(1.2)], ids=str)
def test_one_value_needs_no_list(model, value):
    offering = plant_unit(model.plant, 0.0, model.pressure, {"discs.0.mass": value})
    assert [one.values for one in offering.choices] == [(1.5, 1.2)]


@pytest.mark.parametrize("value", ["1.2 mm", "1.2", "heavy", None, [1.2]], ids=str)
def test_a_value_that_is_no_number_of_its_unit_is_refused_by_path_and_value(model, value):
    with pytest.raises(DataError) as refused:
        plant_unit(model.plant, 0.0, model.pressure, {"discs.0.mass": [1.3, value]}).variables  # noqa: B018
    assert (refused.value.argument, refused.value.value) == ("discs.0.mass", value)


def test_a_star_offers_the_values_for_each_entry_of_a_list(model):
    over = {"discs.*.mass": [1.2], "discs.0.mass": [1.3]}
    assert [(one.path, one.values) for one in read_choices(model.assembly, over)] == [("discs.0.mass", (1.5, 1.2, 1.3))]
    spindle = assemble(load_machine("aerostatic_spindle"))
    films = {f"bearings.{k}.length" for k in spindle.machine.film_bearings}
    found = read_choices(spindle, {"bearings.*.length": [0.0501]})
    assert len(films) > 1 and {one.path for one in found} == films and len({one.name for one in found}) == len(films)


def test_a_unit_shows_what_it_offers_and_questions_a_machine_that_does_not_lift(offering, tmp_path):
    model, unit = offering
    assert "One of 1.2, 1.5 kg." in unit.variables["discs[1].mass"].description
    assert "discs[1].mass 1.2, 1.5 kg" in info(unit.path)["offers"]
    heavy = plant_unit(model.plant, 0.0, model.pressure, {"discs.0.mass": [1.2, 3000.0]})
    sentences = []
    export(heavy, tmp_path / "heavy.fmu", (3,), choose("host"), announce=sentences.append)
    [sentence] = [one for one in sentences if "discs[1].mass" in one]
    assert "= 3000" in sentence and "no lift-off" in sentence


def test_an_empty_list_is_refused(model):
    with pytest.raises(DataError) as refused:
        plant_unit(model.plant, 0.0, model.pressure, {"discs.0.mass": []})
    assert (refused.value.argument, refused.value.value) == ("discs.0.mass", [])


def test_a_choice_that_moves_the_start_of_a_parameter_that_can_be_set_is_refused(model):
    """A parameter set to the first machine's own start could not be taken for one that was not set."""
    over = {"discs.0.polar_inertia": [0.004]}
    with pytest.raises(DataError) as refused:
        plant_unit(model.plant, 0.0, model.pressure, over).variables  # noqa: B018
    assert (refused.value.argument, refused.value.value) == ("over", "drive.inertia")
    stated = Plant(model.plant.machine.with_({"drive.inertia": 0.004}))
    assert "discs[1].polar_inertia" in {v.name for v in plant_unit(stated, 0.0, model.pressure, over).variables}


def test_a_state_of_a_machine_that_is_offered_goes_on_in_the_unit(offering):
    model, unit = offering
    plant = Plant(model.plant.machine.with_(dict(zip(OVER, CHOSEN.values(), strict=True))))
    simulation = plant.start(300.0, model.pressure)
    row = [300.0, model.pressure, 0.0, 0.0, 10.0, 0.0]
    simulation.advance(np.tile(row, (20, 1)))
    instance = unit.instance()
    instance.restore(state(unit.path, simulation))
    assert instance.get(list(CHOSEN)).tolist() == list(CHOSEN.values())
    inputs = {name: np.full(20, value) for name, value in zip(ROW, row, strict=True)}
    found = instance.run(inputs, SAMPLE, ["disc.x"])[:-1, 0]
    assert found.tobytes() == simulation.advance(np.tile(row, (20, 1)))[:, AT["disc_x"]].tobytes()
    instance.close()


@pytest.mark.parametrize(
    "over",
    [
        {"discs.0.colour": [1.0]},
        {"discs.7.mass": [1.0]},
        {"discs.first.mass": [1.0]},
        {"effects.nothing.position": [1.0]},
        {"bearings.1.clearance": [3e-5]},
        {"effects.unbalance.me": [1e-5]},
        {"discs.0.mass": np.linspace(1.0, 2.0, MOST_MACHINES + 1)},
        {"bearings.1.orifices": [1.0]},
        {"grid.n_theta": [24.0]},
    ],
    ids=lambda over: next(iter(over)),
)
def test_what_cannot_be_offered_is_refused_before_the_export(model, over):
    with pytest.raises(DataError):
        plant_unit(model.plant, 0.0, model.pressure, over).variables  # noqa: B018


def test_a_number_far_from_what_is_usual_is_refused_unless_the_machine_has_it(unit, fresh, model):
    with pytest.raises(Exception, match="status 3"):
        fresh.initialise({"gas.temperature": 1e-3})
    low = {v.name: v.low for v in model.variables}
    assert (low["gas.temperature"], low["gas.ambient_pressure"]) == (4.0, 1e3)
    cold = assemble(model.plant.machine.with_({"gas.temperature": 3.0, "gas.viscosity": 1e-6}))
    assert {one.name: one.low for one in turned_numbers(cold)}["gas.temperature"] == 3.0


def test_a_state_of_a_shaft_that_coasts_goes_on_coasting(units, model):
    row = [np.nan, model.pressure, 0.0, 0.0, 0.0, 0.0]
    simulation = model.plant.start(300.0, model.pressure)
    simulation.advance(np.tile(row, (20, 1)))
    instance = units[3].instance()
    instance.restore(state(units[3].path, simulation))
    assert instance.get(["drive.on"])[0] == 0.0
    found = [instance.get(["shaft.speed", "disc.x"])]
    for k in range(3):
        instance.step(k * SAMPLE, SAMPLE)
        found.append(instance.get(["shaft.speed", "disc.x"]))
    truth = simulation.advance(np.tile(row, (4, 1)))[:, [AT["speed"], AT["disc_x"]]]
    assert np.array(found).tobytes() == truth.tobytes() and truth[-1, 0] < truth[0, 0]
    instance.close()


@pytest.mark.slow
def test_a_check_compares_every_machine_that_a_unit_offers(offering):
    model, unit = offering
    found = [one for one in check(unit.path, 0.02) if one.name.startswith("with ")]
    assert len(found) == len(model.variants) - 1 == 15
    assert all(one.passed and one.value == "equal to the last bit" for one in found)
