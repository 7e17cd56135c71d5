"""Generated C files of a linear model's unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu.linear_model import LinearUnit
from fmu.tables import MAGIC, array, row


def header(unit: LinearUnit) -> str:
    """Text of tables.h."""
    basis = unit.lpv.basis
    defines: dict[str, Any] = {
        "MAGIC": f'"{MAGIC}"',
        "MODEL_HASH": f'"{unit.hash}"',
        "TOKEN": f'"{unit.token}"',
        "SAMPLE": unit.sample.hex(),
        "CONTINUOUS": int(unit.continuous),
        "N_VARIABLES": len(unit.variables),
        "N_INPUTS": 4,
        "N_OUT": 2,
        "N_P": 1,
        "N_W": unit.order,
        "N_IX": 1,
        "N_RUNS": 1,
        "N_PRESSURE": 0,
        "GUARDED": 0,
        "N_STATES": unit.order,
        "N_THETA": len(unit.lpv.coefficients),
        "N_BASIS": len(basis.exponents),
        "N_TERMS": len(unit.terms),
        "MIDDLE": numbers(basis.middle),
        "HALF_RANGE": numbers(basis.half),
        "NOMINALS": numbers(unit.sizes),
    }
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    return "\n".join(["/* Written by the exporter. */", "#ifndef TABLES_H", "#define TABLES_H", *lines, "#endif", ""])


def source(unit: LinearUnit) -> str:
    """Text of tables.c."""
    terms = [f"{{{r}, {c}, {i}, {j}, {x.hex()}}}" for r, c, i, j, x in unit.terms]
    return "\n".join(
        [
            "/* Written by the exporter. */",
            '#include "unit.h"',
            array("const Variable variables[N_VARIABLES]", (row(v) for v in unit.variables)),
            array("const Run initial_runs[N_RUNS]", [f"{{{unit.order}, 0.0}}"]),
            array("const double initial_parameters[N_P]", ["0.0"]),
            array("const int64_t indices[N_IX]", ["0"]),
            array("const int32_t pressure_nodes[N_PRESSURE + 1][2]", ["{0, 0}"]),
            array("const Term terms[N_TERMS]", terms),
            array("const double surfaces[N_THETA][N_BASIS]", map(numbers, unit.lpv.coefficients)),
            array("const int32_t exponents[N_BASIS][2]", (f"{{{i}, {j}}}" for i, j in unit.lpv.basis.exponents)),
            "",
        ]
    )


def numbers(values: np.ndarray) -> str:
    """A C initialiser of exact numbers."""
    return "{" + ", ".join(float(x).hex() for x in values) + "}"
