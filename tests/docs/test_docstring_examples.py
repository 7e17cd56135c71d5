"""The examples in the docstrings of public names run; what they use is made here as docs/python.md states."""

import doctest
import inspect
from pathlib import Path
from shutil import copy, which

import numpy as np
import pytest

import rotorsim as rs
from coarse_rig import coarse

PLAN = """name = "short"
machine = "plain_rotor"

[experiments.steady]
kind = "steady"
speed = "1000 rpm"
duration = "50 ms"
"""
DATA = Path(__file__).parents[2] / "docs" / "rk4"
RIG = Path(__file__).parents[1] / "control" / "rig_model.json"
PACKAGES = ["", *(name for name in dir(rs) if type(getattr(rs, name)).__name__ == "module")]


def examples():
    """Every docstring with an example, once, by the name it is reached by; methods of public classes too."""
    found = {}
    for package in PACKAGES:
        room = getattr(rs, package) if package else rs
        for name in dir(room):
            value = getattr(room, name)
            parts = [("", value)]
            if inspect.isclass(value):
                parts += [
                    (f".{key}", inspect.unwrap(getattr(one, "__func__", one))) for key, one in vars(value).items()
                ]
            for suffix, one in parts:
                text = getattr(one, "__doc__", None)
                if isinstance(text, str) and ">>>" in text and callable(one):
                    found.setdefault(text, ".".join(filter(None, ("rs", package, name))) + suffix)
    return {name: text for text, name in found.items()}


EXAMPLES = examples()
SLOW = ("rs.closed_loop", "rs.fmu.system", "rs.report.whirl_orbits", "rs.report.draw_modes",
        "rs.report.film_on_journal", "rs.report.mode_turntable", "rs.experiments.without_orbit")  # fmt: skip
"""A law on the whole operating range, a unit of a plant, pictures of full size and a search that repeats a run."""


def conditions():
    """1X vectors at 3000 rpm of six conditions with known unbalance in one plane and of one without."""
    unbalance = 1e-5 * np.array([[0.0], [0.0], [1.0], [2.0], [1j], [2j], [np.nan]]) + 0j
    vectors = 1e-6 + 0.1 * np.nan_to_num(unbalance, nan=1.5e-5) * [1.0, -1j]
    vectors += 1e-9 * np.random.default_rng(0).normal(size=vectors.shape)
    probes = rs.balance.Reading("X", 0.2, 0.0), rs.balance.Reading("Y", 0.2, 0.5 * np.pi)
    disc = rs.balance.Plane("disc", 0.3, 0.03, 16)
    speed = np.full((7, 1), 314.2)
    return rs.balance.Conditions(tuple("abcdefg"), ("3000 rpm",), speed, vectors[:, None], unbalance, probes, (disc,))


@pytest.fixture(scope="module")
def at_hand(tmp_path_factory):
    """Names and files that the examples use."""
    folder = tmp_path_factory.mktemp("examples")
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8, dt=2e-4)
    record = rs.experiments.prbs(plant, 300.0, 0.5e6, duration=2.0)
    lpv = rs.load_model(RIG)
    law = rs.control.design("lqr", lpv)
    for name in ("open.csv", "balance.toml"):
        copy(DATA / name, folder)
    (folder / "plan.toml").write_text(PLAN)
    rs.campaign.run_campaign(rs.campaign.load_plan(folder / "plan.toml"), folder / "mine")
    rs.identification.save(record, folder / "run.nc")
    rs.identification.save(record, folder / "run.csv")
    lpv.save(folder / "model.json")
    law.save(folder / "law.json")
    shaft = [rs.fe_shaft.ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    bearings = [rs.fe_shaft.BearingElement(n, 1e6, 100.0) for n in (0, 6)]
    if which("gcc"):
        rs.fmu.export(law, folder / "rotor.fmu", speed=300.0, pressure=0.5e6)
    names = {
        "rotor": rs.fe_shaft.Rotor(shaft, bearing_elements=bearings), "conditions": conditions(),
        "bearing": rs.reynolds.GasBearing(0.02, 0.04, 25e-6, n_theta=32, n_z=8),
        "rs": rs, "np": np, "Path": Path, "plant": plant, "machine": coarse(), "record": record, "lpv": lpv,
        "law": law, "turning": rs.experiments.steady(plant, 300.0, 0.5e6, duration=2.0),
        "runup": rs.experiments.runup(plant, 50.0, 250.0, 50.0, 0.5e6),
        "impact": rs.experiments.impact(plant, speed=0.0, pressure=0.5e6, hits=2),
    }  # fmt: skip
    return folder, names


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in EXAMPLES])
def test_the_example_of_a_public_name_runs(name, at_hand, monkeypatch):
    folder, names = at_hand
    text = EXAMPLES[name]
    for package in ("control", "pyvista"):
        if f"import {package}" in text or f"{package}." in text.split("Examples")[-1]:
            pytest.importorskip(package)
    if "to_control()" in text or ".to_control(" in text.split("Examples")[-1]:
        pytest.importorskip("control")
    if name.startswith("rs.fmu") and not which("gcc"):
        pytest.skip("gcc is not installed")
    monkeypatch.chdir(folder)
    test = doctest.DocTestParser().get_doctest(text, dict(names), name, None, None)
    report = []
    failed, _ = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=report.append)
    assert not failed, "".join(report)
