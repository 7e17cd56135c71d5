"""`rotorsim hide` and `rotorsim diagnose` on a plain rotor with few candidates, with bad input."""

import json
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from identification import make_record
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.commands.diagnosis import show, unfinished
from rotorsim.discrepancy.calibration import GRID
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import draw, record_of, write
from rotorsim.discrepancy.trial import SETTLING, SHORTEST_PERIOD
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from tests.support.small_diagnosis import small_diagnosis

EFFECTS = ("coupling", "runout", "shaft_bow")
KEPT = ("fit_1", "fit_2", "fit_3", "fit_5", "fit_2_repeat", "held_out_1", "held_out_2", "untouched_2", "untouched_4")


@pytest.mark.parametrize("command", ["hide", "diagnose"])
def test_help_has_an_example(run, command):
    code, out, _ = run(command, "--help")
    assert code == 0 and f"Example: rotorsim {command}" in out


def test_nothing_to_diagnose_is_a_sentence(run, tmp_path):
    assert run("diagnose", "plain_rotor")[::2] == (
        2, "diagnose: no records; name files or a folder, or give --self-test\n",
    )  # fmt: skip
    code, _, err = run("diagnose", "plain_rotor", tmp_path / "none.nc")
    assert code == 2 and err.endswith("is not there; give the path of a record\n")
    code, _, err = run("diagnose", "plain_rotor", tmp_path)
    assert code == 2 and "no .nc record in it" in err


def test_a_table_of_few_speeds_is_a_sentence(run, tmp_path):
    table = tmp_path / "runup.csv"
    lines = [f"{600 + 100 * k},{1 + k},{10 * k},{1 + k},{10 * k}" for k in range(5)]
    table.write_text("rpm,ax,px,ay,py\n" + "\n".join(lines) + "\n")
    (tmp_path / "map.toml").write_text(MAPPING)
    code, _, err = run("diagnose", "plain_rotor", table, "--mapping", tmp_path / "map.toml")
    assert code == 2 and "5 speeds are too few" in err


def test_records_that_are_too_short_are_refused_before_anything_is_computed_or_written(run, tmp_path):
    samples = round(0.99 * (SETTLING + SHORTEST_PERIOD) / RIG_SAMPLE)
    known = {"disc_measured": np.zeros((samples, 2)), "speed": np.full(samples, 200.0)}
    record = make_record(np.arange(samples) * RIG_SAMPLE, known, {"record": "brief", "role": "fit"})
    write_netcdf(tmp_path / "brief.nc", record)
    code, out, err = run("diagnose", "plain_rotor", tmp_path / "brief.nc", "--out", tmp_path / "found")
    assert (code, out, err.count("\n")) == (2, "", 1) and err.startswith("brief: lasts ")
    assert f"at least {SETTLING + SHORTEST_PERIOD} s" in err and not (tmp_path / "found").exists()


MAPPING = """[speed]
column = "rpm"
unit = "rpm"

[vectors.1X.x]
amplitude = { column = "ax", unit = "um" }
phase = { column = "px", unit = "deg" }

[vectors.1X.y]
amplitude = { column = "ay", unit = "um" }
phase = { column = "py", unit = "deg" }
"""


def test_records_that_are_there_already_are_not_replaced(run, tmp_path):
    (tmp_path / "records").mkdir()
    code, _, err = run("hide", "plain_rotor", "--out", tmp_path)
    assert code == 2 and "records: is there already; choose another --out" in err


def test_an_unknown_candidate_and_a_wrong_tolerance_are_sentences(run, tmp_path):
    code, _, err = run("diagnose", "plain_rotor", tmp_path, "--tolerance", "3")
    assert code == 2 and "is not a fraction" in err


