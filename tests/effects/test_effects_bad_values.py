"""Invalid effects: values beyond limits, unknown names, impossible combinations."""

import pytest
import tomlkit

from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantities
from rotorsim.base.units import show
from rotorsim.effects import REGISTRY
from rotorsim.machine import machine_text
from rotorsim.machine.schema import Machine

SHIPPED = sorted(n for n, e in REGISTRY.items() if e.__module__.startswith("rotorsim.effects."))


def problems(tables, name="dtu_gas_bearing"):
    """Sentences that a shipped machine with these tables of effects gets; none if it is good."""
    text = tomlkit.parse(machine_text(name))
    text["effects"] = tables
    try:
        Machine.from_text(tomlkit.dumps(text))
    except MachineFileError as error:
        return error.problems
    return []


@pytest.mark.parametrize("name", SHIPPED)
def test_a_value_beyond_a_limit_gets_the_limit_and_an_unknown_name_the_known_ones(name):
    assert problems({name: {"nonsense": 1}})[0].startswith(f"effects.{name}.nonsense: unknown field; known are ")
    for parameter, quantity in quantities(REGISTRY[name]).items():
        (low, high), unit = quantity.bounds, quantity.unit
        for beyond, word in ((low - 0.01 * (high - low), "below"), (high + 0.01 * (high - low), "above")):
            found = problems({name: {parameter: beyond if unit == "1" else show(beyond, unit)}})
            assert len(found) == 1
            assert found[0].startswith(f"effects.{name}.{parameter}: ") and f"is {word} the limit; write at" in found[0]


@pytest.mark.parametrize("name", SHIPPED)
def test_an_effect_built_in_python_has_the_fields_and_units_of_its_table(name):
    with pytest.raises(MachineFileError) as caught:
        REGISTRY[name](nonsense=1)
    assert caught.value.argument == f"effects.{name}.nonsense" and caught.value.value == 1
    for parameter, quantity in quantities(REGISTRY[name]).items():
        for wrong in ("12 nonsense", float("nan"), [1.0]):
            with pytest.raises(MachineFileError) as caught:
                REGISTRY[name](**{parameter: wrong})
            assert caught.value.argument == f"effects.{name}.{parameter}"
        size = max(quantity.bounds[0], 1.0) if quantity.multiple else 0.5 * sum(quantity.bounds)
        text = REGISTRY[name](**{parameter: show(size, quantity.unit)})
        assert getattr(text, parameter) == pytest.approx(size)


@pytest.mark.parametrize("name", SHIPPED)
def test_an_effect_that_a_machine_has_once_is_refused_twice(name):
    found = [p for p in problems({name: [{}, {}]}) if "a machine has one" in p]
    assert found == (
        [f"effects.{name}: there are 2 of them, and a machine has one; keep one table"] if REGISTRY[name].single else []
    )


