"""Loop of diagnoses and experiments: steps on disk, rigs, resumption, ends, bad input; whole loops are slow."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.discrepancy import decide, loop
from rotorsim.discrepancy.decision import ALLOWED, FILE, OTHERS, DecisionStep, DecisionSteps, read_steps
from rotorsim.discrepancy.hidden_machine import read_truth
from rotorsim.discrepancy.loop import DecisionLoop, FolderRig, VirtualRig, _with_files, open_rig
from rotorsim.discrepancy.verdict import Explanation
from small_diagnosis import small_diagnosis
from studies.benchmarks.decide import HiddenRig, loop_figures
from studies.benchmarks.loop_case import LoopCase, Rejected, counted, read_cases, write_cases

ASKED = {"machine": "plain_rotor", "rig": "virtual:p", "allow": list(ALLOWED), "sure": 0.95}
OPTION = SimpleNamespace(name="impact")


def some_steps(tmp_path):
    """Two steps, the second after an experiment whose record is there."""
    record = tmp_path / "next_1.nc"
    record.write_bytes(b"x")
    first = DecisionStep("", 0.0, (), "tie", {"a": 0.5, "b": 0.5}, 1.0)
    second = DecisionStep("impact", 2.0, (str(record),), "named", {"a": 0.99, "b": 0.01}, 0.08, 0.9)
    return DecisionSteps(ASKED).with_step(first).with_step(second)


def test_steps_are_read_as_they_were_written(tmp_path):
    steps = replace(
        some_steps(tmp_path), end="decided", first=("r.nc",), pending={"experiment": "x", "minutes": 3.0, "records": ()}
    )
    steps.write(tmp_path)
    assert read_steps(tmp_path, ASKED) == steps
    assert steps.spent == 2.0 and not steps.made
    assert replace(steps, pending={"minutes": 3.0, "records": ("n.nc",)}).spent == 5.0
    assert steps.sentence == "decided: one explanation has 95 %; 1 experiment, 2 min of rig time."


def test_the_table_has_the_odds_after_each_step(tmp_path):
    lines = some_steps(tmp_path).table().splitlines()
    assert lines[0].split() == ["step", "experiment", "min", "bit", "a", "b"]
    assert lines[1].split() == ["0", "records", "there", "are", "0", "1.00", "50", "%", "50", "%"]
    assert lines[2].split() == ["1", "impact", "2", "0.08", "99", "%", "1", "%"]


@pytest.mark.parametrize(("text", "sentence"), [
    ("[]", "does not hold the steps of a loop"), ('{"version": 7}', "does not hold the steps of a loop"),
    ("{", "does not hold the steps of a loop"),
])  # fmt: skip
def test_a_file_that_holds_no_steps_is_refused(tmp_path, text, sentence):
    (tmp_path / FILE).write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_steps(tmp_path, ASKED)


def test_a_loop_that_was_begun_otherwise_or_lost_a_record_is_refused(tmp_path):
    some_steps(tmp_path).write(tmp_path)
    with refused(DataError, "rig", "virtual:q"):
        read_steps(tmp_path, ASKED | {"rig": "virtual:q"})
    (tmp_path / "next_1.nc").unlink()
    with refused(DataError, "records", str(tmp_path / "next_1.nc")):
        read_steps(tmp_path, ASKED)


def test_rigs_that_are_not_there_are_refused(tmp_path, machine):
    with refused(DataError, "rig", "vrtual:x"):
        open_rig("vrtual:x", machine)
    with pytest.raises(DataError, match=r"gone is not a folder; make it"):
        open_rig(str(tmp_path / "gone"), machine).check(tmp_path)
    with refused(DataError, "rig", str(tmp_path / "gone" / "sealed" / "truth.json")):
        open_rig(f"virtual:{tmp_path / 'gone'}", machine).check(tmp_path)
    (tmp_path / "sealed").mkdir()
    (tmp_path / "sealed" / "truth.json").write_text('{"seed": 1}')
    with refused(DataError, "rig", str(tmp_path / "sealed" / "truth.json")):
        VirtualRig(tmp_path, machine).check(None)
    with refused(DataError, "budget", 0.0):
        decide(machine, tmp_path, budget=0.0)


def test_results_in_the_folder_of_the_rig_are_refused(tmp_path, machine):
    for rig in (FolderRig(tmp_path), VirtualRig(tmp_path, machine)):
        for out in (tmp_path, tmp_path / "decision"):
            with refused(DataError, "out", out):
                rig.check(out)
    with refused(DataError, "out"):
        FolderRig(tmp_path).check(None)


def test_records_of_an_experiment_that_was_not_diagnosed_stay_its_own(tmp_path):
    """Made, then interrupted; a second file comes, or the first one is taken away again."""
    kept, late = tmp_path / "a.nc", tmp_path / "b.nc"
    for path in (kept, late):
        path.write_bytes(b"x")
    pending = {"experiment": "x", "minutes": 3.0, "expected": 0.5, "records": (str(kept),)}
    steps = replace(some_steps(tmp_path), pending=pending)
    assert _with_files(steps, [kept, late]).pending["records"] == (str(kept), str(late))
    waited = _with_files(replace(steps, pending={}), [late]).pending
    assert waited["experiment"] == "" and waited["records"] == (str(late),)
    steps.write(tmp_path)
    kept.unlink()
    assert read_steps(tmp_path, ASKED).pending["records"] == ()


def test_a_folder_gives_what_is_new_once_it_does_not_grow(tmp_path, monkeypatch):
    """The clock is that of the test: while the rig sleeps the file grows, for 2.5 s."""
    (tmp_path / "old.nc").write_bytes(b"old")
    clock, stop = [0.0], 2.5

    def sleep(seconds):
        clock[0] += seconds
        if clock[0] < stop:
            with (tmp_path / "new.nc").open("ab") as file:
                file.write(b"more")

    rig = FolderRig(tmp_path, longest=20.0, taken={tmp_path / "old.nc"})
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: clock[0], sleep=sleep))
    assert rig.run(OPTION, 1, lambda: None) == [tmp_path / "new.nc"] and clock[0] >= stop
    stop = 0.0
    assert FolderRig(tmp_path).begin(["given"]) == ["given", tmp_path / "new.nc", tmp_path / "old.nc"]
    taken = {tmp_path / "new.nc", tmp_path / "old.nc"}
    assert FolderRig(tmp_path, longest=1.0, taken=taken).run(OPTION, 2, lambda: None) == []


@dataclass(frozen=True)
class OnePlan:
    """A plan of one experiment, of which only the loop's way is looked at."""

    proposals: tuple = (SimpleNamespace(option=SimpleNamespace(name="impact", minutes=2.0),
                                        outlook=SimpleNamespace(decided=0.9, of_effects=0.9)),)  # fmt: skip
    settles: bool = True

    def first(self, longest):
        return self.proposals[0]

    def campaign(self, machine, name):
        return ""