def test_a_plan_that_makes_no_sense_is_a_sentence(run, tmp_path):
    code, _, err = run("diagnose", "plain_rotor", tmp_path, "--allow", "speed")
    assert code == 2 and "--allow: is about a plan; give --plan-next or --until-decided too" in err
    code, _, err = run("diagnose", "plain_rotor", tmp_path, "--plan-next", "--allow", "speed,biass")
    assert code == 2 and "--allow: 'biass' cannot be changed by a plan; did you mean 'bias'?" in err


LOOP = ("diagnose", "plain_rotor", "--until-decided")


@pytest.mark.parametrize(("rest", "sentence"), [
    ((), "--until-decided: needs --rig: virtual:FOLDER of rotorsim hide, or a folder for new records"),
    (("--rig", "virtual:gone"), "gone/sealed/truth.json: cannot be read"),
    (("--rig", "gone"), "--rig: gone is not a folder; make it"),
    (("--rig", "vrtual:gone"), "'vrtual:gone' is neither virtual:FOLDER"),
    (("--rig", ".", "--budget", "30"), "--budget: '30' has no unit; write e.g."),
    (("--rig", ".", "--budget", "0 min"), "--budget: '0 min' is not above 0"),
    (("--rig", ".", "--held-out", "a.nc"), "--until-decided: takes no --held-out and --untouched"),
    (("--rig", ".", "--allow", "bias"), "cannot be changed, plain_rotor has no injectors with moving pins"),
])  # fmt: skip
def test_a_loop_that_makes_no_sense_is_a_sentence(run, tmp_path, monkeypatch, rest, sentence):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*LOOP, *rest)
    assert code == 2 and sentence in err and err.count("\n") == 1
    assert not list(tmp_path.rglob("*.json"))


def test_a_rig_without_a_loop_is_a_sentence(run, tmp_path):
    code, _, err = run("diagnose", "plain_rotor", tmp_path, "--rig", "virtual:x")
    assert code == 2 and "--rig: is about a loop of experiments; give --until-decided too" in err


def test_a_verdict_that_is_there_is_not_replaced(run, tmp_path):
    (tmp_path / "diagnosis.json").write_text("{}")
    code, _, err = run("diagnose", "plain_rotor", tmp_path, "--out", tmp_path)
    assert code == 2 and "is there already; choose another --out or add --force" in err


def test_what_an_interrupted_diagnosis_computed_waits_for_the_same_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    with pytest.raises(KeyboardInterrupt), unfinished("rotor", ["a.nc"]) as folder:
        folder.mkdir(parents=True)
        raise KeyboardInterrupt
    assert folder.exists()
    with pytest.raises(DataError), unfinished("rotor", ["b.nc"]) as other:
        assert other != folder
        other.mkdir()
        raise DataError("b.nc: of another machine")
    assert folder.exists() and not other.exists()
    os.utime(folder, (0, 0))
    with unfinished("rotor", ["b.nc"]):
        assert not folder.exists()
    with pytest.raises(KeyboardInterrupt), unfinished("rotor", ["a.nc"]) as folder:
        folder.mkdir()
        for k in range(3):
            np.save(folder / f"{k}.npy", np.zeros(1))
        raise KeyboardInterrupt
    assert not capsys.readouterr().err
    with unfinished("rotor", ["a.nc"]) as again:
        assert again == folder and again.exists()
    assert "3 simulated responses" in capsys.readouterr().err and not folder.exists()


