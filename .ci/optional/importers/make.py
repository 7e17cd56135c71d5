"""Exports every kind of unit with its Python reference outputs as test cases: python make.py FOLDER.

Writes the units and cases.json: file, kind, FMI version, step, inputs (rows held over a step), and the outputs that are
to be read after each step, with the deviation that is allowed (0: the same bits).
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3] / "tests/fmu"))

from law_models import scheduled_law
from lpv_models import make_lpv

from fmu.check import moving_inputs, simulated
from fmu.export import choose, export, linear_unit, plant_unit
from fmu.linear_units import INPUTS, OUTPUTS, LawUnit, answered
from fmu.ssp import write_system
from rotorsim.plant import Plant

STEPS, STEP, PRESSURE = 200, 2e-4, 0.3e6
DISC, MEASURED = ["disc.x", "disc.y"], ["meas.disc_x", "meas.disc_y"]


def case(files: dict[int, Path], kind: str, name: str, inputs: dict, outputs: list, rows: Any, allowed: float) -> list:
    """Cases of one kind for both versions of FMI; `rows` are after each step."""
    common = {"name": name, "kind": kind, "step": STEP, "outputs": outputs, "expected": np.asarray(rows).tolist()}
    common |= {"inputs": {key: np.asarray(v).tolist() for key, v in inputs.items()}, "allowed": allowed}
    return [common | {"file": str(path), "fmi": version} for version, path in files.items()]


def plant_cases(model: Any, files: dict[int, Path]) -> list:
    """References that step and a hit, against `Plant.simulate`: what is read after step k is its row k + 1."""
    reference, force = np.zeros((STEPS + 1, 2)), np.zeros((STEPS + 1, 2))
    reference[50:, 0], reference[100:, 1] = 0.5, -0.5
    force[:5, 0] = 20.0
    record = model.plant.simulate((STEPS + 1) * STEP, 0.0, PRESSURE, reference=reference, disc_force=force)
    inputs = {"piezo.ref_x": reference[:-1, 0], "piezo.ref_y": reference[:-1, 1], "disc.force_x": force[:-1, 0]}
    rows = np.hstack([record.disc.values, record.disc_measured.values])[1:]
    return case(files, "unit", "plant", inputs, DISC + MEASURED, rows, 0.0)


def law_cases(unit: LawUnit, files: dict[int, Path]) -> list:
    """A swing of the disc, against `Law.step`."""
    inputs = {name: unit.stimuli(STEPS, STEP)[name] for name in INPUTS}
    return case(files, "unit", "law", inputs, list(OUTPUTS), answered(unit.law, inputs)[1:], 0.0)


def linear_cases(unit: Any, files: dict[int, Path], name: str) -> list:
    """Moving operating point and stepping references, against `LpvModel.simulate`; held ones for model exchange."""
    inputs = moving_inputs(unit, STEPS)
    found = case(files, "unit", name, inputs, DISC, simulated(unit, inputs, STEP)[1:], 1e-9)
    if unit.continuous:
        held = {key: np.full(STEPS, v) for key, v in zip(inputs, (0.5, -0.2, 300.0, 5e5), strict=True)}
        rows = simulated(unit, held, STEP)[1:]
        found += case(files, "exchange", f"{name}, model exchange", held, DISC, rows, 1e-4)
    return found


def system_cases(model: Any, law: LawUnit, files: dict[int, Path]) -> list:
    """Plant and law in closed loop, against `Plant.simulate(controller=law)`."""
    record = model.plant.simulate((STEPS + 1) * STEP, 0.0, PRESSURE, controller=law.law.with_())
    rows = np.hstack([record.disc.values, record.reference.values])[1:]
    outputs = ["plant:disc.x", "plant:disc.y", "law:piezo.ref_x", "law:piezo.ref_y"]
    return case(files, "system", "system (.ssp)", {}, outputs, rows, 0.0)


def cases(folder: Path) -> Iterator[list]:
    """Export every kind and compute what it should show."""
    host = choose("host")
    model = plant_unit(Plant("dtu_gas_bearing", n_theta=16, n_z=8, dt=STEP), 0.0, PRESSURE)
    plants = export(model, folder / "plant.fmu", (2, 3), host)
    yield plant_cases(model, plants)
    law = LawUnit(scheduled_law(bias=(0.5, -0.2)))
    laws = export(law, folder / "law.fmu", (2, 3), host)
    yield law_cases(law, laws)
    for kind, name in (("3", "LPV model"), ("blackbox", "LPV model, sampled")):
        make_lpv(kind).save(folder / f"{kind}.json")
        unit = linear_unit(folder / f"{kind}.json")
        yield linear_cases(unit, export(unit, folder / f"linear_{kind}.fmu", (2, 3), host), name)
    systems = {}
    for v in (2, 3):
        both = {"plant": plants[v].read_bytes(), "law": laws[v].read_bytes()}
        systems[v] = write_system(model, law, both, folder / f"loop_fmi{v}.ssp")
        write_system(model, law, both, folder / f"loop_fmi{v}_ssp2.ssp", 2)  # for the checkers: no importer takes it
    yield system_cases(model, law, systems)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    found = [one for group in cases(target) for one in group]
    (target / "cases.json").write_text(json.dumps(found), encoding="utf-8")
