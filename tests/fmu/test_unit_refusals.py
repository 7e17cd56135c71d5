"""Refusals of a unit: one message, process and unit state unharmed."""

import numpy as np
import pytest

from rotorsim.base.errors import DataError

SAMPLE = 2e-4


def refused(instance, call):
    """Return the sentence with which a call is refused."""
    before = len(instance.messages)
    with pytest.raises(Exception):  # noqa: B017  (FMPy has several)
        call()
    assert len(instance.messages) > before
    return instance.messages[-1]


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"effects.unbalance.me": -1.0},
            r"effects\.unbalance\.me = -1 kg\*m: outside 0 to 0\.01; give a value in between",
        ),
        ({"effects.unbalance.me": np.nan}, r"effects\.unbalance\.me = -?nan kg\*m: outside 0 to 0\.01"),
        ({"effects.encoder.counts": -1}, r"effects\.encoder\.counts = -1 : outside"),
        ({"drive.inertia": 0.0}, r"drive\.inertia = 0 kg\*m\^2: outside"),
        ({"noise.seed": -1}, r"noise\.seed = -1 : outside 0"),
        ({"disc.x": 1.0}, r"disc\.x: cannot be set"),
        ({"bearing.length": 1.0}, r"bearing\.length: cannot be set"),
    ],
)
def test_a_value_that_does_not_fit_is_refused_in_initialisation(unit, fresh, values, sentence):
    import re

    assert re.search(sentence, refused(fresh, lambda: fresh.initialise(values)))


def test_a_number_that_is_not_whole_is_refused_for_an_integer(fresh):
    with pytest.raises(DataError) as error:
        fresh.set({"effects.encoder.counts": 7.5})
    assert error.value.argument == "effects.encoder.counts"


def test_a_refused_value_stops_the_initialisation_even_of_an_importer_that_does_not_look(unit, fresh):
    refused(fresh, lambda: fresh.set({"effects.unbalance.me": -1.0}))
    assert "effects.unbalance.me" in refused(fresh, fresh.initialise)


def test_after_a_refusal_a_good_value_goes(unit, fresh):
    refused(fresh, lambda: fresh.set({"effects.unbalance.me": -1.0}))
    fresh.set({"effects.unbalance.me": 1e-6})
    fresh.initialise()
    fresh.step(0.0, SAMPLE)


def test_fixed_parameters_cannot_be_set_while_stepping_and_tunable_ones_can(unit, running):
    running.step(0.0, SAMPLE)
    assert "fixed once the unit is initialised" in refused(
        running, lambda: running.set({"actuators.sensitivity": 3e-6})
    )
    running.set({"effects.unbalance.me": 2e-6})
    assert "outside" in refused(running, lambda: running.set({"effects.unbalance.me": 1.0}))
    assert running.get(["effects.unbalance.me"])[0] == 2e-6
    running.step(SAMPLE, SAMPLE)


@pytest.mark.parametrize(
    ("length", "words"),
    [
        (0.0, "not a step"),
        (1e-4, "not a multiple of 0.0002 s; give e.g. 0.0002 s"),
        (-1e-3, "not a step"),
        (np.nan, "not a step"),
        (3e-4, "not a multiple"),
        (np.inf, "not a step"),
    ],
)
def test_communication_steps_that_are_none_are_refused_and_leave_the_state(unit, running, length, words):
    before = running.get(["disc.x", "shaft.speed", "shaft.angle"])
    assert words in refused(running, lambda: running.step(0.0, length))
    assert before.tobytes() == running.get(["disc.x", "shaft.speed", "shaft.angle"]).tobytes()
    running.step(0.0, SAMPLE)


def test_a_step_that_is_no_multiple_is_an_error_which_no_master_retries(unit, running):
    from fmpy.fmi1 import FMICallException

    with pytest.raises(FMICallException) as failed:
        running.step(0.0, 1e-4)
    assert failed.value.status == 3  # error; 2 would be discard
    assert len(running.messages) == 1


def test_a_run_of_fmpy_with_half_the_step_ends(unit):
    from fmpy import simulate_fmu

    log = []
    with pytest.raises(Exception, match="DoStep failed with status 3"):
        simulate_fmu(unit.folder, stop_time=0.01, output_interval=1e-4, logger=lambda *words: log.append(words))
    assert sum(b"not a multiple" in words[-1] for words in log) == 1


