"""Common interface of exported units, the tables written for their C code in `fmu/c`, and the unit of a plant.

`Unit` is the seam: whatever derives from it and has a `core` in C that serves unit.h can be exported, a law too.
Of every unit two C files are written: sizes and offsets (tables.h), variables and constant data (tables.c).
"""

import hashlib
import json
import re
import uuid
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from itertools import chain, groupby, product
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fmu.turned import Choice, Turned, chosen_machines, read_choices, turned_numbers
from fmu.variables import ROW, UnitVariable, place, plant_variables, with_choices
from reynolds.grid import cells
from reynolds.newton import FACTORISATIONS, ITERATIONS, LEFT, OVERRUNS, PRICE
from reynolds.workspace import FILM_DTYPE
from rotorsim.base.errors import DataError
from rotorsim.base.quantity import UNLIMITED
from rotorsim.effects.film.gas_heating import NOMINAL
from rotorsim.machine.limits import friction_heat, hottest
from rotorsim.plant import Plant
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import COLUMNS, HEAT_COLUMNS
from rotorsim.plant.simulation import Simulation

LONGEST_NAME = 60
"""Characters of an identifier that compilers and file systems take besides the suffix."""
MAGIC = "rotsim1"
EXTRA_COLUMNS = 3
WORK_COLUMNS = 3
"""Outputs of a plant behind the columns that its kernels fill, and behind those in turn where work is bounded."""
STORES = {
    "time": "TIME", "input": "INPUT", "output": "OUTPUT", "parameter": "PARAMETER", "seed": "SEED",
    "constant": "CONSTANT", "turned": "TURNED", "pressure": "PRESSURE", "state": "STATE", "derivative": "DERIVATIVE",
    "ticks": "TICKS",
}  # fmt: skip
DEFINES = {
    "CONTINUOUS": 0,
    "N_STATES": 0,
    "N_P": 1,
    "N_IX": 1,
    "N_RUNS": 1,
    "N_PRESSURE": 0,
    "N_TURNED": 0,
    "N_ENTRIES": 0,
    "N_VARIANTS": 1,
    "N_CHOICES": 0,
    "N_CHOSEN": 0,
    "GUARDED": 0,
    "CLOCKED": 0,
}
"""Sizes of a unit that does not state them."""
ARRAYS = {
    "double initial_parameters[N_VARIANTS * N_P]": ("0.0",),
    "int64_t indices[N_VARIANTS * N_IX]": ("0",),
    "Variant variants[N_VARIANTS]": ("{0}",),
    "Choice choices[N_CHOICES + 1]": ("{0}",),
    "double chosen[N_CHOSEN + 1]": ("0.0",),
    "int32_t pressure_nodes[N_PRESSURE + 1][2]": ("{0, 0}",),
    "Entries entries[N_ENTRIES + 1]": ("{0}",),
    "Operation operations[]": ("{0}",),
}
"""Arrays of a unit that does not have them."""


class Unit(Protocol):
    """Interface of every kind of unit."""

    @property
    def core(self) -> tuple[str, ...]:
        """C files that hold what the unit does."""

    @property
    def unit_name(self) -> str:
        """Name of the unit: the chosen one, or that of its subject and of its kind."""

    @property
    def description(self) -> str:
        """One sentence."""

    @property
    def continuous(self) -> bool:
        """Whether it can be used for model exchange."""

    @property
    def sample(self) -> float:
        """Time [s] of which communication steps are multiples."""

    @property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""

    @property
    def hash(self) -> str:
        """Fingerprint of the model."""

    @property
    def token(self) -> str:
        """Instantiation token of FMI 3.0, GUID of FMI 2.0."""
        return f"{{{uuid.UUID(self.hash)}}}"

    def defines(self) -> Mapping[str, object]:
        """Sizes and offsets of tables.h, of its own kind."""

    def arrays(self) -> Mapping[str, Iterable[str]]:
        """Items of the constant arrays of tables.c by their declarations, of its own kind."""


def fingerprint(*parts: str) -> str:
    """Hash of the parts that make a model, and of the C wrapper."""
    return hashlib.sha256("\0".join([*parts, wrapper_text()]).encode()).hexdigest()[:32]


