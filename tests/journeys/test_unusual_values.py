"""Unusual values: questioned in one sentence before the computation, accepted with --yes."""

import json
import warnings

import numpy as np
import pytest

from rotorsim.base.errors import Unusual
from rotorsim.campaign.read_plan import make_plan
from rotorsim.experiments import Impact, Runup, Steady
from rotorsim.experiments.experiment import ask_speeds
from rotorsim.machine import Machine, load_machine, machine_text, shipped_machines
from rotorsim.machine.plausibility import ask_machine

SHORT = ["--duration", "2 ms", "--no-report", "--out", "o"]
QUESTIONS = [
    (["runup", "--pressure", "300 MPa"], "--pressure: '300 MPa' is far above", "'300 kPa' would be usual"),
    (["runup", "--pressure", "0.5 Pa"], "--pressure: '0.5 Pa' is far below", "'0.5 MPa' would be usual"),
    (["experiment", "impact", "plain_rotor", "--peak", "1e9 N"], "--peak: '1e9 N' is far above", "number and unit"),
    (["modes", "--speed", "1e9 rpm"], "--speed: '1e9 rpm' is far above", "turn at 300,000 to 500,000 rpm"),
    (["map", "--speed", "0 Hz, 9000 Hz"], "--speed: '9000 Hz' is far above", "'9000 rpm' would be usual"),
    (["map", "--set", "shaft.material.density=7.85 kg/m^3"], "shaft.material.density: '7.85 kg/m^3' is far below",
     "'7.85 g/cm^3' would be usual"),
    (["map", "--over", "gas.viscosity=18.5 mPa*s, 20 mPa*s"], "gas.viscosity: '18500 uPa*s' is far above", "uPa*s"),
    (["fmu", "export", "--pressure", "5 GPa"], "--pressure: '5 GPa' is far above", "hold 2 MPa at most"),
    (["experiment", "steady", "--set", "effects.gravity.acceleration=98 m/s^2"],
     "effects.gravity.acceleration: '98 m/s^2' is far above", "gravity is 9.81 m/s^2"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "beginning", "part"), QUESTIONS, ids=lambda a: " ".join(a) if a is list else None
)
def test_an_unusual_value_ends_in_a_question_and_code_2(run, tmp_path, arguments, beginning, part):
    for more in ([], ["--json"]) if arguments[0] != "map" else ([],):
        code, out, words = run(*arguments, *more)
        assert code == 2 and words.startswith(beginning) and part in words and out == ""
        assert words.strip().endswith("add --yes to run with it") and len(words.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments",
    [
        ["runup", "plain_rotor", "--stop", "6000 Hz"],
        ["experiment", "steady", "plain_rotor", "--speed", "6000 Hz"],
        ["modes", "plain_rotor", "--speed", "6000 Hz"],
        ["map", "plain_rotor", "--speed", "0 Hz:6000 Hz:3", "--pressure", "0 Pa"],
    ],
    ids=lambda a: a[0],
)
def test_a_speed_that_bursts_the_rotor_is_questioned_though_spindles_reach_it(run, tmp_path, arguments):
    """6000 Hz for 6000 rpm: below the fastest spindles' 500,000 rpm, but 3 km/s at the rim of this disc."""
    code, out, words = run(*arguments)
    assert code == 2 and out == "" and len(words.strip().splitlines()) == 1
    assert "'360000 rpm' (6000 Hz) moves the rim of discs.0, radius 80 mm, at 3016 m/s" in words
    assert words.strip().endswith("check whether rpm or Hz are meant; add --yes to run with it")
    assert not list(tmp_path.iterdir())


def test_no_shipped_machine_is_questioned_at_the_speeds_it_is_made_for():
    with warnings.catch_warnings():
        warnings.simplefilter("error", Unusual)
        for name in shipped_machines():
            ask_speeds(load_machine(name), Runup(stop=2 * np.pi * 330))


def test_yes_runs_with_it_wherever_it_stands(run):
    weight = ["--set", "effects.gravity.acceleration=98 m/s^2"]
    for arguments in (
        ["--yes", "experiment", "steady", "plain_rotor"],
        ["experiment", "steady", "plain_rotor", "--yes"],
    ):
        code, out, words = run(*arguments, *weight, *SHORT, "--force", "--json")
        assert code == 0 and json.loads(out)["samples"] == 10
        assert [line for line in words.splitlines() if not line.startswith("compiling the kernels")] == []


def test_a_machine_file_names_what_it_means(run, tmp_path):
    text = machine_text("plain_rotor").replace('"9.81 m/s^2"', '"98 m/s^2"')
    (tmp_path / "centrifuge.toml").write_text(text)
    code, _, words = run("machine", "check", "centrifuge.toml")
    assert code == 2 and "unusual = ['effects.gravity.acceleration']" in words
    assert words.startswith("centrifuge.toml: effects.gravity.acceleration: ")
    (tmp_path / "meant.toml").write_text('unusual = ["effects.gravity.acceleration"]\n' + text)
    assert run("machine", "check", "meant.toml")[0] == 0 and run("machine", "show", "meant.toml")[0] == 0
    meant = load_machine(tmp_path / "meant.toml")
    assert Machine.from_text(meant.text) == meant and "unusual" not in load_machine("plain_rotor").text
    (tmp_path / "wrong.toml").write_text('unusual = ["gravity"]\n' + text)
    code, _, words = run("machine", "check", "wrong.toml")
    assert code == 2 and "unusual.0: 'gravity' leads to no number" in words


def test_in_python_it_is_a_warning_that_can_be_filtered():
    with pytest.warns(Unusual, match=r"peak: '1000000000 N' is far above what is usual"):
        Impact(peak=1e9)
    with pytest.warns(Unusual, match=r"pressure: '0.3 GPa' is far above"):
        Steady(pressure=300e6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Unusual)
        assert Steady(pressure=300e6).pressure == 300e6


def test_a_plan_is_questioned_at_its_ends():
    plan = 'name = "p"\\nmachine = "plain_rotor"\\n[experiments.steady]\\nkind = "steady"\\nduration = "1 s"\\n'
    axis = '[axes."shaft.material.density"]\\nlist = ["7850 kg/m^3", "78500 kg/m^3"]\\n'
    with pytest.warns(Unusual, match=r"shaft\.material\.density: '78500 kg/m\^3' is far above"):
        make_plan((plan + axis).replace("\\n", "\n"))


def test_a_plan_is_questioned_about_the_speed_of_the_rim():
    plan = 'machine = "plain_rotor"\n[set]\n"solver.sampling_rate" = "100 kHz"\n[experiment]\nkind = "steady"\n'
    plan += 'duration = "1 s"\n[axes.speed]\n'
    with pytest.warns(Unusual, match=r"speed: '360000 rpm' \(6000 Hz\) moves the rim"):
        make_plan(plan + 'list = ["6000 rpm", "6000 Hz"]\n')


def test_all_unusual_values_of_a_machine_are_in_one_warning():
    machine = load_machine("dtu_gas_bearing").replace("gas.viscosity", "18.5 mPa*s").replace("gas.temperature", "3 K")
    with pytest.warns(Unusual) as caught:
        ask_machine(machine)
    assert [line.split(":")[0] for line in str(caught[0].message).splitlines()] == ["gas.viscosity", "gas.temperature"]
