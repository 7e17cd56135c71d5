"""Verdicts of `diagnose` on records with hidden effects that pass through the formats of laboratories.

    python studies/benchmarks/diagnose_lab_formats.py [FIRST [COUNT [FOLDER]]]

Each hidden record is put on another recorder: 51.2 kHz, a keyphasor in place of the encoder, three probes at 45, 135
and 90 deg of which one is dead, gap voltages, pressure in psi; as CSV in volts, UFF 58 in mils, or MATLAB. From there
it comes back through a mapping and `identification.resample`. The inputs are steps of the actuators' sample
rate, as a drive's output shows them. A wrong name ends the script with 1.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import savemat
from scipy.signal import resample_poly

sys.path.append(str(Path(__file__).resolve().parents[2]))

import identification as idn
from rotorsim.base.errors import RotorsimError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.hidden_machine import truth_twin
from rotorsim.machine import load_machine
from studies.benchmarks.diagnose import STEP
from studies.benchmarks.hidden_case import KINDS, hidden_case
from studies.benchmarks.verdicts import judged

RATE, UP, DOWN = 51200, 256, 25
MIL, PSI, VOLTS = 25.4e-6, 6894.757293168361, 0.2
ANGLES = {"A": 45.0, "B": 135.0, "C": 90.0}
GAP = -9.5
Columns = dict[str, np.ndarray]


def recorded(record: xr.Dataset, dead: str) -> Columns:
    """Columns of a recorder at 51.2 kHz: keyphasor and drive in V, probes in mils, pressure in psi."""
    n = record.sizes["time"]
    t = np.arange(n * UP // DOWN) / RATE
    own = np.arange(n) / 5000
    angle = np.interp(t, own, np.unwrap(record["angle_measured"].values))
    held = np.minimum((t * 5000 + 1e-6).astype(int), n - 1)
    x, y = resample_poly(record["disc_measured"].values, UP, DOWN, axis=0, padtype="line")[: t.size].T
    columns = {"key": np.where(np.mod(angle, 2 * np.pi) < 0.2, -10.0, -2.0)}
    for name, degrees in ANGLES.items():
        reading = (x * np.cos(np.deg2rad(degrees)) + y * np.sin(np.deg2rad(degrees))) / MIL
        columns[name] = np.zeros_like(t) if name == dead else reading
    for channel, drive in (("reference", "drive"), ("disc_force", "hammer")):
        if channel in record and np.any(record[channel].values):
            columns |= {f"{drive} {axis}": record[channel].sel(axis=axis).values[held] for axis in "xy"}
    if "pressure_measured" in record:
        columns["supply"] = np.interp(t, own, record["pressure_measured"].values) / PSI
    return columns


def mapping(columns: Columns, unit: str) -> dict[str, Any]:
    """The mapping of such a file; its probes are in volts or in mils."""
    more = {"sensitivity": "200 mV/mil", "coupling": "DC", "gap": f"{GAP} V"} if unit == "V" else {}
    channels: dict[str, Any] = {"pressure_measured": {"column": "supply", "unit": "psi"}} if "supply" in columns else {}
    for channel, drive, own in (("reference", "drive", "V"), ("disc_force", "hammer", "N")):
        if f"{drive} x" in columns:
            channels[channel] = {axis: {"column": f"{drive} {axis}", "unit": own} for axis in "xy"}
    return {
        "time": {"sample_rate": "51.2 kHz"},
        "keyphasor": {"column": "key", "unit": "V"},
        "probes": {name: {"column": name, "unit": unit, "angle": f"{a} deg"} | more for name, a in ANGLES.items()},
        "channels": channels,
    }


def as_csv(path: Path, columns: Columns) -> dict[str, Any]:
    """CSV with the probes in volts round their gap voltage."""
    volts = {k: v * VOLTS + GAP if k in ANGLES else v for k, v in columns.items()}
    np.savetxt(path.with_suffix(".csv"), np.column_stack(list(volts.values())), "%.7g", ",",
               header=",".join(volts), comments="")  # fmt: skip
    return mapping(columns, "V")


def as_mat(path: Path, columns: Columns) -> dict[str, Any]:
    """MATLAB file in single precision, probes in mils."""
    names = {name: name.replace(" ", "_") for name in columns}
    savemat(path.with_suffix(".mat"), {names[k]: v.astype(np.float32) for k, v in columns.items()})
    found = mapping(columns, "mil")
    for channel in found["channels"].values():
        for part in (channel,) if "column" in channel else channel.values():
            part["column"] = names[part["column"]]
    return found


def as_uff(path: Path, columns: Columns) -> dict[str, Any]:
    """UFF 58, binary in single precision, probes in mils."""
    units = {"key": "V", "supply": "psi"} | dict.fromkeys(ANGLES, "mil")
    with path.with_suffix(".uff").open("wb") as file:
        for node, (name, values) in enumerate(columns.items(), 1):
            data = values.astype("<f4").tobytes()
            unit = units.get(name, "N" if name.startswith("hammer") else "V")
            file.write(f"    -1\n    58b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}\n".encode())
            file.write((header58(name, node, unit, values.size) + "\n").encode() + data + b"\n    -1\n")
    found = mapping(columns, "mil")
    del found["time"]
    return found


def header58(title: str, node: int, unit: str, n: int) -> str:
    """The eleven header records of a time response in single precision."""
    freedom = f"{1:5d}{1:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{1:4d} {'NONE':10s}{0:10d}{0:4d}"
    kind = f"{2:10d}{n:10d}{1:10d}{0.0:13.5e}{1 / RATE:13.6e}{0.0:13.5e}"
    axes = [f"{code:10d}{0:5d}{0:5d}{0:5d} {label:20s} {text:20s}" for code, label, text in
            ((17, "Time", "s"), (8, title, unit), (0, "NONE", "NONE"), (0, "NONE", "NONE"))]  # fmt: skip
    return "\n".join([f"{title:80s}", "NONE", "01-JAN-24 00:00:00", "NONE", "NONE", freedom, kind, *axes])


WRITERS: dict[str, Callable[[Path, Columns], dict[str, Any]]] = {".uff": as_uff, ".csv": as_csv, ".mat": as_mat}


def through(record: xr.Dataset, folder: Path, kind: str, dead: str) -> xr.Dataset:
    """A record after its way through a laboratory's file."""
    path = folder / str(record.attrs["record"])
    columns = recorded(record, dead)
    found = WRITERS[kind](path, columns)
    file = path.with_suffix(kind)
    back = idn.resample(idn.read(file, found), 5000.0)
    file.unlink()
    return back.assign_attrs({key: record.attrs[key] for key in ("role", "record")})