def header(unit: Unit) -> str:
    """Text of tables.h."""
    defines = DEFINES | {
        "MAGIC": f'"{MAGIC}"', "MODEL_HASH": f'"{unit.hash}"', "TOKEN": f'"{unit.token}"', "SAMPLE": unit.sample.hex(),
        "N_VARIABLES": len(unit.variables), **unit.defines(),
    }  # fmt: skip
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    return "\n".join(["/* Written by the exporter. */", "#ifndef TABLES_H", "#define TABLES_H", *lines, "#endif", ""])


def source(unit: Unit) -> str:
    """Text of tables.c."""
    arrays = {"Variable variables[N_VARIABLES]": map(row, unit.variables)} | ARRAYS | dict(unit.arrays())
    texts = (f"const {name} = {{\n    " + ",\n    ".join(items) + "\n};" for name, items in arrays.items())
    return "\n".join(["/* Written by the exporter. */", '#include "unit.h"', *texts, ""])


def row(v: UnitVariable) -> str:
    """A variable's row in the C table."""
    settable = {
        "input": "ALWAYS",
        "parameter": "ALWAYS" if v.tunable else "BEFORE_START",
        "seed": "BEFORE_START",
        "state": "BEFORE_START",
        "turned": "BEFORE_START",
        "ticks": "ALWAYS",
    }
    unit = "" if v.unit == "1" else v.unit
    texts = [json.dumps(text, ensure_ascii=False) for text in (v.why, v.beyond)]
    parts = [
        f'"{v.name}"', f'"{unit}"', v.kind.upper(), STORES[v.store], settable.get(v.store, "NEVER"), v.index,
        float(v.low).hex(), float(v.high).hex(), float(v.start or 0.0).hex(),
        *(float(x).hex() for x in v.checked), *texts,
    ]  # fmt: skip
    return "{" + ", ".join(map(str, parts)) + "}"


def runs(w: np.ndarray) -> list[tuple[int, float]]:
    """The workspace as runs of equal values; -0.0 is not 0.0."""
    return [(len(list(group)), float.fromhex(key)) for key, group in groupby(float(x).hex() for x in w)]


def numbers(values: np.ndarray) -> str:
    """A C initialiser of exact numbers."""
    return "{" + ", ".join(float(x).hex() for x in values) + "}"


