"""An effect at its neutral values leaves every bit as it is without the effect."""

import tomlkit

from rotorsim.machine import machine_text
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

NEUTRAL = {
    "effects.unbalance.me": "0 g*mm",
    "effects.coupling.second": "0 N",
    "effects.coupling.third": "0 N",
    "effects.contact.stiffness": "0 N/m",
}


def test_neutral_effects_leave_every_bit_as_it_is_without_them(changed, held):
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    bare = text.copy()
    for name in ("unbalance", "coupling", "contact"):
        del bare["effects"][name]
    full = changed(Machine.from_text(tomlkit.dumps(text)), NEUTRAL)
    inputs = held(400, 300.0, 0.3e6)
    inputs[:, 0] += 0.1 * inputs[:, 0].cumsum() / 300
    inputs[50:60, 4:] = 40.0, -20.0
    inputs[200:, 2] = 1.0
    tables = []
    for machine in (full, Machine.from_text(tomlkit.dumps(bare))):
        tables.append(Plant(machine, n_theta=32, n_z=8, dt=2e-4).start(300.0, 0.3e6).advance(inputs))
    assert set(full.effects) == {"gravity", "unbalance", "coupling", "contact"}
    assert tables[0].tobytes() == tables[1].tobytes()