def main() -> int:
    """Hide, convert and diagnose case after case, and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("first", type=int, nargs="?", default=300_000, help="seed of the first case")
    parser.add_argument("count", type=int, nargs="?", default=6, help="number of cases")
    parser.add_argument("folder", type=Path, nargs="?", help="folder of temporary files")
    asked = parser.parse_args()
    first, count = asked.first, asked.count
    machine = load_machine("dtu_gas_bearing")
    truth_plant, models = replace(truth_twin(machine), step=STEP), CompiledModels.of(machine)
    known, verdicts = {f.key for f in candidates(models.twin)}, []
    print("| case | kind | file | dead | hidden | status | effects | ties | verdict | seconds |\n|" + "---|" * 10)
    for number in range(first, first + count):
        kind = KINDS[number % len(KINDS)]
        _, truth, records = hidden_case(number, kind, machine, truth_plant)
        hidden = tuple(f.key for f in truth.forms)
        form, dead = list(WRITERS)[number % len(WRITERS)], "CAB"[number // 3 % 3]
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
            records = [through(record, Path(folder), form, dead) for record in records]
        only = None
        if kind == "left_out":
            only = {f.effect for f in candidates(models.twin)} - {f.effect for f in truth.forms}
        row = f"| {number} | {kind} | {form} | {dead} | {', '.join(hidden)}"
        try:
            found = diagnose(machine, records, effects=only, models=models)
        except RotorsimError as error:
            print(f"{row} | refused: {error} | | | missed | |", flush=True)
            continue
        verdicts.append(judged(kind, hidden, found, known))
        ties = ", ".join(" with ".join(keys) for keys in found.ties)
        effects = ", ".join(f.form for f in found.effects)
        seconds = time.perf_counter() - begin
        print(f"{row} | {found.status} | {effects} | {ties} | {verdicts[-1]} | {seconds:.0f} |", flush=True)
    print(f"\n{verdicts.count('wrong')} wrong of {count}: {', '.join(verdicts)}")
    return int("wrong" in verdicts)


if __name__ == "__main__":
    raise SystemExit(main())