@dataclass(eq=False)
class Scripted(DecisionLoop):
    """A loop whose diagnoses do nothing but let something happen meanwhile; the odds settle with `enough` records."""

    meanwhile: Callable = print
    enough: int = 3
    asked: tuple = ()

    def _diagnosed(self, records):
        self.meanwhile(len(records))
        p = 0.99 if len(records) >= self.enough else 0.6
        odds = (Explanation(("a",), False, 1.0, 0.01, True, p), Explanation((), False, 0.0, 0.01, True, 1 - p))
        return small_diagnosis(status="tie", explanations=odds, planner=self._plan)

    def _plan(self, *asked):
        self.asked = asked
        return OnePlan()


def scripted(machine, folder, out, meanwhile, waiting=lambda stage: None, enough=3):
    """A loop with records in `folder`; the functions are called in each diagnosis and in each wait for a record."""
    rig = FolderRig(folder, longest=1.5)
    running = Scripted(machine, rig, 30.0, tuple(ALLOWED), False, None, 0.95, out, None, waiting, lambda steps: None,
                    object(), 0.004, meanwhile=meanwhile, enough=enough)  # fmt: skip
    return running.run(rig.begin([]), read_steps(out, ASKED)).steps


@pytest.mark.parametrize(("alike", "names"), [(False, ["weighed", "plain"]), (True, ["plain"])])
def test_records_of_one_mapping_are_not_asked_to_state_a_change_of_their_own(machine, alike, names, tmp_path):
    """A change that nobody named stays allowed, and a plan may ask for it."""
    asked = []
    plan = OnePlan(tuple(SimpleNamespace(option=SimpleNamespace(name=n, stated=n == "weighed"))
                         for n in ("weighed", "plain")))  # fmt: skip
    found = SimpleNamespace(plan=lambda allow, sure: asked.append((allow, sure)) or plan)
    begun = DecisionLoop(
        machine, None, 30.0, tuple(ALLOWED), alike, None, 0.9, tmp_path, None, print, print, None, 0.004
    )
    assert [p.option.name for p in begun._next_plan(found).proposals] == names
    assert asked == [(tuple(ALLOWED), 0.9)]