@dataclass(frozen=True)
class PlantUnit(Unit):
    """A plant to be exported, at rest at `speed` [rad/s] and gauge `pressure` [Pa] when it starts.

    `over` are paths of its machine with the values that the unit offers.
    """

    plant: Plant
    speed: float
    pressure: float
    chosen_name: str = ""
    over: tuple[tuple[str, tuple[float | str, ...]], ...] = ()
    core = ("plant.c",)
    continuous = False

    @property
    def unit_name(self) -> str:
        """Name of the unit."""
        return self.chosen_name or f"{self.plant.machine.name}_plant"

    @property
    def sample(self) -> float:
        """Sampling time [s] of the machine, of which communication steps are multiples."""
        return self.plant.machine.sampling_time

    @property
    def description(self) -> str:
        """One sentence."""
        return self.plant.machine.description or f"{self.plant.machine.name}: rotor on gas bearings."

    @property
    def assembly(self) -> Assembly:
        """The plant's layouts, workspace and parameters."""
        return self.plant.assembly

    @cached_property
    def choices(self) -> tuple[Choice, ...]:
        """Numbers of the machine that are chosen from lists before it starts."""
        return read_choices(self.assembly, dict(self.over))

    @cached_property
    def variants(self) -> tuple["PlantUnit", ...]:
        """Units of the machines of all choices, its own first.

        Raises DataError where one needs other kernels, and for what can be set without a list.
        """
        if not self.over:
            return (self,)
        own = replace(self, over=())
        settable = {v.name for v in own.variables if v.store != "constant"}
        for one in self.choices:
            if one.name in settable:
                raise DataError(f"over: {one.name} can be set in any unit of this machine; leave {one.path} out")
        machines = chosen_machines(self.plant.machine, self.choices)
        found = (own, *(replace(own, plant=Plant(machine)) for machine in machines[1:]))
        for unit in found:
            same = unit.assembly.module.__name__ == own.assembly.module.__name__
            if not same or unit.fixed != own.fixed:
                raise DataError(
                    "over: a machine of these values has kernels, or limits of a run, of its own; export it by itself"
                )
            for v in own.variables:
                if v.store == "parameter" and unit.assembly.numbers[v.index] != own.assembly.numbers[v.index]:
                    raise DataError(
                        f"over: these values change the start of {v.name}, which can be set; state it in the machine "
                        "file, or export such a machine by itself",
                        argument="over",
                        value=v.name,
                    )
        return found

    @cached_property
    def turned(self) -> tuple[Turned, ...]:
        """Numbers of the machine that can be set before it starts, within the limits of all variants."""
        if not self.over:
            return turned_numbers(self.assembly)
        others = [{one.name: one for one in variant.turned} for variant in self.variants]
        found = []
        for one in self.variants[0].turned:
            if all(one.name in other for other in others):
                low, high = max(o[one.name].low for o in others), min(o[one.name].high for o in others)
                found.append(replace(one, low=low, high=high))
        return tuple(found)

    @cached_property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""
        found = plant_variables(self.assembly, self.speed, self.pressure, self.turned)
        return with_choices(found, self.choices, [one.variables for one in self.variants[1:]])

    @cached_property
    def hash(self) -> str:
        """Hash of machine, kernels and variables that identifies this model."""
        return fingerprint(
            self.plant.machine.text, self.assembly.module.__name__, software(), repr((self.variables, self.choices))
        )

    @property
    def modules(self) -> list[str]:
        """Modules that register the machine's effects."""
        return sorted({type(e).__module__ for es in self.plant.machine.effects.values() for e in es})

    def defines(self) -> dict[str, object]:
        """Sizes and offsets of workspace, parameters and columns, what ends a run, and sizes of what can be set."""
        each = self._turned_in_each
        return self.fixed | {
            "N_RUNS": sum(len(runs(one.assembly.w)) for one in self.variants),
            "N_TURNED": len(self.turned) + len(self.choices),
            "N_ENTRIES": sum(len(one.entries) for turned in each for one in turned),
            "N_VARIANTS": len(self.variants),
            "N_CHOICES": len(self.choices),
            "N_CHOSEN": sum(len(one.values) for one in self.choices),
        }

    @property
    def _turned_in_each(self) -> list[list[Turned]]:
        """The numbers that can be set, as each variant computes what follows from them."""
        found = [{one.name: one for one in variant.turned} for variant in self.variants]
        return [[own[one.name] for one in self.turned] for own in found]

    @property
    def fixed(self) -> dict[str, object]:
        """Sizes and offsets of workspace, parameters and columns, and what ends a run: the same for all variants."""
        a = self.assembly
        at = {v.name: v.index for v in self.variables if v.store == "input"}
        memory = a.film.convergence
        return {
            "STEPS": a.steps_per_sample,
            "AMBIENT": float(a.machine.gas.ambient_pressure).hex(),
            "N_INPUTS": len(at),
            "N_OUT": _outputs(a),
            "BOUNDED": int(a.machine.solver.corrections is not None),
            "WORK(w)": f"(w[{memory + ITERATIONS}] + {PRICE} * w[{memory + FACTORISATIONS}])",
            "W_LEFT": memory + LEFT,
            "W_OVERRUNS": memory + OVERRUNS,
            "N_P": a.record.dtype.itemsize // 8,
            "N_W": a.w.size,
            "N_IX": a.ix.size,
            "N_INJ": a.film.n_inj,
            "N_PRESSURE": len(pressure_nodes(a)),
            "INPUT_PLACES": "{" + ", ".join(str(at.get(name, -1)) for name in ROW) + "}",
            "DRIVE_ON": at["drive.on"],
            "TOUCHDOWN": COLUMNS.index("contact") if a.film_model is not None else -1,
            "W_SEED": a.rig.seed,
            "W_COMMAND": a.rig.command,
            "W_SPEED": a.rotor.speed,
            "W_LOAD": a.rotor.static_rhs,
            "P_AMBIENT": place(a, "film_0", "pa") if a.films else -1,
            "P_CLEARANCE": place(a, "film_0", "clearance"),
            "N_FILMS": len(a.films),
            "FILM_RECORD": FILM_DTYPE.itemsize // 8,
        } | _ends(a, [one.name for one in self.turned])

    def arrays(self) -> dict[str, Iterable[str]]:
        """Workspace at the start, parameters, indices and the film's cells."""
        each = [one.assembly for one in self.variants]
        nodes, filled = (*pressure_nodes(each[0]), (0, 0)), [runs(a.w) for a in each]
        begins = np.cumsum([0, *map(len, filled)])
        return {
            "Run initial_runs[N_RUNS]": (f"{{{n}, {x.hex()}}}" for own in filled for n, x in own),
            "double initial_parameters[N_VARIANTS * N_P]": (float(x).hex() for a in each for x in a.numbers),
            "int64_t indices[N_VARIANTS * N_IX]": (str(i) for a in each for i in a.ix),
            "int32_t pressure_nodes[N_PRESSURE + 1][2]": (f"{{{i}, {j}}}" for i, j in nodes),
            **_turned_arrays(self._turned_in_each, begins),
            **_choice_arrays(self.choices, len(self.turned)),
        }