@pytest.mark.parametrize(
    ("command", "work"),
    [
        (("diagnose", "plain_rotor", "x.nc"), "rotorsim.discrepancy.diagnose"),
        (("study", "identification-vs-physics"), "rotorsim.study.identify_records.run"),
    ],
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_sigterm_state_that_the_same_command_continues(run, tmp_path, monkeypatch, command, work, number):
    def interrupted(*arguments, **options):
        os.kill(os.getpid(), number)
        time.sleep(10)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(work, interrupted)
    code, _, err = run(*command)
    assert code == 130 and "interrupted: what was computed is kept, and the same command continues" in err
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


@pytest.mark.parametrize(
    ("name", "known"),
    [("runout.fifth", "runout.amplitude_3x, runout.roughness"), ("gravity", "crack, internal_damping")],
)
def test_what_is_no_candidate_is_a_sentence_with_those_there_are(name, known):
    with pytest.raises(DataError, match=f"'{name}' cannot be a candidate in .*choose among .*{known}"):
        candidates(Twin(load_machine("plain_rotor"), GRID, 5e-5), [name])


def test_a_candidate_is_an_effect_one_of_its_parameters_or_that_of_one_injector():
    twin = Twin(load_machine("dtu_gas_bearing"), GRID, 2e-4)

    def keys(*names):
        return {f.key for f in candidates(twin, names)}

    assert keys("runout.amplitude_2x") == {"runout.amplitude_2x"}
    assert keys("weak_injector") == keys("weak_injector.blocked", "weak_injector.stuck")
    assert keys("weak_injector.stuck of injector 3") == {"weak_injector.stuck of injector 3"}
    assert len(keys("weak_injector.stuck")) == 4


@pytest.mark.slow
def test_a_hidden_effect_is_found_without_opening_the_truth(run, tmp_path):
    machine = load_machine("plain_rotor")
    machine.save(tmp_path / "rotor.toml")
    twin = Twin(machine, GRID, 5e-5, only=EFFECTS)
    truth = draw(twin, ["coupling.force_2x"], 4, (3.0, 6.0))
    rng = np.random.default_rng(4)
    records = [record_of(twin, p, truth.point, 4) for p in campaign(machine) if p.name in KEPT]
    for r in records:
        r["disc_measured"] = r.disc_measured.copy(
            data=r.disc_measured.values + rng.normal(0, 1e-7, r.disc_measured.shape)
        )
    write(tmp_path / "puzzle", records, truth, twin)
    sealed = tmp_path / "puzzle" / "sealed" / "truth.json"
    sealed.chmod(0)
    sealed.rename(sealed.with_name("gone"))
    candidates = [word for name in EFFECTS for word in ("--effect", name)]
    code, out, _ = run(
        "diagnose", tmp_path / "rotor.toml", tmp_path / "puzzle" / "records", *candidates, "--out", tmp_path / "found",
        "--json", "--plan-next", "--allow", "speed",
    )  # fmt: skip
    result = json.loads(out)
    assert result["plan"]["sentence"] and result["odds"][0]["name"] == "coupling.force_2x"
    assert (code, result["status"]) == (10, "named")
    assert result["effects"][0]["form"] == "coupling.force_2x"
    assert set(result["files"]) - {"plan"} == {"verdict", "gap", "machine", "difference", "report"}
    for path in result["files"].values():
        assert Path(path).stat().st_size > 0
    assert "coupling" in load_machine(result["files"]["machine"]).effects


@pytest.mark.parametrize(("status", "shown"), [("unknown", True), ("partial", True), ("recalibrated", False)])
def test_numbers_of_a_calibration_without_a_verdict_are_shown_as_not_trusted(capsys, status, shown):
    found = small_diagnosis(status=status, effects=[], calibration={"bearing.0.kx": (0.3, 0.01)})
    show(found, {}, False)
    assert ("not trusted: stiffness kxx" in capsys.readouterr().out) == shown


@pytest.mark.parametrize("status", ["unknown", "named", "partial"])
def test_what_is_known_and_the_next_step_stand_before_the_details(capsys, status):
    show(small_diagnosis(status=status, calibration={"bearing.1.kx": (-0.5, 0.01)}), {}, False)
    headline, *lines = capsys.readouterr().out.splitlines()
    [following] = [k for k, line in enumerate(lines) if line.startswith("  next: ")]
    details = [k for k, line in enumerate(lines) if "probability" in line or "over a floor" in line or "note:" in line]
    assert headline.startswith(status.title()) and details and following < min(details)
