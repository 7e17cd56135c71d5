"""Whole diagnoses of a plain rotor: no effect, named effect, tie, unknown force; files and order of records."""

import json

import numpy as np
import pytest

from identification import save
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.cli import main
from rotorsim.discrepancy import diagnose, hide
from rotorsim.discrepancy.gap import reduction
from rotorsim.discrepancy.machine_file import difference
from rotorsim.machine import load_machine

pytestmark = pytest.mark.slow
FEW = ("coupling", "runout")
"""Candidates where no more are needed."""


@pytest.fixture(scope="module")
def coupled(machine, models, recorded):
    """A hidden force at 2X, its diagnosis and the truth."""
    records, truth = recorded(("coupling.force_2x",), 4)
    return diagnose(machine, records, effects=FEW, models=models), truth, records


def test_a_machine_in_which_nothing_is_missing_gets_no_name(machine, models, recorded):
    records, _ = recorded((), 3)
    steps = list[tuple[str, int]]()
    found = diagnose(machine, records, models=models, progress=lambda stage, most=0: steps.append((stage, most)))
    assert found.status == "no_disagreement"
    for stage in ("calibrate", "screen"):
        own = [most for name, most in steps if name == stage]
        assert 0 < len(own) <= own[0] and len({*own}) == 1
    assert not found.effects and found.exit_code == 0
    assert found.apply().hash != machine.hash  # the new calibration


def test_a_hidden_force_of_the_coupling_is_named_and_closes_the_gap(coupled):
    found, truth, _ = coupled
    assert [f.form for f in found.effects] == ["coupling.force_2x"]
    assert found.status == "named"
    size = float(np.hypot(*truth.amplitudes[0]))
    one = found.effects[0]
    assert abs(one.parameters["force_2x"] - size) < 3 * one.sd["force_2x"]
    assert reduction(found.gap) > 0.5
    assert found.localisation[0].group == "2X"


def test_the_order_of_records_and_of_candidates_changes_nothing(machine, models, coupled):
    found, _, records = coupled
    again = diagnose(machine, records[::-1], effects=FEW[::-1], models=models)
    assert json.dumps(again.as_dict(), default=float) == json.dumps(found.as_dict(), default=float)


def test_the_new_machine_file_holds_the_effect_with_its_evidence(coupled, tmp_path):
    found, _, _ = coupled
    after = found.apply()
    after.save(tmp_path / "machine.toml")
    text = (tmp_path / "machine.toml").read_text()
    assert "[effects.coupling]" in text and "one standard deviation" in text and found.data_hash in text
    assert load_machine(tmp_path / "machine.toml").effects["coupling"][0].force_2x > 0
    assert "+force_2x = " in difference(found.machine, after)


def test_the_report_is_one_page_that_fetches_nothing(coupled, tmp_path):
    found, _, _ = coupled
    found.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Named: coupling.force_2x." in page and "untouched" in page
    assert "src=" not in page.split("<body>")[1]


def test_a_runout_at_1x_is_a_tie_with_a_bow_and_never_a_name(machine, models, recorded):
    records, _ = recorded(("runout.amplitude_1x",), 5)
    found = diagnose(machine, records, effects=("runout", "shaft_bow"), models=models)
    assert found.status == "tie" and found.exit_code == 11
    assert [set(f.tie_class) for f in found.effects] == [{"runout.amplitude_1x", "shaft_bow.bow"}]


def test_a_force_that_no_candidate_makes_gets_no_name_but_a_place(machine, models, recorded):
    def hum(rows, planned):
        t = np.arange(len(rows)) * 2e-4
        rows[:, 4] += 2.0 * np.sin(2 * np.pi * 62.5 * t)
        return rows

    records, _ = recorded((), 6, disturb=hum)
    found = diagnose(machine, records, effects=("shaft_bow",), models=models)
    assert found.status == "unknown" and found.exit_code == 12
    line = found.unknown["lines"][0]
    assert line["frequency_hz"] == pytest.approx(62.5, abs=1.0)
    assert line["force_n"] == pytest.approx(2.0, rel=0.3)


def test_displacements_in_mils_are_suggested_and_not_assumed(machine, models, recorded):
    records, _ = recorded((), 3)
    wrong = [r.assign(disc_measured=r.disc_measured.copy(data=r.disc_measured.values / 25.4)) for r in records]
    with pytest.raises(DataError, match=r"nothing was assumed"):
        diagnose(machine, wrong, models=models)


def test_exchanged_channels_are_noticed(machine, models, recorded):
    records, _ = recorded((), 3)
    wrong = [r.assign(disc_measured=r.disc_measured.copy(data=r.disc_measured.values[:, ::-1])) for r in records]
    with pytest.raises(DataError, match="exchanged"):
        diagnose(machine, wrong, models=models)


def test_an_effect_that_cannot_be_hidden_is_refused_in_a_sentence(machine, truth_plant):
    with refused(DataError, "effects", "supply_droop"):
        hide(machine, ["supply_droop"], twin=truth_plant)


@pytest.mark.parametrize(
    ("stated", "code", "words"),
    [(5e-9, 12, "in place of the stated 0.005 um nothing would disagree"), (5e-8, 0, ""),
     (5e-7, 0, "stated accuracy of 0.5 um is coarser than that")],
)  # fmt: skip
def test_an_accuracy_ten_times_too_good_or_too_coarse_is_in_the_headline(
    recorded, tmp_path, capsys, stated, code, words
):
    """1X of each record errs by some 0.04 um: the sentence of the command names the statement that contradicts it."""
    records, _ = recorded()
    for i, record in enumerate(records):
        error = np.random.default_rng([9, i]).normal(0, 4e-8, (2, 2))
        wave = np.exp(1j * record["angle_measured"].values)[:, None]
        moved = record["disc_measured"].values + (wave * (error[0] + 1j * error[1])).real
        record["disc_measured"] = record["disc_measured"].copy(data=moved)
        save(record.assign_attrs(accuracy=stated), tmp_path / f"{record.attrs['record']}.nc")
    effects = [part for name in FEW for part in ("--effect", name)]
    with pytest.raises(SystemExit) as end:
        main(["diagnose", "plain_rotor", str(tmp_path), *effects, "--out", str(tmp_path / "out"), "--no-report"])
    headline = next(line for line in capsys.readouterr().out.splitlines() if "isagree" in line or "Unknown" in line)
    assert end.value.code == code and words in headline
    assert ("One statement contradicts the data" in headline) == bool(words)
