"""Generated C files of a plant unit: sizes and offsets (tables.h), variables and constant data (tables.c)."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import groupby
from typing import Any

import numpy as np

from fmu.model import PlantUnit
from fmu.variables import ROW, UnitVariable
from reynolds.grid import cells
from rotorsim.base.quantity import UNLIMITED
from rotorsim.effects.film.gas_heating import NOMINAL
from rotorsim.machine.limits import friction_heat, hottest
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import COLUMNS, HEAT_COLUMNS

MAGIC = "rotsim1"
EXTRA_COLUMNS = 3
STORES = {
    "time": "TIME", "input": "INPUT", "output": "OUTPUT", "parameter": "PARAMETER", "seed": "SEED",
    "constant": "CONSTANT", "pressure": "PRESSURE", "state": "STATE", "derivative": "DERIVATIVE",
}  # fmt: skip


def header(model: PlantUnit) -> str:
    """Text of tables.h."""
    a = model.assembly
    inputs = [v for v in model.variables if v.store == "input"]
    at = {v.name: v.index for v in inputs}
    defines: dict[str, Any] = {
        "MAGIC": f'"{MAGIC}"',
        "MODEL_HASH": f'"{model.hash}"',
        "TOKEN": f'"{model.token}"',
        "SAMPLE": model.sample.hex(),
        "CONTINUOUS": 0,
        "N_STATES": 0,
        "STEPS": a.steps_per_sample,
        "AMBIENT": float(a.machine.gas.ambient_pressure).hex(),
        "N_VARIABLES": len(model.variables),
        "N_INPUTS": len(inputs),
        "N_OUT": a.columns + EXTRA_COLUMNS,
        "N_P": a.record.dtype.itemsize // 8,
        "N_W": a.w.size,
        "N_IX": a.ix.size,
        "N_INJ": a.film.n_inj,
        "N_RUNS": len(runs(a.w)),
        "N_PRESSURE": len(pressure_nodes(a)),
        "GUARDED": 0,
        "INPUT_PLACES": "{" + ", ".join(str(at.get(name, -1)) for name in ROW) + "}",
        "DRIVE_ON": at["drive.on"],
        "TOUCHDOWN": COLUMNS.index("contact") if a.film_model is not None else -1,
        "W_SEED": a.rig.seed,
        "W_COMMAND": a.rig.command,
        "W_SPEED": a.rotor.speed,
        "W_LOAD": a.rotor.static_rhs,
    }
    defines |= _ends(a)
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    return "\n".join(["/* Written by the exporter. */", "#ifndef TABLES_H", "#define TABLES_H", *lines, "#endif", ""])


def _ends(a: Assembly) -> dict[str, Any]:
    """Places and limits of what ends a run: the gap and the temperatures of the films."""
    machine = a.machine
    warm = HEAT_COLUMNS * len(a.films) if a.rig.n_heat else 0
    rise, heating = friction_heat(machine)
    pushed = any(effect.stiffness > 0 for effect in machine.effects.get("contact", ()))  # type: ignore[attr-defined]
    deepest = max((film.clearance for film in machine.films), default=0.0) if pushed else 0.0
    numbers = {
        "DEEPEST": deepest,
        "WARMTH": machine.gas.temperature + rise,
        "HEATING": heating / NOMINAL**2,
        "HOTTEST": min(hottest(machine), UNLIMITED),
    }
    places = {"H_MIN": COLUMNS.index("h_min") if a.films else -1, "FIRST_RISE": a.columns - warm, "N_RISES": warm}
    return places | {name: float(value).hex() for name, value in numbers.items()}


def source(model: PlantUnit) -> str:
    """Text of tables.c."""
    a = model.assembly
    nodes = [*pressure_nodes(a), (0, 0)]
    return "\n".join(
        [
            "/* Written by the exporter. */",
            '#include "unit.h"',
            array("const Variable variables[N_VARIABLES]", (row(v) for v in model.variables)),
            array("const Run initial_runs[N_RUNS]", (f"{{{n}, {x.hex()}}}" for n, x in runs(a.w))),
            array("const double initial_parameters[N_P]", (float(x).hex() for x in a.record.view("f8").ravel())),
            array("const int64_t indices[N_IX]", map(str, a.ix)),
            array("const int32_t pressure_nodes[N_PRESSURE + 1][2]", (f"{{{i}, {j}}}" for i, j in nodes)),
            "",
        ]
    )


def array(declaration: str, items: Iterable[str]) -> str:
    """A C array."""
    return f"{declaration} = {{\n    " + ",\n    ".join(items) + "\n};"


def row(v: UnitVariable) -> str:
    """A variable's row in the C table."""
    settable = {
        "input": "ALWAYS",
        "parameter": "ALWAYS" if v.tunable else "BEFORE_START",
        "seed": "BEFORE_START",
        "state": "BEFORE_START",
    }
    unit = "" if v.unit == "1" else v.unit
    texts = [json.dumps(text, ensure_ascii=False) for text in (v.why, v.beyond)]
    parts = [
        f'"{v.name}"', f'"{unit}"', v.kind.upper(), STORES[v.store], settable.get(v.store, "NEVER"), v.index,
        str(v.whole).lower(), float(v.low).hex(), float(v.high).hex(), float(v.start or 0.0).hex(),
        *(float(x).hex() for x in v.checked), *texts,
    ]  # fmt: skip
    return "{" + ", ".join(map(str, parts)) + "}"


def runs(w: np.ndarray) -> list[tuple[int, float]]:
    """The workspace as runs of equal values; -0.0 is not 0.0."""
    return [(len(list(group)), float.fromhex(key)) for key, group in groupby(float(x).hex() for x in w)]


def pressure_nodes(a: Assembly) -> list[tuple[int, int]]:
    """The two workspace cells of each interval in z, theta by theta: film pressure is their mean."""
    if a.film_model is None:
        return []
    L = a.film
    lines = L.p + L.first + np.arange(L.n_theta) * L.stride
    inside = L.p + cells(L)
    upper = (lines + L.n_rows)[:, None]
    lower = upper if L.half else (lines - 1)[:, None]
    columns = [lower, inside[:, :0:-1], inside, upper] if L.half else [lower, inside, upper]
    nodes = np.hstack(columns)
    return [(int(i), int(j)) for i, j in zip(nodes[:, :-1].ravel(), nodes[:, 1:].ravel(), strict=True)]