def _outputs(a: Assembly) -> int:
    """Outputs of a unit."""
    return a.columns + EXTRA_COLUMNS + (0 if a.machine.solver.corrections is None else WORK_COLUMNS)


def _turned_arrays(each: Sequence[Sequence[Turned]], begins: np.ndarray) -> dict[str, Iterable[str]]:
    """Entries that follow from what can be set, variant by variant; operations of all formulas, each formula once.

    `begins` are the first runs of the variants.
    """
    formulas = list(dict.fromkeys(e.formula for turned in each for one in turned for e in one.entries))
    ends = np.cumsum([0, *map(len, formulas)])
    first = dict(zip(formulas, ends, strict=False))
    rows = [
        [
            f"{{{k}, {int(e.in_record)}, {int(e.least)}, {e.place}, {e.count}, {first[e.formula]}, {len(e.formula)}}}"
            for k, one in enumerate(turned)
            for e in one.entries
        ]
        for turned in each
    ]
    steps = [f"{{{operation}, {constant.hex()}}}" for formula in formulas for operation, constant in formula]
    places = zip(begins, np.cumsum([0, *map(len, rows)]), rows, strict=False)
    return {
        "Entries entries[N_ENTRIES + 1]": [*chain(*rows), "{0}"],
        "Operation operations[]": [*steps, "{0}"],
        "Variant variants[N_VARIANTS]": [f"{{{run}, {entry}, {len(own)}}}" for run, entry, own in places],
    }


def _choice_arrays(choices: Sequence[Choice], turned: int) -> dict[str, Iterable[str]]:
    """Numbers that are chosen from lists, behind so many others that can be set, and the lists."""
    values = [value for one in choices for value in one.values]
    firsts = np.cumsum([0, *(len(one.values) for one in choices)])
    rows = [f"{{{turned + k}, {firsts[k]}, {len(one.values)}}}" for k, one in enumerate(choices)]
    return {
        "Choice choices[N_CHOICES + 1]": [*rows, "{0}"],
        "double chosen[N_CHOSEN + 1]": [float(value).hex() for value in (*values, 0.0)],
    }


def _ends(a: Assembly, turned: Sequence[str]) -> dict[str, Any]:
    """Places and limits of what ends a run: the gap and the temperatures of the films."""
    machine = a.machine
    warm = HEAT_COLUMNS * len(a.films) if a.rig.n_heat else 0
    rise, heating = friction_heat(machine)
    pushed = any(effect.stiffness > 0 for effect in machine.effects.get("contact", ()))  # type: ignore[attr-defined]
    limits = {
        "TEMPERATURE": machine.gas.temperature,
        "RISE": rise,
        "HEATING": heating / NOMINAL**2,
        "HOTTEST": min(hottest(machine), UNLIMITED),
    }
    places = {"H_MIN": COLUMNS.index("h_min") if a.films else -1, "FIRST_RISE": a.columns - warm, "N_RISES": warm}
    places |= {"PUSHED": int(pushed)}
    places |= {"TURNED_TEMPERATURE": turned.index("gas.temperature") if "gas.temperature" in turned else -1}
    return places | {name: float(value).hex() for name, value in limits.items()}


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