def test_a_step_beyond_the_stop_time_is_an_error_that_leaves_the_state(unit, fresh):
    fresh.initialise(start=1.0, stop=1.001)
    fresh.step(1.0, 4 * SAMPLE)
    before = fresh.get(["disc.x", "shaft.angle", "meas.disc_x"])
    sentence = refused(fresh, lambda: fresh.step(1.0008, 2 * SAMPLE))
    assert sentence.startswith("time = 1.0012 s: beyond the stop time 1.001 s of this run")
    assert before.tobytes() == fresh.get(["disc.x", "shaft.angle", "meas.disc_x"]).tobytes()
    fresh.step(1.0008, SAMPLE)


def test_a_run_without_stop_time_is_open(unit, fresh):
    fresh.initialise()
    fresh.step(0.0, 2.0)


def test_a_reset_unit_has_no_stop_time(unit, fresh):
    fresh.initialise(stop=SAMPLE)
    fresh.slave.reset()
    fresh.initialise()
    fresh.step(0.0, 2 * SAMPLE)


@pytest.mark.parametrize("stop", [0.5, float("nan")])
def test_a_stop_time_that_is_not_after_the_start_is_refused(unit, fresh, stop):
    assert "not after the start at 1 s" in refused(fresh, lambda: fresh.initialise(start=1.0, stop=stop))


def test_outputs_are_refused_before_initialisation(unit, fresh):
    assert "disc.x: is not known before initialisation" in refused(fresh, lambda: fresh.get(["disc.x"]))


def test_debug_logging_follows_the_categories_that_are_named(units):
    instance = units[3].instance()
    instance.initialise()
    instance.slave.setDebugLogging(False, ["logEvents"])
    instance.set({"disc.force_x": 600.0})
    instance.step(0.0, 0.02)
    assert instance.get(["film.touchdown"])[0] == 1.0 and instance.messages == []
    sentence = refused(instance, lambda: instance.slave.setDebugLogging(True, ["logAll"]))
    assert sentence == "log category 'logAll': is not known; give logEvents, logStatusWarning or logStatusError"
    instance.close()


def test_a_communication_step_of_a_second_is_5000_samples(unit, running):
    running.set({"shaft.speed_ref": 100.0})
    running.step(0.0, 1.0)
    assert running.get(["shaft.speed", "shaft.angle"]) == pytest.approx([100.0, 50.0], rel=1e-9)
    running.step(1.0, SAMPLE)


def test_a_communication_point_elsewhere_is_refused(unit, running):
    assert "the unit is at 0 s" in refused(running, lambda: running.step(0.1, SAMPLE))


@pytest.mark.parametrize("name", ["shaft.speed_ref", "injection.pressure", "piezo.ref_x", "disc.force_y"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_inputs_that_are_no_numbers_are_refused_by_name(unit, running, name, value):
    good = running.get([name])[0]
    running.set({name: value})
    assert refused(running, lambda: running.step(0.0, SAMPLE)).startswith(f"{name} = ")
    running.set({name: good})
    running.step(0.0, SAMPLE)


def test_a_pressure_below_vacuum_is_refused(unit, running):
    running.set({"injection.pressure": -2e5})
    assert refused(running, lambda: running.step(0.0, SAMPLE)).startswith("injection.pressure = -200000 Pa")


def test_a_start_without_lift_off_is_refused_with_the_way_out(unit, fresh):
    sentence = refused(fresh, lambda: fresh.initialise({"injection.pressure": 0.02e6}))
    assert sentence.startswith("no lift-off: at 0.02 MPa gauge and 0 rpm") and "raise injection.pressure" in sentence


def test_calls_in_the_wrong_order_are_refused(unit, fresh):
    assert "not allowed now" in refused(fresh, lambda: fresh.step(0.0, SAMPLE))


def test_a_foreign_token_gives_no_instance(unit):
    from fmu.importer import Instance

    kept = unit.description.guid
    unit.description.guid = "{00000000-0000-0000-0000-000000000000}"
    try:
        with pytest.raises(Exception, match="nstantiate"):
            Instance(unit, "foreign", lambda text: None, {})
    finally:
        unit.description.guid = kept


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-8], lambda b: b"", lambda b: b"x" * len(b), lambda b: b[:-9] + b"damaged!!"]
)
def test_states_that_are_none_are_refused(unit, running, damage):
    running.run({"drive.on": np.ones(3), "shaft.speed_ref": np.ones(3)}, SAMPLE, ["disc.x"])
    saved = running.save()
    assert "state: " in refused(running, lambda: running.restore(damage(saved)))
    running.restore(saved)
    running.step(3 * SAMPLE, SAMPLE)


def test_a_state_of_another_model_is_refused(unit, running):
    saved = bytearray(running.save())
    saved[8] ^= 1
    assert "belongs to model" in refused(running, lambda: running.restore(bytes(saved)))
