"""Runs one case of cases.json in one importer and prints the rows as JSON: python play.py IMPORTER NUMBER CASES.

Runs where the importers are installed; a process of its own, because some end it.
"""

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

Rows = list[list[float]]
SUBSTEPS = 20
"""Runge-Kutta steps in a sample for importers without a solver."""


def references(case: dict) -> tuple[dict[str, int], str, str]:
    """Value references by name, the token and the identifier of the model."""
    with zipfile.ZipFile(case["file"]) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    variables = root.find("ModelVariables")
    assert variables is not None
    token = root.get("guid") or root.get("instantiationToken") or ""
    identifier = next(one.get("modelIdentifier", "") for one in root.iter("CoSimulation"))
    return {v.get("name", ""): int(v.get("valueReference", "")) for v in variables}, token, identifier


def fmpy(case: dict) -> Rows:
    """FMPy's own loop: simulate_fmu and simulate_ssp."""
    from fmpy import simulate_fmu

    n, step = len(case["expected"]), case["step"]
    if case["kind"] == "system":
        from fmpy.ssp.simulation import simulate_ssp

        found = simulate_ssp(case["file"], stop_time=(n - 0.5) * step, step_size=step)
        return np.stack([found[name.replace(":", ".")] for name in case["outputs"]], axis=1)[:n].tolist()
    table = np.zeros(n, [("time", float), *((name, float) for name in case["inputs"])])
    table["time"] = np.arange(n) * step
    for name, values in case["inputs"].items():
        table[name] = values
    kind = "ModelExchange" if case["kind"] == "exchange" else "CoSimulation"
    start = {name: values[0] for name, values in case["inputs"].items()} if kind == "ModelExchange" else {}
    found = simulate_fmu(
        case["file"], fmi_type=kind, stop_time=n * step, output_interval=step, relative_tolerance=1e-9,
        input=table if kind == "CoSimulation" else None, start_values=start, output=case["outputs"],
    )  # fmt: skip
    return np.stack([found[name] for name in case["outputs"]], axis=1)[1:].tolist()


def fmuloader(case: dict) -> Rows:
    """fmuloader, which has the functions of the standard and no loop."""
    three = case["fmi"] == 3
    if three:
        from fmuloader.fmi3 import Fmi3Slave as Slave
    else:
        from fmuloader.fmi2 import Fmi2Slave as Slave, Fmi2Type
    refs, token, identifier = references(case)
    unit, exchange = Slave(case["file"], model_identifier=identifier), case["kind"] == "exchange"
    if three:
        make = unit.instantiate_model_exchange if exchange else unit.instantiate_co_simulation
        make("unit", instantiation_token=token)
    else:
        unit.instantiate("unit", Fmi2Type.MODEL_EXCHANGE if exchange else Fmi2Type.CO_SIMULATION, guid=token)
        unit.setup_experiment()
    unit.enter_initialization_mode()
    unit.exit_initialization_mode()
    set_real, get_real = (unit.set_float64, unit.get_float64) if three else (unit.set_real, unit.get_real)
    if exchange:
        (unit.update_discrete_states if three else unit.new_discrete_states)()
        unit.enter_continuous_time_mode()
    inputs, outputs, rows = [refs[n] for n in case["inputs"]], [refs[n] for n in case["outputs"]], []
    for k, values in enumerate(zip(*case["inputs"].values(), strict=True)):
        set_real(inputs, list(values))
        if exchange:
            runge_kutta(unit, three, k * case["step"], case["step"], sum(name.startswith("der(") for name in refs))
        else:
            unit.do_step(k * case["step"], case["step"])
        rows.append(list(get_real(outputs)))
    unit.terminate()
    return rows


def runge_kutta(unit, three: bool, start: float, length: float, n: int) -> None:
    """The states of a unit for model exchange after a time, by the classical method."""
    derivatives = unit.get_continuous_state_derivatives if three else unit.get_derivatives
    h = length / SUBSTEPS

    def slope(t: float, x: np.ndarray) -> np.ndarray:
        unit.set_time(t)
        unit.set_continuous_states(x.tolist())
        return np.array(derivatives(n))

    for k in range(SUBSTEPS):
        t, x = start + k * h, np.array(unit.get_continuous_states(n))
        a = slope(t, x)
        b = slope(t + h / 2, x + h / 2 * a)
        c = slope(t + h / 2, x + h / 2 * b)
        d = slope(t + h, x + h * c)
        unit.set_continuous_states((x + h / 6 * (a + 2 * b + 2 * c + d)).tolist())
        unit.completed_integrator_step()


