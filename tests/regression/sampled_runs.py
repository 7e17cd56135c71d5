"""Reference computations of the regression tests: shipped machines, FMUs, identification, one diagnosis.

Only names of the public surface are used here, so that one copy of this file runs on either commit:

    python sampled_runs.py numbers.npz [runs | linear | units | identification | diagnosis | texts | stored ...]

`stored` is what `test_stored_numbers.py` reads; write it again where a change of the numbers is a decision:

    python tests/regression/sampled_runs.py tests/regression/stored_numbers.npz stored
"""

import csv
import io
import json
import os
import re
import shlex
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

import identification as idn
import rotorsim as rs
from rotorsim.machine import shipped_machines

GRID = {"n_theta": 32, "n_z": 8, "dt": 2e-4}
FILM_MACHINES = ("dtu_first_assembly", *(f"dtu_gas_bearing{end}" for end in ("", "_b", "_c", "_d")), "dtu_paper_a")
OWN = (*FILM_MACHINES, "plain_rotor", "bently_rk4")
DESIGNS = ("aerostatic_spindle", "foil_turbo_rotor", "grooved_turbo_rotor", "pump_on_tables", "rigid_rotor_self_acting")
"""Shipped machines on other bearings, whose numbers are held by tests of their physics."""
MACHINES = tuple(name for name in OWN if name in shipped_machines())
"""Shipped machines that both of two compared commits have."""
Numbers = Iterator[tuple[str, np.ndarray]]
RECORDS = Path(os.environ.get("ROTORSIM_RECORDS", "records"))
"""Folder of the records of the diagnosis."""

EVERY_EFFECT: dict[str, Any] = {
    "actuator_delay": {},
    "actuator_gain": {},
    "amplifier_lag": {},
    # those of the references and amplifiers, this, seal, heat, ring, pins and random ones: neutral, as numbers stored
    # before them
    "asymmetric_shaft": {},
    "ball_bearing": {"softening": 0.05, "clearance": "0.5 um"},
    "base_vibration": {},  # excludes a pedestal
    "broadband_force": {},
    "clearance_growth": {"growth": "0.4 um", "temperature": "3 K"},
    "contact": {"stiffness": "200 MN/m", "damping": "1 s/m", "friction": 0.15},
    "coupling": {"force_2x": "4 N", "force_3x": "2.5 N", "phase_2x": "30 deg", "ellipticity": 0.4},
    "crack": {"loss": "60 kN/m", "phase": "40 deg"},
    "creep": {"gain": 0.012},
    "discharge_drift": {"drift": 0.03, "exponent": 0.02},
    "gravity": {"acceleration": "9.81 m/s^2"},
    "hysteresis": {"weight": "0.3 um/V"},
    "internal_damping": {"time": "3 us"},
    "labyrinth_seal": {},
    "heat_balance": {},
    "journal_tilt": {"x": "0.00005 rad", "y": "-0.00003 rad"},
    "noise": {"sigma": "0.3 um"},
    "out_of_round": {"sleeve": "0.5 um", "journal": "0.3 um", "journal_lobes": 3},
    "pedestal": {"mass_ratio": 0.3},
    "pin_sensor": {},
    "plenum_volume": {"change": 0.2},
    "pressure_transducer": {"gain": 0.01, "zero": "1 kPa", "sigma": "1 kPa"},
    "rub": {"stiffness": "1 MN/m", "gap": "40 um"},
    "runout": {"amplitude_1x": "2 um", "amplitude_2x": "0.8 um", "amplitude_3x": "0.4 um", "roughness": "0.1 um"},
    "sensor_delay": {"delay": "0.13 ms"},
    "sensor_gain": {"x": 0.02, "y": -0.01, "cross_x": 0.01},
    "sensor_lag": {"time": "0.1 ms"},
    "sensor_ring": {},
    "sudden_unbalance": {},
    "shaft_bow": {"bow": "3 um", "phase": "15 deg"},
    "slip": {"mean_free_path": "0.068 um"},
    "speed_wander": {},
    "supply_droop": {"droop": "50000000 Pa*s/kg", "filling_time": "0.2 s"},
    "torque_ripple": {"amplitude": "0.01 N*m", "order": 2},
    "unbalance": {"me": "6.5 g*mm", "phase": "25 deg"},
    "unequal_pressure": {"injector": 2, "deviation": -0.02},
    "gas_heating": {"rise": "5 K", "heating": "4 K"},
    "weak_injector": {"injector": 3, "blocked": 0.06},
    # last of their chains: lost motion of the pins, the converters
    "dead_zone": {"half_width": "0.1 um"},
    "quantisation": {"step": "0.04 um"},
    "encoder": {"counts": 2000},
}
"""Tables of a machine file, all switched on at sizes that the rig survives."""
RENAMED: dict[str, dict[str, str]] = {
    "coupling": {"force_2x": "second", "force_3x": "third", "phase_2x": "second_phase"},
    "runout": {"amplitude_1x": "first", "amplitude_2x": "second", "amplitude_3x": "third"},
}
"""Effect -> key above -> key of a commit in which it has another name."""
RENAMED_EFFECTS = {"gas_heating": "viscosity"}
"""Effect above -> its name in such a commit."""
NEED_FILM = frozenset({
    "actuator_delay", "actuator_gain", "amplifier_lag", "clearance_growth", "contact", "creep", "dead_zone",
    "discharge_drift", "gas_heating", "heat_balance", "hysteresis", "journal_tilt", "out_of_round", "pedestal",
    "pin_sensor", "plenum_volume", "slip", "supply_droop", "unequal_pressure", "weak_injector",
})  # fmt: skip


