"""Neutral effects: trajectories bit-identical to those without the effect."""

import numpy as np
import pytest
import tomlkit

from rotorsim.effects import REGISTRY
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant


def machines():
    """The rig without any effect but its weight, and the same with every registered effect at its defaults."""
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    for name in set(text["effects"]) - {"gravity"}:
        del text["effects"][name]
    bare = Machine.from_text(tomlkit.dumps(text)).replace("actuators.sensitivity", "4.5 um/V")
    full = bare
    for name in sorted(set(REGISTRY) - {"gravity"}):
        full = full.replace(f"effects.{name}", {})
    return bare, full


@pytest.mark.slow
@pytest.mark.parametrize("symmetry", ["auto", "none"])
def test_all_effects_at_their_neutral_values_leave_every_bit_as_it_is_without_them(symmetry):
    k = np.arange(600)
    inputs = np.zeros((600, 6))
    inputs[:, 0], inputs[:, 1] = 300 + 0.2 * k, 5e5 + 2e4 * np.sin(0.02 * k)
    inputs[:, 2], inputs[:, 3] = np.sin(0.3 * k), 0.5 * np.cos(0.2 * k)
    inputs[100:110, 4:] = 60.0, -20.0
    inputs[500:, 0] = np.nan
    tables = []
    for machine in machines():
        plant = Plant(machine.replace("grid.symmetry", symmetry), n_theta=16, n_z=8, dt=2e-4)
        tables.append(plant.start(300.0, 5e5, seed=3).advance(inputs))
    assert set(plant.machine.effects) == set(REGISTRY)
    common = tables[0].shape[1]  # behind them the readings of the pins and the temperatures, which stay as they are
    assert np.ascontiguousarray(tables[1][:, :common]).tobytes() == tables[0].tobytes()
    assert tables[1].shape[1] == common + 4 + 3 and not tables[1][:, common + 4 :].any()
    assert np.array_equal(tables[1][:, common : common + 4], tables[0][:, common - 4 :])


@pytest.mark.slow
@pytest.mark.parametrize("values, speed, pressure", [
    ({}, 2200.0, 0.3e6), ({"effects.unbalance.me": "300 g*mm"}, 700.0, 0.1e6),
])  # fmt: skip
def test_all_other_effects_at_their_neutral_values_leave_every_bit_of_a_whirl_and_a_rub(values, speed, pressure):
    """The rig as shipped, with contact: corrections, factors and parts of steps are as many too."""
    shipped = load_machine("dtu_gas_bearing")
    for path, value in values.items():
        shipped = shipped.replace(path, value)
    full = shipped
    for name in sorted(set(REGISTRY) - set(shipped.effects)):
        full = full.replace(f"effects.{name}", {})
    runs = [Plant(m, n_theta=32, n_z=8, dt=1e-4).start(speed, pressure, seed=3) for m in (shipped, full)]
    inputs = np.tile([speed, pressure, 0.0, 0.0, 0.0, 0.0], (3000, 1))
    tables = [run.advance(inputs)[:, :4] for run in runs]
    assert tables[0].tobytes() == tables[1].tobytes() and runs[0].counters == runs[1].counters
    assert runs[0].counters["substeps"] > 0 and np.ptp(tables[0][-500:, 0]) > 1e-4


def test_neutral_effects_add_no_mode_to_the_linear_plant():
    bare, full = (Plant(machine, n_theta=32, n_z=8, dt=2e-4).linearise(300.0, 5e5) for machine in machines())
    assert len(bare.S) == len(full.S)
    assert full.wn == pytest.approx(bare.wn, rel=1e-9) and full.zeta == pytest.approx(bare.zeta, rel=1e-6)