def libcosimpy(case: dict) -> Rows:
    """libcosim (FMI Library), its fixed-step algorithm."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    eye, hand = CosimObserver.create_last_value(), CosimManipulator.create_override()
    if case["kind"] == "system":
        run = CosimExecution.from_ssp_file(case["file"])
        slaves = {info.name.decode(): info.index for info in run.slave_infos()}
        places = [(slaves[part], name) for part, name in (o.split(":") for o in case["outputs"])]
    else:
        run = CosimExecution.from_step_size(step_size=round(case["step"] * 1e9))
        unit = run.add_local_slave(local_slave=CosimLocalSlave(fmu_path=case["file"], instance_name="unit"))
        places = [(unit, name) for name in case["outputs"]]
    run.add_manipulator(manipulator=hand)
    run.add_observer(observer=eye)
    refs = {(s, v.name.decode()): v.reference for s in {s for s, _ in places} for v in run.slave_variables(s)}
    inputs = [refs[unit, name] for name in case["inputs"]] if case["inputs"] else []
    rows, table = [], list(zip(*case["inputs"].values(), strict=True))
    for k in range(len(case["expected"])):
        if inputs:
            hand.slave_real_values(slave_index=unit, variable_references=inputs, values=list(table[k]))
        if not run.step():
            raise RuntimeError(f"step {k} failed")
        rows.append([eye.last_real_values(slave_index=s, variable_references=[refs[s, n]])[0] for s, n in places])
    return rows


def ecospy(case: dict) -> Rows:
    """ecos (fmi4c inside), its fixed-step algorithm."""
    from ecospy.EcosSimulation import EcosSimulation
    from ecospy.EcosSimulationStructure import EcosSimulationStructure

    if case["kind"] == "system":
        run = EcosSimulation(step_size=case["step"], ssp_path=case["file"])
    else:
        structure = EcosSimulationStructure()
        structure.add_model("unit", case["file"])
        run = EcosSimulation(step_size=case["step"], structure=structure)
    run.init()
    rows, places = [], [(o if ":" in o else f"unit:{o}").replace(":", "::") for o in case["outputs"]]
    for k in range(len(case["expected"])):
        for name, values in case["inputs"].items():
            run.set_real(f"unit::{name}", values[k])
        run.step()
        rows.append([run.get_real(place) for place in places])
    run.terminate()
    return rows


def c_program(case: dict) -> Rows:
    """tests/fmu/player.c: the C functions of FMI 3.0, in a process without Python."""
    import fmpy

    root, folder = Path(__file__).parents[3], Path(case["file"]).parent
    headers, player = Path(fmpy.__file__).parent / "c-code", folder / "player"
    subprocess.run(["gcc", "-O1", f"-I{headers}", root / "tests/fmu/player.c", "-o", player, "-ldl", "-lm"], check=True)
    with zipfile.ZipFile(case["file"]) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".so"))
        (folder / "unit.so").write_bytes(archive.read(name))
    refs, token, _ = references(case)
    n, ins, outs = len(case["expected"]), case["inputs"], case["outputs"]
    head = [case["step"], n, len(ins), len(outs), *(refs[name] for name in (*ins, *outs))]
    words = [*head, *(x for row in zip(*ins.values(), strict=True) for x in row)]
    done = subprocess.run(
        [player, folder / "unit.so", token],
        input="\n".join(map(repr, words)),
        capture_output=True,
        text=True,
        check=True,
    )
    return [[float(x) for x in line.split(",")] for line in done.stdout.splitlines()][1:]


PLAYERS = {"fmpy": fmpy, "fmuloader": fmuloader, "libcosimpy": libcosimpy, "ecospy": ecospy, "c": c_program}

if __name__ == "__main__":
    chosen = json.loads(Path(sys.argv[3]).read_text(encoding="utf-8"))[int(sys.argv[2])]
    result = PLAYERS[sys.argv[1]](chosen)
    print("\nROWS " + json.dumps(result))