@pytest.fixture
def folders(tmp_path) -> tuple[Path, Path]:
    """Folder of a rig with one record, and one for the loop."""
    for name in ("rig", "out"):
        (tmp_path / name).mkdir()
    (tmp_path / "rig" / "0.nc").write_bytes(b"x")
    return tmp_path / "rig", tmp_path / "out"


def test_the_probability_that_ends_a_loop_is_that_which_its_plans_forecast(machine, folders):
    rig, out = folders
    running = Scripted(machine, FolderRig(rig, longest=0.1), 30.0, ("speed",), False, None, 0.8, out, None,
                    lambda stage: None, lambda steps: None, object(), 0.004, meanwhile=lambda count: None)  # fmt: skip
    running.run(running.rig.begin([]), DecisionSteps({}))
    assert running.asked == (("speed",), np.inf, 0.8)


def test_a_record_that_comes_before_an_experiment_is_proposed_is_not_that_of_the_experiment(machine, folders):
    rig, out = folders

    def early(count):
        if count == 1:
            (rig / "early.nc").write_bytes(b"x")

    def measured(stage):
        (rig / "measured.nc").write_bytes(b"x")

    steps = scripted(machine, rig, out, early, measured)
    made = [(s.experiment, s.minutes, tuple(Path(r).name for r in s.records)) for s in steps.steps]
    assert made == [("", 0.0, ()), ("", 0.0, ("early.nc",)), ("impact", 2.0, ("measured.nc",))]
    assert steps.names[1] == OTHERS and steps.end == "decided" and "1 experiment, 2 min" in steps.sentence


def test_a_record_that_comes_while_a_resumed_loop_diagnoses_is_that_of_the_experiment_that_waits(machine, folders):
    rig, out = folders
    first = scripted(machine, rig, out, lambda count: None, enough=2)
    assert first.end == "no_record" and first.pending["experiment"] == "impact"

    def late(count):
        (rig / "late.nc").write_bytes(b"x")

    steps = scripted(machine, rig, out, late, enough=2)
    assert [(s.experiment, s.records) for s in steps.steps] == [("", ()), ("impact", (str(rig / "late.nc"),))]
    assert steps.end == "decided" and not steps.pending


def test_records_that_came_while_nothing_ran_are_of_the_experiment_that_waits_or_a_step_of_their_own(machine, folders):
    rig, out = folders
    scripted(machine, rig, out, lambda count: None, enough=2)
    (rig / "waited_for.nc").write_bytes(b"x")
    steps = scripted(machine, rig, out, lambda count: None, enough=2)
    assert [s.experiment for s in steps.steps] == ["", "impact"] and steps.end == "decided"
    (rig / "more.nc").write_bytes(b"x")
    steps = scripted(machine, rig, out, lambda count: None, enough=2)
    assert [s.experiment for s in steps.steps] == ["", "impact", ""] and steps.spent == 2.0


def test_a_sealed_truth_makes_the_same_machine_again(tmp_path, machine, truth_plant, recorded):
    records, truth = recorded(("coupling.force_2x",), 4)
    (tmp_path / "truth.json").write_text(json.dumps(truth.as_dict(truth_plant), default=float))
    again = read_truth(tmp_path / "truth.json")
    assert {k.name: v for k, v in again.point.values.items()} == {k.name: v for k, v in truth.point.values.items()}
    assert again.point.fixed == truth.point.fixed and again.seed == truth.seed
    assert records