STATE_TYPES = (("struct ", "State"), ("enum ", "Phase"))
"""Declarations in unit.h that a state follows from."""
STATE_NUMBERS = {"uint64_t": "<u8", "int64_t": "<i8", "double": "<f8"}
FNV_BASIS, FNV_PRIME = 1469598103934665603, 1099511628211
"""Start and factor of the check sum of a state."""


def state_of(unit: PlantUnit, simulation: Simulation) -> bytes:
    """A serialised state, at time 0, of a unit that continues a simulation of its plant, with the inputs held there.

    Raises DataError for a simulation of another machine.
    """
    a, own = unit.assembly, simulation.assembly
    hashes = [one.plant.machine.hash for one in unit.variants]
    if own.machine.hash not in hashes or simulation.w.size != a.w.size:
        raise DataError(f"simulation: is of {own.machine.name}, another machine than that of the unit; start its own")
    w, rig = simulation.w, a.rig
    places = [rig.command, rig.supply, rig.held_x, rig.held_y, a.rotor.disc_fx, a.rotor.disc_fy]
    inputs = dict(zip(ROW, w[places], strict=True))
    inputs["injection.pressure"] -= a.machine.gas.ambient_pressure
    inputs["drive.on"] = float(not simulation.coasts)
    chosen = list(product(*(one.values for one in unit.choices)))[hashes.index(own.machine.hash)]
    kind, steps = state_layout(unit)
    row = np.zeros(1, kind)
    found = {
        "magic": MAGIC.encode(), "hash": unit.hash.encode(), "size": kind.itemsize, "stop": np.inf, "seed": w[rig.seed],
        "phase": steps, "inputs": [inputs.get(v.name, v.start or 0.0) for v in unit.variables if v.store == "input"],
        "parameters": a.numbers, "turned": [*(one.value for one in unit.turned), *chosen, 0.0], "w": w,
    }  # fmt: skip
    for name, value in found.items():
        row[name] = value
    assert kind.fields is not None
    check = FNV_BASIS
    for byte in row.tobytes()[kind.fields["count"][1] :]:
        check = ((check ^ byte) * FNV_PRIME) % 2**64
    row["check"] = check
    return row.tobytes()


def state_layout(unit: Unit, last: str = "w") -> tuple[np.dtype[Any], int]:
    """Members of a state as unit.h declares them, up to the `last`, and the phase between two steps."""
    text = (Path(__file__).parent / "c" / "unit.h").read_text(encoding="utf-8")
    [(members,), (phases,)] = (re.findall(rf"typedef {start}{{([^}}]*)}} {name};", text) for start, name in STATE_TYPES)
    known: dict[str, Any] = {**DEFINES, **unit.defines()}
    kinds: list[Any] = []
    for kind, names in re.findall(r"(\w+) ([^;]+);", members):
        for name, size in re.findall(r"(\w+)(?:\[([^]]+)\])?", names):
            if kinds and kinds[-1][0] == last:
                break
            count = sum(int(known.get(word, word)) for word in size.split(" + ")) if size else 0
            kinds.append((name, f"S{count}") if kind == "char" else (name, STATE_NUMBERS[kind], (count,) * bool(size)))
    return np.dtype(kinds), phases.replace(",", " ").split().index("STEPPING")


def identifier(unit: Unit) -> str:
    """The C identifier that names a unit's libraries."""
    return as_identifier(unit.unit_name)


def as_identifier(name: str) -> str:
    """A name as a C identifier, with an underscore for what an identifier has not."""
    found = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "unit"
    return (found if found[0].isalpha() else f"unit_{found}")[:LONGEST_NAME]


def check_name(name: str) -> str:
    """A name that is asked for; raises DataError for one that is no C identifier, which the standard wants."""
    if re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_NAME - 1}}}", name):
        return name
    raise DataError(
        f"name: '{name[:80]}' is not a name of a unit; write at most {LONGEST_NAME} letters, digits and underscores, "
        "a letter first"
    )


def software() -> str:
    """Name and version of this software."""
    try:
        return f"rotorsim {version('rotorsim')}"
    except PackageNotFoundError:
        return "rotorsim source"


def wrapper_text() -> str:
    """All of the C wrapper."""
    folder = Path(__file__).parent / "c"
    return "".join(p.read_text(encoding="utf-8") for p in sorted(folder.iterdir()) if p.suffix in (".c", ".h"))
