"""Campaigns whose records are made with something changed on purpose: trial weights, values of effects."""

import json
import math

import numpy as np
import pytest
import xarray as xr

from identification.records.mapping import parse
from rotorsim.campaign.axes import PlanError
from rotorsim.campaign.plan import Case, with_changes
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.simulate_case import solve
from rotorsim.campaign.store import make_store, record_path
from rotorsim.cli import main
from rotorsim.discrepancy.changes import known_changes
from rotorsim.experiments import EXPERIMENTS, run
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

PLAN = "machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\nduration = '0.2 s'\nspeed = '1800 rpm'\nseed = 3\n{}"
WEIGHT = {"me": "12 g*mm", "phase": "30 deg"}
STATED = "[changes]\ntrial_weight = { me = '12 g*mm', phase = '30 deg' }\n"


def record_of(text, folder):
    """The record of a plan's first case, as a worker writes it."""
    store = make_store(make_plan(PLAN.format(text)), folder)
    case = store.plan.case(0).case
    solve(store.folder, case, next(iter(store.plan.machines.values())), store.plan.summary)
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
        return record.load()


def test_a_record_with_a_trial_weight_states_what_a_mapping_would(tmp_path):
    record = record_of(STATED, tmp_path / "with")
    assert record.attrs["changes"] == parse({"changes": {"trial_weight": WEIGHT}}).conditions["changes"]
    known = known_changes(load_machine("plain_rotor"), record.attrs["changes"], "run")
    weight = complex(known["unbalance.0.me~phase.c"], known["unbalance.0.me~phase.s"])
    assert weight == pytest.approx(12e-6 * np.exp(1j * math.radians(30)))
    assert "changes" not in record_of("", tmp_path / "without").attrs


def test_the_response_is_that_of_a_machine_with_both_unbalances(tmp_path):
    """To 1e-9 of the response: the sum of the vectors is rounded once more. Without the weight it is another one."""
    plain = load_machine("plain_rotor")
    own = plain.effects["unbalance"][0]
    whole = own.me * np.exp(1j * own.phase) + 12e-6 * np.exp(1j * math.radians(30))
    heavy = plain.with_({"effects.unbalance.0.me": abs(whole), "effects.unbalance.0.phase": float(np.angle(whole))})
    steady = EXPERIMENTS["steady"](speed=1800 * math.pi / 30, duration=0.2)
    expected, without = (run(Plant(machine), steady, 3)["disc"].values for machine in (heavy, plain))
    found = record_of(STATED, tmp_path / "with")["disc"].values
    size = np.abs(expected - expected[0]).max()
    assert np.abs(found - expected).max() < 1e-9 * size
    assert np.abs(found - without).max() > 0.1 * size


def test_a_turned_ring_reads_the_motion_in_its_axes_and_the_record_states_it(tmp_path):
    ring = {"angle": "30 deg"}
    record = record_of("[changes.sensor_ring]\nangle = '30 deg'\n", tmp_path)
    assert record.attrs["changes"] == parse({"changes": {"sensor_ring": ring}}).conditions["changes"]
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    expected = record["disc"].values @ np.array([[c, s], [-s, c]]).T
    assert record["disc_measured"].values == pytest.approx(expected, abs=1e-15)
    assert np.ptp(record["disc"].values) > 1e-6


def test_several_weights_and_a_new_value_add_to_the_unbalance_as_it_is_then():
    text = json.dumps({"trial_weight": [{"me": 1e-5}, {"me": 1e-5}], "effects.unbalance.me": "0 g*mm"})
    machine = with_changes(load_machine("plain_rotor"), text)
    assert machine.effects["unbalance"][0].me == pytest.approx(2e-5)
    assert machine.effects["unbalance"][0].phase == pytest.approx(0.0)


def test_a_weight_adds_to_the_unbalance_that_an_axis_gives():
    axis = "[axes.'effects.unbalance.me']\nlist = ['0 kg*m', '1e-5 kg*m']\n"
    plan = make_plan(PLAN.format("[changes]\ntrial_weight = { me = '12 g*mm' }\n" + axis))
    machines = [plan._machine_of(plan.case(number).case) for number in range(2)]
    own = [complex(m.effects["unbalance"][0].me * np.exp(1j * m.effects["unbalance"][0].phase)) for m in machines]
    phase = load_machine("plain_rotor").effects["unbalance"][0].phase
    assert own == pytest.approx([12e-6, 12e-6 + 1e-5 * np.exp(1j * phase)])


def test_a_case_without_changes_keeps_its_key_and_one_with_has_another():
    without, with_ = (make_plan(PLAN.format(text)).case(0).case for text in ("", STATED))
    assert "changes" not in without.text and "changes" not in make_plan(PLAN.format("")).content
    assert without.key != with_.key
    assert Case.from_text(with_.text) == with_ and Case.from_text(without.text) == without


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ("trial_weight = 3", r"changes.trial_weight: 3; write"),
        ("trial_weight = { me = '3 mm' }", r"changes.trial_weight.me: .* is not a known unit of mass"),
        ("trial_weight = { me = '3 g*mm', radius = '3 mm' }", r"changes.trial_weight.radius: is not known; give me"),
        ("trial_weight = { me = '3 g*mm', position = '123 mm' }", r"at 123 mm, where the machine file has no"),
        ("'effects.unbalance.mass' = '3 g'", r"known change: .*mass"),
        ("'effects.unbalanced.me' = '3 g*mm'", r"known change: .*unbalance"),
        ("'effects.unbalance.me' = '3 mm'", r"known change: .*3 mm"),
        ("'shaft.damping_ratio' = 0.1", r"only a trial weight, the sensor ring and parameters of effects in the mach"),
        ("sensor_ring = 30", r"changes.sensor_ring: 30; write { angle = '30 deg' }"),
        ("sensor_ring = { angle = '400 deg' }", r"sensor_ring .*; give its angle in rad, a turn at most"),
        (
            "sensor_ring = { angle = '30 deg' }\n[axes.'effects.sensor_ring.angle']\nlist = ['1 deg']",
            r"axes.effects.sensor_ring.angle: is given below \[changes\] too",
        ),
        ("effects = 3\n[axes.'effects.unbalance.me']\nlist = ['1 g*mm']", r"^changes"),
        ("'effects.unbalance.me' = '1 g*mm'\n[axes.'effects.unbalance.me']\nlist = ['1 g*mm']", r"\[changes\] too"),
    ],
)  # fmt: skip
def test_mistakes_in_the_changes_of_a_plan_are_one_sentence(changes, sentence):
    with pytest.raises(PlanError, match=sentence) as error:
        make_plan(PLAN.format(f"[changes]\n{changes}\n"))
    assert "\n" not in str(error.value)


def test_changes_that_are_no_table_are_one_sentence():
    with pytest.raises(PlanError, match=r"changes: .* does not fit here; write a table"):
        make_plan("changes = 3\n" + PLAN.format(""))


def test_a_bad_change_ends_the_command_with_2(tmp_path, capsys):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN.format("[changes]\ntrial_weight = { me = '12 g*mm', position = '1 mm' }\n"), encoding="utf-8")
    with pytest.raises(SystemExit) as end:
        main(["campaign", "check", str(path)])
    assert end.value.code == 2
    assert "a trial weight in the plane at 1 mm" in capsys.readouterr().err