def test_figures_of_loops():
    done = LoopCase(1, ("a",), 5.0, (("b", 0.6, False), ("a", 0.97, True)), (0.4, 0.97), (np.nan, 0.9), ("", "x"),
                    "decided", "named")  # fmt: skip
    open_ = replace(done, tops=(("b", 0.6, False), ("b", 0.96, False)), truths=(0.4, 0.04))
    found = {f.name: f.value for f in loop_figures([done, open_])}
    assert found["loops not decided within three experiments"] == 0.5
    assert found["loops with a wrong explanation at 95 %"] == 1
    assert found["ties not broken by 1 experiments, of 2"] == 0.5
    assert found["promised chance of a decision, mean"] == pytest.approx(0.9)


TIE = LoopCase(3, ("a",), 1.5, (("b", 0.6, False), ("a", 0.97, True)), (0.4, 0.97), (0.5, 0.9), ("", "x"), "decided",
               "named")  # fmt: skip


def test_rejected_seeds_are_kept_and_not_run_again(tmp_path):
    path, run = tmp_path / "ties.jsonl", []

    def made(number):
        run.append(number)
        return TIE if number == 3 else Rejected(number, "no tie before the first experiment")

    for _ in range(2):
        assert list(counted(made, 1, 1, read_cases(path), path)) == [TIE]
    assert run == [1, 2, 3] and list(read_cases(path)) == [1, 2, 3]


def test_rows_of_loops_and_of_rejected_seeds_are_read_as_they_were_written(tmp_path):
    write_cases([TIE, Rejected(4, "no tie")], tmp_path / "cases")
    assert read_cases(tmp_path / "cases") == {3: TIE, 4: Rejected(4, "no tie")}
    (tmp_path / "cases").write_text('{"number": 1}\n')
    with refused(DataError, "line", '{"number": 1}'):
        read_cases(tmp_path / "cases")


@pytest.mark.slow
def test_a_loop_decides_between_effects_that_tie_at_first(tmp_path, machine, models, truth_plant, recorded):
    """One operating point shows too little; the planned experiment on the hidden machine settles it, once."""
    records, truth = recorded(("coupling.force_2x",), 4)
    few = [r for r in records if r.attrs["record"].startswith("fit_1")]
    shown: list[DecisionSteps] = []
    rig = HiddenRig(machine, truth_plant, truth, few)
    found = decide(machine, rig, 30.0, effects=("coupling", "runout"), models=models, out=tmp_path,
                   shown=shown.append)  # fmt: skip
    assert found.steps.end == "decided"
    assert max(found.odds, key=found.odds.get) == "coupling.force_2x"
    assert shown[-1] == found.steps and read_steps(tmp_path, found.steps.asked).steps == found.steps.steps
    again = decide(machine, rig, 30.0, effects=("coupling", "runout"), models=models, out=tmp_path)
    assert again.steps.steps == found.steps.steps and again.odds == found.odds


@pytest.mark.slow
def test_a_budget_below_every_experiment_is_refused_and_the_first_step_is_kept(
    machine, models, truth_plant, recorded, tmp_path
):
    """Budget below every experiment: refused with the shortest one's time, and the steps so far are kept."""
    records, truth = recorded(("runout.amplitude_1x",), 6)
    few = [r for r in records if r.attrs["record"].startswith("fit_1")]
    with refused(DataError, "budget", 2.001):
        decide(machine, HiddenRig(machine, truth_plant, truth, few), 2.001, models=models, out=tmp_path, sure=0.9999)
    assert (tmp_path / FILE).exists()


@pytest.mark.slow
def test_records_put_into_a_folder_are_taken_for_the_planned_experiment(machine, models, recorded, tmp_path):
    records, _ = recorded(("coupling.force_2x",), 4)
    folder, out = tmp_path / "rig", tmp_path / "out"
    folder.mkdir()
    for record in (r for r in records if r.attrs["record"].startswith("fit_1")):
        write_netcdf(folder / f"{record.attrs['record']}.nc", record)
    waits = FolderRig(folder, longest=0.5)
    first = decide(machine, waits, 30.0, models=models, out=out, sure=0.9999)
    assert first.steps.end == "no_record" and (out / "next.toml").exists()
    new = next(r for r in records if r.attrs["record"] == "fit_2")
    write_netcdf(folder / "measured.nc", new)
    second = decide(machine, FolderRig(folder, longest=0.5), 30.0, models=models, out=out, sure=0.9999)
    assert [s.records for s in second.steps.steps] == [(), (str(folder / "measured.nc"),)]
    assert second.steps.spent > 2
