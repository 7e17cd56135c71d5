"""Campaign plans: axes, case keys, and one sentence for every invalid plan."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from refusals import refused
from rotorsim.campaign import load_plan, shipped_plans
from rotorsim.campaign.axes import PlanError
from rotorsim.campaign.plan import Case, differences
from rotorsim.campaign.read_plan import make_plan

HEAD = "machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\nduration = '0.1 s'\n"
FILM = "machine = 'dtu_gas_bearing'\n[experiment]\nkind = 'prbs'\nduration = '1 s'\n"
SPEEDS = "[axes.speed]\nlist = ['0 rpm', '600 rpm', '6 krpm']\n"


def test_the_thesis_campaign_is_7_by_5_points_with_three_records_each():
    plan = load_plan("thesis")
    assert "thesis" in shipped_plans() and len(plan) == 105
    assert [entry.name for entry in plan.entries] == ["identification", "validation", "unexcited"]
    assert plan.seconds() == pytest.approx(35 * 22.0)
    points = {(c.values["speed"], c.values["pressure"]) for c in plan.cases()}
    assert len(points) == 35
    assert {c.case.seed for c in plan.cases() if c.experiment == "identification"} == {1}
    assert {c.case.seed for c in plan.cases() if c.experiment == "validation"} == {2}


def test_the_plan_of_the_documentation_is_one():
    page = (Path(__file__).parents[2] / "docs" / "campaigns.md").read_text(encoding="utf-8")
    plan = make_plan(re.findall(r"```toml\n(.*?)```", page, re.DOTALL)[0])
    assert len(plan) == 7 * 2 * 50 * 2


def test_a_grid_has_exact_ends_and_values_that_are_short_to_write():
    speeds = load_plan("thesis").axes[0].values
    assert speeds == tuple(rpm * 2 * np.pi / 60 for rpm in range(0, 7000, 1000))


def test_a_logarithmic_grid_has_even_ratios():
    plan = make_plan(HEAD + "[axes.speed]\ngrid = ['10 rpm', '1000 rpm']\npoints = 3\nspacing = 'log'\n")
    assert plan.axes[0].values[1] * 30 / np.pi == pytest.approx(100)


def test_grid_and_list_and_hypercube_make_all_combinations():
    plan = make_plan(
        "repeats = 2\nmachine = 'plain_rotor'\n[experiment]\nkind = 'impact'\n"
        + SPEEDS
        + "[axes.peak]\nlatin = ['1 N', '20 N']\n[axes.'effects.unbalance.me']\nlatin = ['1 g*mm', '9 g*mm']\n"
        + "[latin]\nsamples = 5\nseed = 3\n"
    )
    cases = [one for one in plan.cases()]
    assert len(cases) == len(plan) == 3 * 5 * 2
    assert len({one.case.key for one in cases}) == 30
    pairs = {(one.values["peak"], one.values["effects.unbalance.me"]) for one in cases}
    assert len(pairs) == 5, "axes of the hypercube go together"
    assert [one.case.seed for one in cases[:2]] == [0, 1]


def test_a_hypercube_has_one_point_in_every_slice_and_its_seed_decides():
    text = HEAD + "[axes.speed]\nlatin = ['0 rpm', '1000 rpm']\n[latin]\nsamples = 20\nseed = {}\n"
    first, again, other = (make_plan(text.format(seed)).axes[0].values for seed in (1, 1, 2))
    assert first == again != other
    assert sorted(int(speed * 30 / np.pi // 50) for speed in first) == list(range(20))


def test_times_of_a_hypercube_are_whole_samples():
    text = "machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\n"
    plan = make_plan(text + "[axes.duration]\nlatin = ['0.1 s', '0.3 s']\n[latin]\nsamples = 9\n")
    for one in plan.cases():
        samples = one.values["duration"] / 2e-4
        assert samples == pytest.approx(round(samples), abs=1e-9)


def test_an_axis_multiplies_only_the_experiments_that_know_it():
    plan = make_plan(
        "machine = 'plain_rotor'\n[experiments.hit]\nkind = 'impact'\n[experiments.calm]\nkind = 'steady'\n"
        "[axes.peak]\nlist = ['1 N', '2 N', '3 N']\n"
    )
    assert [one.experiment for one in plan.cases()] == ["hit"] * 3 + ["calm"]


def test_different_seeds_do_not_depend_on_the_other_cases():
    text = "seeds = 'different'\nseed = 7\n" + HEAD
    few, many = (make_plan(text + f"[axes.speed]\nlist = {speeds}\n") for speeds in (["600 rpm"], ["0 rpm", "600 rpm"]))
    assert few.case(0).case == many.case(1).case
    assert len({one.case.seed for one in many.cases()}) == 2


def test_the_key_is_of_the_content_and_not_of_its_spelling():
    spelled = (
        HEAD + "[axes.speed]\nlist = ['600 rpm']\n",
        "# a comment\n" + HEAD + "[axes.speed]\nlist=['0.6 krpm']\n",
    )
    one, other = (make_plan(text).case(0).case for text in spelled)
    assert one.key == other.key
    for change in ("seed = 1\n", "keep = ['disc']\n"):
        assert make_plan(change + spelled[0]).case(0).case.key != one.key
    assert make_plan(spelled[0].replace("0.1 s", "0.2 s")).case(0).case.key != one.key


def test_the_key_is_the_same_in_another_process():
    code = "from rotorsim.campaign import load_plan; print(load_plan('thesis').case(77).case.key)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == load_plan("thesis").case(77).case.key


def test_a_case_survives_its_text_to_the_last_bit():
    for one in load_plan("thesis").cases():
        assert Case.from_text(one.case.text) == one.case
        json.loads(one.case.text)


def test_machines_can_be_an_axis():
    plan = make_plan("[experiment]\nkind = 'steady'\n[axes.machine]\nlist = ['dtu_gas_bearing', 'dtu_gas_bearing_b']\n")
    assert len({one.case.machine for one in plan.cases()}) == 2


def test_a_machine_file_is_looked_for_next_to_the_plan(tmp_path):
    from rotorsim.machine import machine_text

    (tmp_path / "mine.toml").write_text(machine_text("plain_rotor"))
    (tmp_path / "plan.toml").write_text(HEAD.replace("plain_rotor", "mine.toml"))
    assert len(load_plan(tmp_path / "plan.toml")) == 1


def test_the_difference_of_two_plans_is_put_into_words():
    plans = [make_plan(HEAD + f"[axes.speed]\nlist = {speeds}\n") for speeds in (["1 rpm"], ["1 rpm", "2 rpm"])]
    assert differences(plans[0].content, plans[1].content) == ["axes.speed: 1 values there, 2 here"]
    assert differences(plans[0].content, plans[0].content) == []
    slower = make_plan(HEAD.replace("0.1 s", "0.2 s") + "[axes.speed]\nlist = ['1 rpm']\n")
    assert differences(plans[0].content, slower.content) == ["experiments.steady.duration: 0.1 there, 0.2 here"]


BAD = [
    ("", "machine: missing; write e.g. machine"),
    ("machine = ", "not a TOML file"),
    ("machine = 'nothing'\n[experiment]\nkind = 'prbs'", "machine 'nothing': '"),
    ("machine = 3\n[experiment]\nkind = 'prbs'", "machine: 3 does not fit here; write the name of a shipped machine"),
    ("machine = 'plain_rotor'", "experiment: is missing; write [experiment]"),
    ("machin = 'plain_rotor'", "machin: unknown field; did you mean 'machine'?"),
    (HEAD + "[experiments.a]\nkind = 'steady'", "experiment: and experiments are both there"),
    (HEAD.replace("steady", "stedy"), "experiment.kind: unknown experiment; did you mean 'steady'?"),
    (
        HEAD.replace("duration", "duratoin"),
        "experiment.duratoin: unknown parameter of steady; did you mean 'duration'?",
    ),
    (HEAD.replace("'0.1 s'", "0.1"), "experiment.duration: 0.1 has no unit"),
    (HEAD.replace("0.1 s", "0.1 V"), "experiment.duration: '0.1 V' is not a time"),
    (HEAD.replace("0.1 s", "-1 s"), "experiment.duration: '-1 s' must be above 0"),
    (HEAD + "[axes.sped]\nlist = ['1 rpm']", "axes.sped: unknown axis; did you mean 'speed'?"),
    (HEAD + "[axes.peak]\nlist = ['1 N']", "axes.peak: unknown axis"),
    (HEAD + "[axes.speed]", "axes.speed: neither list nor grid nor latin; give one"),
    (HEAD + "[axes.speed]\nlist = []", "axes.speed.list: is empty"),
    (HEAD + "[axes.speed]\nlist = '1 rpm'", "axes.speed.list: '1 rpm' does not fit here"),
    (HEAD + "[axes.speed]\nlist = [1]", "axes.speed.list: 1 has no unit"),
    (HEAD + "[axes.speed]\nlist = ['1 rpm', '1 rpm']", "axes.speed.list: '1 rpm' is there twice"),
    (HEAD + "[axes.speed]\nlist = ['-1 rpm']", "axes.speed: speed: '-1 rpm' is below the limit"),
    (HEAD + "[axes.speed]\nlist = ['1 rpm']\npoints = 2", "axes.speed.points: only a grid has points"),
    (HEAD + "[axes.speed]\ngrid = ['1 rpm', '9 rpm']", "axes.speed.points: missing"),
    (HEAD + "[axes.speed]\ngrid = ['1 rpm', '9 rpm']\npoints = 0", "axes.speed.points: 0 is not from 1"),
    (HEAD + "[axes.speed]\ngrid = ['1 rpm', '1 rpm']\npoints = 3", "axes.speed.grid: 3 points from '1 rpm' to '1 rpm'"),
    (HEAD + "[axes.speed]\ngrid = ['1 rpm']\npoints = 3", "axes.speed.grid: ['1 rpm'] does not fit"),
    (HEAD + "[axes.speed]\ngrid = ['0 rpm', '9 rpm']\npoints = 3\nspacing = 'log'", "'log' needs values above 0"),
    (HEAD + "[axes.speed]\nlatin = ['9 rpm', '1 rpm']\n[latin]\nsamples = 3", "'9 rpm' is not below '1 rpm'"),
    (HEAD + "[axes.speed]\nlatin = ['1 rpm', '9 rpm']", "latin: missing for axes.speed; write [latin]"),
    (HEAD + "[axes.speed]\nlatin = ['1 rpm', '9 rpm']\n[latin]\nsamples = 0", "latin.samples: 0 is not from 1"),
    (HEAD + "[latin]\nsamples = 3", "latin: no axis is latin"),
    (HEAD + "[axes.speed]\nlist = ['1 rpm']\nlatin = ['1 rpm', '9 rpm']", "axes.speed: list and latin; give one"),
    (HEAD + "[axes.seed]\nlist = [-1]", "seed = -1: must be a whole number from 0"),
    ("repeats = 2\n" + HEAD + "[axes.seed]\nlist = [1]", "axes.seed: repeats give seeds too"),
    ("repeats = 0\n" + HEAD, "repeats: 0 is not from 1"),
    ("seed = 1.5\n" + HEAD, "seed: 1.5 does not fit here; write a whole number"),
    ("seeds = 'all'\n" + HEAD, "seeds: 'all' does not fit here; write 'same' or 'different'"),
    ("keep = ['disk']\n" + HEAD, "keep: 'disk' is an unknown variable; did you mean 'disc'?"),
    ("summary = ['number']\n" + HEAD, "summary: 'number' is an unknown summary; did you mean 'numbers'?"),
    ("time_limit = '0 s'\n" + HEAD, "time_limit: '0 s' is not above 0"),
    ("time_limit = '5'\n" + HEAD, "time_limit: '5' has no unit"),
    ("name = '../up'\n" + HEAD, "name: '../up' is not a valid name"),
    ("machine = 'plain_rotor'\n[experiments.'../a']\nkind = 'steady'", "experiments.../a: '../a' is not a valid name"),
    (FILM + "[axes.'bearings.1.clearence']\nlist = ['25 um']", "unknown value; did you mean 'clearance'?"),
    (FILM + "[axes.'bearings.7.clearance']\nlist = ['25 um']", "axes.bearings.7.clearance: '7' is none of 2 entries"),
    (FILM + "[axes.'bearings.1.clearance']\nlist = ['25 V']", "axes.bearings.1.clearance.list: '25 V' is not a length"),
    (FILM + "[axes.'bearings.1.clearance']\nlist = ['-2 um']", "bearings.1.clearance: '-2 um' must be above 0"),
    (FILM + "[axes.'bearings.1.clearance']\nlatin = ['-9 um', '9 um']\n[latin]\nsamples = 9", "must be above 0"),
    (FILM + "[axes.'effects.unbalanse.me']\nlist = ['1 g*mm']", "unknown effect; did you mean 'unbalance'?"),
    (FILM + "[axes.'grid.n_theta']\nlatin = ['8', '64']\n[latin]\nsamples = 4", "has no values in between"),
    (FILM + "[axes.'grid.n_theta']\nlist = [30]", "is not a multiple of 4"),
    (FILM + "[set]\n'grid.n_theta' = 30", "set.grid.n_theta: grid.n_theta: 30 is not a multiple of 4"),
    (FILM + "[set]\n'grid.n_tehta' = 32", "set.grid.n_tehta: unknown value; did you mean 'n_theta'?"),
    (FILM + "[set]\n'grid.n_z' = 8\n[axes.'grid.n_z']\nlist = [8]", "axes.grid.n_z: is given below [set] too"),
    (FILM + "[axes.duration]\nlist = ['1 s']", "axes.duration: experiment prbs gives duration too"),
    (FILM + "[axes.machine]\nlist = ['plain_rotor']", "machine: is given and is an axis too"),
    (FILM + "[axes.bias]\nlist = ['0.1 s', '2 s']", "axes.bias: bias = 2 s: leaves nothing of the duration of 1 s"),
    ("repeats = 9000000\n" + FILM + "[axes.speed]\nlist = ['1 rpm', '2 rpm']", "18000000 cases are above the limit"),
    (f"machine = {'[' * 3000}", "not a"),
]


@pytest.mark.parametrize(("text", "sentence"), BAD, ids=[sentence[:40] for _, sentence in BAD])
def test_what_cannot_be_a_plan_is_one_sentence(text, sentence):
    with pytest.raises(PlanError) as caught:
        make_plan(text)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_a_file_that_is_no_plan_is_one_sentence(tmp_path):
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "large").write_bytes(b"#" * 10_000_001)
    for name, sentence in (("binary", "is not text"), ("large", "above the limit of 10 MB"), (".", "is not a file")):
        with pytest.raises(PlanError, match=sentence):
            load_plan(tmp_path / name)
    with refused(PlanError, "plan", "nothing"):
        load_plan("nothing")


def test_two_experiments_that_are_the_same_are_refused(tmp_path):
    from rotorsim.campaign.store import make_store

    same = "machine = 'plain_rotor'\n[experiments.a]\nkind = 'steady'\n[experiments.b]\nkind = 'steady'\n"
    with refused(PlanError, "experiments"):
        make_store(make_plan(same), tmp_path / "store")
