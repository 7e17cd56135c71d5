"""Probes through runs: streamed and in memory, summary, report, campaign, live record, command line."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import identification as idn
from rotorsim.base.errors import DataError
from rotorsim.cli import main
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.experiments.catalogue.steady import Steady
from rotorsim.experiments.running import record, run
from rotorsim.experiments.summary import summarise_experiment
from rotorsim.live.records import Replay
from rotorsim.live.rig import Rig
from rotorsim.live.runner import Runner
from rotorsim.machine import Machine, machine_text
from rotorsim.plant import Plant
from rotorsim.report.record import made_sections
from rotorsim.report.run import analyse
from rotorsim.signals.record_blocks import probe_planes

PAGE = Path(__file__).parents[2] / "docs" / "probes.md"
PROBE = '\n[[probes]]\nname = "{}"\nposition = "{} mm"\nangle = "{} deg"\nquantity = "{}"\nsensitivity = "{}"\n'
TEXT = machine_text("plain_rotor") + '\n[effects.base_vibration]\nx = "1 m/s^2"\n' + "".join(
    PROBE.format(*row)
    for row in (
        ("DE_x", 150, 45, "relative_displacement", "7.87 V/mm"),
        ("DE_y", 150, 135, "relative_displacement", "200 mV/mil"),
        ("NDE", 480, 0, "absolute_displacement", "8 V/mm"),
        ("A", 480, 0, "housing_acceleration", "100 mV/g"),
    )
)  # fmt: skip
STEADY = Steady(speed=200.0, duration=2.0)


@pytest.fixture(scope="module")
def plant():
    return Plant(Machine.from_text(TEXT))


@pytest.fixture(scope="module")
def steady(plant):
    return run(plant, STEADY)


def test_a_streamed_record_holds_the_probes_of_one_in_memory(plant, steady, tmp_path):
    record(plant, STEADY, tmp_path / "steady.nc")
    back = idn.read(tmp_path / "steady.nc")
    assert back["probe_measured"].identical(steady["probe_measured"])
    assert idn.validate(back)["probe_unit"].values.tolist() == ["V"] * 4
    assert back["probe_measured"].attrs["units"] == "V"


def test_the_summary_has_the_readings_of_every_probe(steady):
    found = summarise_experiment(steady)["probes"]
    assert list(found) == ["DE_x", "DE_y", "NDE", "A"]
    values = steady["probe_measured"].sel(probe="A").values
    assert found["A"]["peak"] == pytest.approx(np.abs(values - values.mean()).max(), rel=1e-12)
    assert found["A"]["unit"] == "V"
    assert found["A"]["rms"] == pytest.approx(0.1 / 9.80665 / np.sqrt(2), rel=1e-3)  # 100 whole periods


def test_the_report_shows_the_orbit_of_a_plane_and_every_reading(steady):
    assert probe_planes(steady) == [("DE_x", "DE_y")]
    found = {one.section.title: one for one in made_sections(analyse(steady)) if one.why is None}
    planes = found["Orbits at the planes of the probes"]
    caption = planes.section.caption(analyse(steady), planes.data)
    assert "DE_x, DE_y at z = 150 mm" in caption
    readings = found["Readings of the probes"]
    figure = readings.section.draw(analyse(steady), readings.data)
    assert len(figure.data) == 8 and "NDE" in figure.layout.yaxis3.title.text
    assert planes.section.draw(analyse(steady), planes.data).data


def test_a_record_without_probes_has_no_section_of_them(steady):
    without = steady.drop_vars(["probe_measured", *(str(c) for c in steady.coords if str(c).startswith("probe"))])
    titles = {one.section.title for one in made_sections(analyse(without)) if one.why is None}
    assert not any("probes" in title for title in titles)


def test_a_live_rig_records_shows_and_replays_its_probes(tmp_path):
    runner = Runner(Rig(Machine.from_text(TEXT), {}))
    runner.record(tmp_path / "live.nc")
    runner._obey()
    for _ in range(30):
        runner._part(50)
    frame = runner.frame()
    runner.close()
    assert [name for name, _ in frame["now"]["probes"]] == ["DE_x", "DE_y", "NDE", "A"]
    assert all(text.endswith(" V") for _, text in frame["now"]["probes"])
    back = idn.read(tmp_path / "live.nc")
    assert back["probe_measured"].sizes == {"time": 1500, "probe": 4}
    replay = Replay(tmp_path / "live.nc")
    replay.advance(1500)
    assert replay.frame()["now"]["probes"] == frame["now"]["probes"]


def test_the_example_of_the_page_draws_the_orbits_of_both_planes(tmp_path, monkeypatch):
    """The soft bearing's end moves further than the other, x further than y at the resonance."""
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[0], found)
    peak = {name: p["peak"] for name, p in summarise_experiment(found["record"])["probes"].items()}
    assert peak["NDE_x"] > peak["DE_x"] > 0.2
    assert (tmp_path / "orbits.html").stat().st_size > 1e5
    assert np.ptp(found["volts"].values) > 0


def test_commands_take_probes_and_refuse_a_faulty_one(tmp_path, capsys):
    path = tmp_path / "probed.toml"
    path.write_text(TEXT)
    given = ["experiment", "steady", str(path), "--speed", "2000 rpm", "--duration", "0.5 s", "--no-report", "--json"]
    with pytest.raises(SystemExit) as ended:
        main([*given, "--out", str(tmp_path / "out")])
    assert not ended.value.code
    assert json.loads(capsys.readouterr().out)["probes"]["DE_y"]["unit"] == "V"
    path.write_text(TEXT.replace("135 deg", "135"))
    with pytest.raises(SystemExit) as ended:
        main([*given, "--out", str(tmp_path / "other")])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("angle", [0.0, np.pi / 2])
def test_the_shaft_answers_at_the_disc_to_a_hit_elsewhere_as_there_to_a_hit_on_the_disc(angle):
    """Reciprocity of Maxwell and Betti at standstill, where no force turns with the shaft."""
    text = machine_text("plain_rotor") + "".join(
        PROBE.format(f"at_{k}", 480, 90 * k, "absolute_displacement", "1 V/m") for k in range(2)
    )
    still = Plant(Machine.from_text(text).with_({"effects.unbalance.me": 0.0}))
    hit = Impact(peak=10.0, angle=angle, spacing=0.2, lead=0.01)
    there = run(still, hit)["probe_measured"].values
    here = run(still, replace(hit, position=0.48))
    moved, answered = here["disc"].values, there - there[0]
    assert here.attrs["force_position"] == 0.48 and np.abs(answered).max() > 2e-6
    np.testing.assert_allclose(moved - moved[0], answered, atol=1e-9 * np.abs(answered).max())


def test_a_hit_beside_the_shaft_is_refused(plant):
    with pytest.raises(DataError) as error:
        run(plant, Impact(position=0.7))
    assert error.value.argument == "position"
    same, disc = (run(plant, Impact(spacing=0.1, position=z)) for z in (0.3, None))
    np.testing.assert_array_equal(same["disc"].values, disc["disc"].values)  # the disc is at 300 mm
