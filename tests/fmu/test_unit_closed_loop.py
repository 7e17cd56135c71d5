"""Example of docs/fmu.md: plant unit with proportional law in FMPy against the closed loop in Python."""

import re
from pathlib import Path

import numpy as np
import pytest

from rotorsim.plant import Plant

PAGE = Path(__file__).parents[2] / "docs" / "fmu.md"


class Proportional:
    """The law of the page."""

    def step(self, measured, speed, pressure):
        return 2e4 * measured


def example(path, word):
    """Return the page's FMPy example with a word in it, for a file."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return next(b for b in blocks if word in b).replace('"rig.fmu"', repr(str(path)))


@pytest.mark.parametrize("version", [2, 3])
def test_rows_of_simulate_fmu_are_those_of_the_record_as_the_docs_show(files, model, tmp_path, version):
    model.plant.machine.save(tmp_path / "my_rig.toml")
    text = example(files[version], "simulate_fmu").replace('"my_rig.toml"', repr(str(tmp_path / "my_rig.toml")))
    found = {}
    exec(compile(text, str(PAGE), "exec"), found)
    assert found["same"] == [True, True] and np.ptp(found["rows"]["disc.x"]) > 1e-9


def test_what_is_read_after_step_k_is_row_k_plus_1_of_the_record(units, model):
    force = np.zeros((50, 2))
    force[3, 0] = 20.0
    record = Plant(model.plant.machine).simulate(0.01, 300.0, 0.3e6, disc_force=force)
    instance = units[3].instance()
    instance.initialise({"shaft.speed_ref": 300.0})
    after = np.zeros(50)
    for k in range(50):
        instance.set({"disc.force_x": force[k, 0]})
        instance.step(k * 2e-4, 2e-4)
        after[k] = instance.get(["disc.x"])[0]
    instance.close()
    assert after[:-1].tobytes() == record.disc.values[1:, 0].tobytes()


def test_description_and_documentation_state_which_row_a_unit_shows(files):
    import zipfile

    for path in files.values():
        with zipfile.ZipFile(path) as archive:
            for name in ("modelDescription.xml", "documentation/index.html"):
                assert (
                    "What is read after communication step k (counted from 0) is row k + 1"
                    in archive.read(name).decode()
                )


def test_the_loop_of_the_docs_has_the_bits_of_the_closed_loop_in_python(files, model):
    found = {}
    exec(compile(example(files[3], "FMU3Slave"), str(PAGE), "exec"), found)
    force = np.zeros((500, 2))
    force[0, 0] = 20.0
    plant = Plant(model.plant.machine)
    record = plant.simulate(0.1, 300.0, 0.3e6, disc_force=force, controller=Proportional())
    assert np.abs(found["command"]).max() > 1e-3
    assert record["disc_measured"].values.tobytes() == found["measured"].tobytes()


@pytest.mark.parametrize("version", [2, 3])
def test_a_closed_loop_by_names_does_the_same(units, model, version):
    instance = units[version].instance()
    instance.initialise({"shaft.speed_ref": 300.0})
    command, measured = np.zeros(2), np.zeros((200, 2))
    for k in range(200):
        measured[k] = instance.get(["meas.disc_x", "meas.disc_y"])
        instance.set({"piezo.ref_x": command[0], "piezo.ref_y": command[1]})
        instance.step(k * 2e-4, 2e-4)
        command = 2e4 * measured[k]
    instance.close()
    record = Plant(model.plant.machine).simulate(0.04, 300.0, 0.3e6, controller=Proportional())
    assert record["disc_measured"].values.tobytes() == measured.tobytes()


def hit(model):
    """Displacement (200, 2) after each of 200 samples, of the plant in Python that is hit at the start."""
    force = np.zeros((201, 2))
    force[:5, 0] = 20.0
    record = Plant(model.plant.machine).simulate(201 * 2e-4, 0.0, 0.3e6, disc_force=force)
    return record["disc"].values[1:]


def test_libcosimpy_gives_the_same_bits(files, units, model):
    """FMI Library runs the same file, if it is installed (pip install libcosimpy)."""
    try:
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimManipulator import CosimManipulator
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave
    except (ImportError, OSError) as error:
        pytest.skip(f"libcosimpy: {error}")
    execution = CosimExecution.from_step_size(step_size=200_000)
    plant = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=str(files[2]), instance_name="plant"))
    hand, eye = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator=hand)
    execution.add_observer(observer=eye)
    force, *disc = (units[2].variables[n].valueReference for n in ("disc.force_x", "disc.x", "disc.y"))
    rows = []
    for k in range(200):
        values = [20.0 if k < 5 else 0.0]
        hand.slave_real_values(slave_index=plant, variable_references=[force], values=values)
        execution.step()
        rows.append(eye.last_real_values(slave_index=plant, variable_references=disc))
    assert hit(model).tobytes() == np.array(rows).tobytes()


@pytest.mark.parametrize("version", [2, 3])
def test_ecospy_gives_the_same_bits(files, model, version):
    """ecospy runs the same file, if it is installed (pip install ecospy tbb; its library needs LD_LIBRARY_PATH)."""
    try:
        from ecospy.EcosSimulation import EcosSimulation
        from ecospy.EcosSimulationStructure import EcosSimulationStructure
    except (ImportError, OSError) as error:
        pytest.skip(f"ecospy: {error}")
    structure = EcosSimulationStructure()
    structure.add_model("plant", str(files[version]))
    simulation = EcosSimulation(step_size=2e-4, structure=structure)
    simulation.init()
    rows = []
    for k in range(200):
        simulation.set_real("plant::disc.force_x", 20.0 if k < 5 else 0.0)
        simulation.step()
        rows.append([simulation.get_real(f"plant::disc.{axis}") for axis in "xy"])
    simulation.terminate()
    assert hit(model).tobytes() == np.array(rows).tobytes()
