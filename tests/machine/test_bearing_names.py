"""Bearings by name in a machine file."""

import pytest

from rotorsim.base.errors import MachineFileError
from rotorsim.machine import Machine, machine_text

FILMS = "".join(
    f"""
[[bearings]]
kind = "gas_film"
name = "{name}"
position = "{z} mm"
diameter = "40 mm"
length = "30 mm"
clearance = "20 um"
"""
    for name, z in (("front", 40), ("rear", 160))
)
ROTOR = """
name = "named"
[shaft]
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "200 mm"
outer_diameter = "40 mm"
"""


@pytest.mark.parametrize("key", ["bearing", "place"])
def test_an_effect_gives_its_bearing_by_name(key):
    machine = Machine.from_text(f'{ROTOR}{FILMS}[effects.slip]\n{key} = "rear"\nmean_free_path = "68 nm"\n')
    assert machine.effects["slip"][0].bearing == 1
    assert Machine.from_text(machine.text) == machine and machine.film_number(machine.effects["slip"][0]) == 1


def test_injectors_give_the_bearing_that_they_feed():
    text = machine_text("dtu_gas_bearing").replace('kind = "gas_film"', 'kind = "gas_film"\nname = "gas"')
    text = text.replace('reference = "+', 'bearing = "gas"\nreference = "+')
    machine = Machine.from_text(text)
    assert machine.injection.bearing == 1 and machine.pinned_film == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f'{ROTOR}{FILMS}[effects.slip]\nbearing = "reer"\nmean_free_path = "68 nm"\n',
         "effects.slip.bearing: 'reer' is not the name of a bearing; did you mean 'rear'?"),
        (f'{ROTOR}{FILMS.replace("rear", "front")}', "bearings.1.name: 'front' is the name of bearings.0 too"),
        (f'{ROTOR}{FILMS.replace("name", "# name")}[effects.slip]\nbearing = "rear"\nmean_free_path = "68 nm"\n',
         "effects.slip.bearing: 'rear' is not the name of a bearing; give the bearings names, or write an index"),
    ],
)  # fmt: skip
def test_names_that_lead_nowhere_are_refused(text, message):
    with pytest.raises(MachineFileError, match=message.replace("?", r"\?")):
        Machine.from_text(text)