G = {"gravity": {"acceleration": "9.81 m/s^2"}}
CASES = [
    ({"crack": {"loss": "1 MN/m"}},
     "effects.crack: the weight opens and closes a crack, but there is none; add [effects.gravity]"),
    ({"base_vibration": {"x": "1 m/s^2"}, "pedestal": {"mass_ratio": 0.1}},
     "effects.pedestal: does not feel [effects.base_vibration]"),
    ({"dead_zone": {"half_width": "1 um"}, "creep": {"gain": 0.01}},
     "effects.dead_zone: is lost between stack and pin, but [effects.creep]"),
    ({"encoder": {"counts": 2000}, "runout": {"amplitude_1x": "1 um"}},
     "effects.runout: turns with the true angle, but [effects.encoder]"),
    ({"clearance_growth": {"growth": "15 um"}, "out_of_round": {"sleeve": "9 um"}},
     "effects.clearance_growth: with the other effects on the gap takes 24 um of a clearance of 25 um"),
    ({"journal_tilt": {"x": "1.5 mrad"}}, "effects.journal_tilt: with the other effects on the gap takes 30 um"),
    ({"contact": {"asperity": "30 um"}},
     "effects.contact.asperity: '30 um' is not below the clearance '25 um'; make it smaller"),
    ({"plenum_volume": {"injector": 5}},
     "effects.plenum_volume.injector: 5 is none of the machine's injectors; write 1 to 4"),
    ({"weak_injector": {"injector": 1.5}},
     "effects.weak_injector.injector: 1.5 is not a whole number; write e.g. 2"),
    ({"unequal_pressure": {"injector": 7}}, "effects.unequal_pressure.injector: 7 is none of the machine's injectors"),
    ({"encoder": {"window": 2.5}}, "effects.encoder.window: 2.5 is not a whole number; write e.g. 2"),
    ({"encoder": {"counts": 0.5}}, "effects.encoder.counts: 0.5 is not a whole number"),
    ({"runout": {"surface": 0.5}}, "effects.runout.surface: 0.5 is not a whole number"),
    ({"torque_ripple": {"order": 1.5}}, "effects.torque_ripple.order: 1.5 is not a whole number; write e.g. 2"),
    ({"out_of_round": {"sleeve_lobes": 2.5}},
     "effects.out_of_round.sleeve_lobes: 2.5 is not a whole number; write e.g. 2"),
    ({"rub": {"position": "240 mm"}},
     "effects.rub.position: is inside the gas film, where [effects.contact] describes the rub"),
]  # fmt: skip


@pytest.mark.parametrize(("tables", "sentence"), CASES, ids=[s.split(":")[0] for _, s in CASES])
def test_what_cannot_be_is_refused_with_the_way_out(tables, sentence):
    found = problems(tables)
    assert len(found) == 1
    assert found[0].startswith(sentence)


@pytest.mark.parametrize(
    "tables",
    [
        G | {"crack": {"loss": "1 MN/m"}},
        {"base_vibration": {}, "pedestal": {"mass_ratio": 0.1}},
        {"creep": {"gain": 0.01}, "dead_zone": {"half_width": "1 um"}},
        {"dead_zone": {"half_width": "1 um"}, "creep": {}},
        {"runout": {"amplitude_1x": "1 um"}, "encoder": {"counts": 2000}},
        {"encoder": {}, "runout": {"amplitude_1x": "1 um"}},
        {"clearance_growth": {"growth": "15 um", "temperature": "40 K"}, "out_of_round": {"sleeve": "9 um"}},
    ],
)
def test_the_same_effects_apart_in_order_or_switched_off_are_taken(tables):
    assert problems(tables) == []


def test_a_plain_rotor_refuses_what_acts_in_a_film_it_has_not():
    for name in ("plenum_volume", "pedestal", "journal_tilt", "out_of_round", "creep"):
        assert "acts in a gas film, but there is none" in problems({name: {}}, "plain_rotor")[0]


@pytest.mark.parametrize("name", ["plain_rotor", "aerostatic_spindle"])
@pytest.mark.parametrize("effect", ["actuator_delay", "actuator_gain", "amplifier_lag"])
def test_a_machine_without_pins_refuses_what_acts_on_them_by_what_it_has_not(effect, name):
    (found,) = problems({effect: {}}, name)
    assert found.startswith(f"effects.{effect}: ") and "pins" in found and "[[injectors]]" in found


def test_another_lag_of_the_amplifiers_is_refused_where_pins_have_none():
    """At its neutral value it changes nothing anyway."""
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    text["effects"] = {"amplifier_lag": {"injector": 1, "change": 0.5}}
    driven = Machine.from_text(tomlkit.dumps(text))
    with pytest.raises(MachineFileError) as caught:
        driven.replace("actuators.mode", "ideal")
    (found,) = caught.value.problems
    assert found.startswith("effects.amplifier_lag: ") and "actuators.mode" in found
    assert (
        driven.replace("actuators.mode", "voltage")
        .replace("effects.amplifier_lag.change", 0.0)
        .replace("actuators.mode", "ideal")
    )
