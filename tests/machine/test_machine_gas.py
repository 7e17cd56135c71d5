"""Gases by name: properties against tables of measurements, and what a file that gives them means."""

import warnings

import pytest

from rotorsim.base.errors import Unusual
from rotorsim.machine import Gas, Machine, load_machine
from rotorsim.machine.gas_film import GASES
from rotorsim.machine.plausibility import ask_machine
from rotorsim.plant.assemble import make_films

UNIVERSAL = 8314.46
"""Gas constant [J/(kmol K)]."""
MEASURED = {
    "air": (18.46e-6, 23.01e-6, 28.97),
    "nitrogen": (17.82e-6, 22.04e-6, 28.01),
    "oxygen": (20.72e-6, 25.82e-6, 32.00),
    "argon": (22.72e-6, 28.66e-6, 39.95),
    "helium": (19.90e-6, 24.30e-6, 4.003),
    "hydrogen": (8.96e-6, 10.82e-6, 2.016),
    "carbon_dioxide": (14.90e-6, 19.40e-6, 44.01),
}
"""Viscosity [Pa s] at 300 K and at 400 K (Incropera et al. 2007, Table A.4; argon: NIST), molar mass [kg/kmol]."""


@pytest.mark.parametrize("name", MEASURED)
def test_a_gas_has_the_viscosity_that_is_measured_at_its_temperature(name):
    cold, warm, mass = MEASURED[name]
    assert set(GASES) == set(MEASURED)
    for temperature, viscosity in ((300.0, cold), (400.0, warm)):
        gas = Gas(name=name, temperature=f"{temperature} K")
        assert gas.mu == pytest.approx(viscosity, rel=0.03)
        assert pytest.approx(UNIVERSAL / mass, rel=1e-3) == gas.R


def formed(**gas):
    """A rotor on plain films in a gas given by these texts."""
    lines = "\n".join(
        f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}" for key, value in gas.items()
    )
    text = load_machine("rigid_rotor_self_acting").text
    begin = text.index("[gas]")
    end = text.index("\n[", begin)
    return Machine.from_text(f"{text[:begin]}[gas]\n{lines}\n{text[end:]}")


def film_gas(machine):
    return make_films(machine)[0].gas


def test_the_temperature_alone_changes_what_the_film_is_filled_with():
    """400 K against 300 K: 23.01 / 18.46, the table's; in a film of the same machine."""
    cold, hot = (film_gas(formed(temperature=f"{T} K")).viscosity for T in (300, 400))
    assert hot / cold == pytest.approx(23.01 / 18.46, rel=0.01)


def test_a_file_that_gives_properties_keeps_them_and_names_them_where_they_do_not_fit():
    kept = formed(temperature="400 K", viscosity="18.5 uPa*s", gas_constant="290 J/(kg*K)", heat_capacity_ratio=1.39)
    found = film_gas(kept)
    assert (found.viscosity, found.gas_constant, found.heat_capacity_ratio) == (pytest.approx(18.5e-6), 290.0, 1.39)
    with pytest.warns(Unusual, match=r"gas\.viscosity: '18\.5 uPa\*s' is not that of air at 400 K") as caught:
        ask_machine(kept)
    assert len(caught) == 1 and "gas_constant" not in str(caught[0].message)
    assert Machine.from_text(kept.text) == kept


def test_a_gas_constant_of_another_gas_is_questioned_and_its_name_is_no_question():
    with pytest.warns(Unusual, match=r"gas\.gas_constant: .* is not that of air"):
        ask_machine(formed(gas_constant="2077 J/(kg*K)"))
    helium = formed(name="helium", temperature="300 K")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ask_machine(helium)
        ask_machine(formed(temperature="300 K", viscosity="18.5 uPa*s"))
    assert film_gas(helium).gas_constant == pytest.approx(2077.1)


def test_heating_follows_the_law_of_the_gas():
    """A gas warmer by 100 K has the factor of its own table from 300 to 400 K: helium 1.221, carbon dioxide 1.302."""
    for name in ("helium", "carbon_dioxide", "air"):
        machine = formed(name=name, temperature="300 K").replace("effects.gas_heating.rise", "100 K")
        (effect,) = machine.effects["gas_heating"]
        p = type("p", (), {"rise": effect.rise, "heating": effect.heating, **effect.derived(machine)})
        factor, _ = type(effect).kernel.py_func(0.0, 0.0, p)
        cold, warm, _ = MEASURED[name]
        assert factor == pytest.approx(warm / cold, rel=0.02)