def with_every_effect(name: str) -> Any:
    """The shipped machine with every effect switched on that it can have."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        rs.load_machine(name).save(path)
        text = tomlkit.parse(path.read_text(encoding="utf-8"))
        film = any(bearing["kind"] == "gas_film" for bearing in text["bearings"])
        chosen = {n: t for n, t in EVERY_EFFECT.items() if film or n not in NEED_FILM}
        for keys, names in (({}, {}), (RENAMED, RENAMED_EFFECTS)):
            text["effects"] = {
                names.get(n, n): {keys.get(n, {}).get(k, k): v for k, v in t.items()} for n, t in chosen.items()
            }
            path.write_text(tomlkit.dumps(text), encoding="utf-8")
            try:
                return rs.load_machine(path)
            except Exception as error:
                refusal = error
        raise refusal


def columns(record: Any) -> Numbers:
    """Every floating variable of a record."""
    for name, variable in record.data_vars.items():
        if variable.dtype.kind == "f":
            yield str(name), np.ascontiguousarray(variable.values)


def experiments(plant: Any, film: bool) -> Iterator[tuple[str, Any]]:
    """A run-up of .5 s to 6000 rpm, impacts without and with contact, and binary references."""
    top = 200 * np.pi
    yield "runup", rs.experiments.runup(plant, 0.0, top, top / 0.5, 0.3e6, seed=1)
    yield "impact", rs.experiments.impact(plant, speed=300.0, pressure=0.5e6, peak=20.0, lead=0.02, hits=2, spacing=0.2)
    yield "contact", rs.experiments.impact(plant, speed=300.0, pressure=0.5e6, peak=900.0, lead=0.02)
    if film:
        yield "prbs", rs.experiments.prbs(plant, speed=400.0, pressure=0.6e6, duration=0.5, bias=0.1, seed=2)


def runs(machines: tuple[str, ...] = MACHINES) -> Numbers:
    """Sample tables of shipped machines, as they are and with every effect switched on."""
    for name in machines:
        for kind, machine in (("shipped", rs.load_machine(name)), ("every effect", with_every_effect(name))):
            plant = rs.Plant(machine, **GRID)
            for experiment, record in experiments(plant, name in FILM_MACHINES):
                for variable, values in columns(record):
                    yield f"{name}/{kind}/{experiment}/{variable}", values


def linear() -> Numbers:
    """Equilibrium and linear model of every shipped machine at an operating point."""
    for name in MACHINES:
        plant = rs.Plant(rs.load_machine(name), **GRID)
        rest, model = plant.equilibrium(300.0, 0.5e6), plant.linearise(300.0, 0.5e6)
        yield f"{name}/equilibrium/disc", np.asarray(rest.disc)
        yield f"{name}/linear/wn", np.asarray(model.wn)
        yield f"{name}/linear/zeta", np.asarray(model.zeta)


def units() -> Numbers:
    """Outputs that the exported units of the rig give for the stored inputs of their own."""
    from rotorsim.cli import main

    with tempfile.TemporaryDirectory() as folder:
        for version in ("2", "3"):
            out = Path(folder) / f"rig{version}.fmu"
            try:
                main(["fmu", "export", "dtu_gas_bearing", "--grid", "32x8", "--fmi", version, "--out", str(out)])
            except SystemExit as ended:
                if ended.code:
                    raise
            with zipfile.ZipFile(out) as archive:
                for entry in sorted(n for n in archive.namelist() if n.endswith("out.csv")):
                    rows = list(csv.reader(io.StringIO(archive.read(entry).decode())))
                    for heading, *values in zip(*rows, strict=True):
                        yield f"fmi{version}/{heading}", np.array(values, float)


def identified() -> Numbers:
    """Models 1 and 2 and a black box of one record of the rig, with the prefilter of the thesis."""
    plant = rs.Plant(rs.load_machine("dtu_gas_bearing"), **GRID)
    record = rs.experiments.prbs(plant, speed=0.0, pressure=0.4e6, duration=4.0, seed=3)
    for model in (1, 2, "blackbox"):
        found = idn.identify(record, model=model, settings=idn.Prefilter(median=3))
        for letter in "ABCD":
            yield f"identification/{model}/{letter}", np.asarray(getattr(found.model, letter))
        for name, (value, sd) in sorted(found.parameters.items()):
            yield f"identification/{model}/{name}", np.array([value, sd])


def hidden() -> Numbers:
    """Write the records of a bow hidden in the plain rotor below `RECORDS`, for `diagnosed`."""
    from rotorsim import discrepancy

    discrepancy.hide("plain_rotor", effects=["shaft_bow"], seed=3, out=RECORDS)
    yield from ()


def diagnosed() -> Numbers:
    """The verdict on the records that `hidden` has written.

    Both commits read the same files: which case a seed means depends on the names of effects, which may change.
    """
    from rotorsim import discrepancy

    records = sorted(RECORDS.rglob("*.nc"))
    found = discrepancy.diagnose(rs.load_machine("plain_rotor"), [str(path) for path in records])
    yield "diagnosis/status", np.frombuffer(found.status.encode(), np.uint8)
    for number, effect in enumerate(found.effects):
        values = [float(v) for v in json.loads(json.dumps(effect.parameters)).values()]
        yield f"diagnosis/effect {number}", np.array(values)


COMMANDS = (
    "machine --help",
    "machine show plain_rotor",
    "machine check dtu_gas_bearing",
    "runup plain_rotor --stop '3000 rpm' --rate '6000 rpm/s' --out runup --json",
    "experiment prbs dtu_gas_bearing --grid 32x8 --speed '3000 rpm' --duration '2 s' --seed 4 --out prbs --json",
    "experiment impact dtu_gas_bearing --grid 32x8 --out impact",
    "identify prbs/prbs.nc --model 2 --out identified.json --json",
    "campbell plain_rotor --speeds '0 rpm:6000 rpm:5' --out campbell --json",
    "response plain_rotor --out response --json",
    "modes plain_rotor --speed '3000 rpm' --out modes",
    "map plain_rotor --speed '0 rpm:6000 rpm:4' --out map --json",
    "data check prbs/prbs.nc",
    "experiment runup plain_rotor --rate '6000 rpm/s' --out second",
    "runup plain_rotor --stop '3000 rpm' --rate '6000 rpm/s' --units imperial --out imperial",
    "compare runup/runup.nc imperial/runup.nc --out compared",
    "cite dtu_gas_bearing",
    "fmu export --help",
)
"""Command lines that are run one after another in one folder."""
NOISE = (
    (r"<script\b[^>]*>.{300000,}?</script>", "<script>"),
    (r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f-]{22}|\b(?=\d*[a-f])[0-9a-f]{12,64}\b", "HASH"),
    (r"20\d\d-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d+)?)?)?", "DATE"),
    (r"\b\d+(\.\d+)? ?(ms|s)\b of (work|processor)", "TIME"),
    (r"-?\d+\.\d{5,}(e[+-]\d+)?", lambda found: f"{float(found.group()):.5g}"),
)
"""Patterns of what differs between two runs of one commit, and what stands for it."""


def texts() -> Numbers:
    """Printed output of the commands and every text that they write: pages, tables, JSON."""
    from rotorsim.cli import main

    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for command in COMMANDS:
            out, code = io.StringIO(), None
            with redirect_stdout(out), redirect_stderr(out):
                try:
                    main(shlex.split(command))
                except SystemExit as ended:
                    code = ended.code
            yield f"texts/{command}", _plain(f"{out.getvalue()}\nexit {code}", folder)
        for path in sorted(Path().rglob("*")):
            if path.suffix in {".html", ".json", ".csv", ".md", ".toml", ".txt"}:
                yield f"texts/{path}", _plain(path.read_text(encoding="utf-8"), folder)


def _plain(text: str, folder: str) -> np.ndarray:
    """Bytes of a text without what differs from run to run."""
    text = text.replace(folder, "FOLDER")
    for pattern, stand_in in NOISE:
        text = re.sub(pattern, stand_in, text, flags=re.DOTALL)
    return np.frombuffer(text.encode(), np.uint8)


def stored() -> Numbers:
    """Content of the stored file: one sample of fifty, of runs without contact (those amplify the last digits)."""
    for key, values in runs():
        if "/contact/" not in key:
            yield key, values[::50]
    yield from linear()


PARTS: dict[str, Callable[[], Numbers]] = {
    "runs": runs, "linear": linear, "units": units, "identification": identified, "diagnosis": diagnosed,
    "texts": texts,
}  # fmt: skip
"""Parts by which two commits are compared; each takes a minute or two, and once more while kernels compile."""


def main() -> None:
    """Write the numbers of the parts asked for, all by default, to an .npz file."""
    path, *wanted = sys.argv[1:]
    parts = PARTS | {"stored": stored, "hidden": hidden}
    numbers = {key: values for part in wanted or PARTS for key, values in parts[part]()}
    np.savez_compressed(path, **numbers)


if __name__ == "__main__":
    main()
