"""Input files of the commands, made once."""

import importlib.util
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

import identification as idn
from fault_injection.running import run

TESTS = Path(__file__).parents[2]
PLAN = """name = "small"
machine = "plain_rotor"
repeats = 2
[experiment]
kind = "steady"
duration = "2 s"
[axes.speed]
list = ["600 rpm", "1200 rpm"]
"""
TARGETS = """[operating_points]
speeds = ["0 rpm"]
pressures = ["0.5 MPa"]
[parameters."injection.pin_discharge"]
low = 0.10
high = 0.15
[[targets]]
name = "wn_x"
quantity = "wn_x"
value = "700 rad/s"
tolerance = "10 rad/s"
speed = "0 rpm"
pressure = "0.5 MPa"
"""


def make_inputs(folder: Path) -> Path:
    """All files below a folder, which is returned."""
    from rotorsim.control.designs import p
    from rotorsim.discrepancy import save_diagnosis
    from rotorsim.machine import load_machine
    from small_diagnosis import small_diagnosis

    folder.mkdir(parents=True, exist_ok=True)
    rig = load_machine("dtu_gas_bearing").replace("grid.n_theta", 32).replace("grid.n_z", 8)
    rig.save(folder / "rig.toml")
    record = _model3().record(0, seconds=2.0)
    idn.save(record, folder / "excited.nc")
    t = np.arange(10000) / 5000
    angle = 2 * np.pi * (20 * t + 10 * t**2)
    disc = 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    idn.save(idn.make_record(t, {"angle": angle, "disc_measured": disc}), folder / "sweep.nc")
    idn.identify(record, model="blackbox", order=4).model.save(folder / "linear.json")
    shutil.copy(TESTS / "control" / "rig_model.json", folder / "model.json")
    p.make(p.Spec()).save(folder / "law.json")
    save_diagnosis(small_diagnosis(), folder / "diagnosed")
    (folder / "plan.toml").write_text(PLAN)
    (folder / "targets.toml").write_text(TARGETS)
    shutil.copy(TESTS.parent / "docs" / "rk4" / "open.csv", folder / "vectors.csv")
    shutil.copy(TESTS.parent / "docs" / "rk4" / "balance.toml", folder / "vectors.toml")
    return folder


def make_store(folder: Path) -> Path:
    """A campaign that is done."""
    if not (folder / "store").exists():
        done = run(["campaign", "run", "plan.toml", "--workers", "1", "--out", "store"], folder)
        assert done.code == 0, done.stderr
    return folder / "store"


def make_failed(folder: Path) -> Path:
    """The same, of which two cases failed."""
    store, failed = make_store(folder), folder / "failed"
    if not failed.exists():
        shutil.copytree(store, failed)
        with closing(sqlite3.connect(failed / "index.sqlite")) as db, db:
            keys = [key for (key,) in db.execute("SELECT key FROM cases WHERE number < 2")]
            db.execute("UPDATE cases SET status = 'failed', error = 'case: made to fail' WHERE number < 2")
        for key in keys:
            (failed / "cases" / key[:2] / f"{key}.nc").unlink()
    return failed


def make_hidden(folder: Path) -> Path:
    """A few records of a plain rotor in which a run-out is hidden."""
    from rotorsim.discrepancy.experiments import campaign
    from rotorsim.discrepancy.hidden_machine import draw, record_of, truth_twin, write
    from rotorsim.machine import load_machine

    hidden = folder / "hidden"
    if not hidden.exists():
        machine = load_machine("plain_rotor")
        twin = truth_twin(machine, ("runout",))
        truth = draw(twin, ("runout",), 1)
        kept = ("fit_1", "fit_2", "fit_2_repeat", "held_out_1", "untouched_2")
        planned = [one for one in campaign(machine) if one.name in kept]
        write(hidden, [record_of(twin, one, truth.point, 1, tiled=True) for one in planned], truth, twin)
    return hidden


def _model3() -> Any:
    spec = importlib.util.spec_from_file_location("model3", TESTS / "support" / "model3.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
