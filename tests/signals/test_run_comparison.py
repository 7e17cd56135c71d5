"""Runs side by side: peaks found in records and vectors, and how they differ from the first run's."""

import json

import numpy as np
import pytest

from identification import make_record, make_vectors, save
from rotorsim.base.errors import DataError
from rotorsim.cli import main
from rotorsim.report import overlay, write
from rotorsim.signals import compare_runs

CRITICAL = 200.0


def response(speed, size, critical=CRITICAL):
    ratio = speed / critical
    return size * ratio**2 / (1 - ratio**2 + 0.1j * ratio)


def vectors(size, critical=CRITICAL, axes=("x", "y")):
    speed = np.linspace(50, 400, 351)
    a = np.stack([response(speed, size, critical) * k for k in (1, -1j)[: len(axes)]], axis=1)[:, None, :]
    return make_vectors(speed, np.abs(a), -np.angle(a), (1,), axes=axes)


def record(size):
    t = np.arange(60000) / 2000
    speed = 50 + 10 * t
    angle = np.cumsum(speed) / 2000
    z = response(speed, size) * np.exp(1j * angle)
    return make_record(t, {"disc": np.column_stack([z.real, z.imag]), "angle": angle, "speed": speed})


def test_half_the_size_at_a_higher_speed_is_told_against_the_first():
    found = compare_runs({"a": vectors(1e-6), "b": vectors(0.5e-6, 1.05 * CRITICAL)})
    first, other = (next(p for p in found.peaks() if p["run"] == name and p["axis"] == "x") for name in "ab")
    assert first["um"] == pytest.approx(10, rel=0.02) and "um_change" not in first
    assert other["um_change"] == pytest.approx(-0.5, abs=0.01)
    assert other["rpm_change"] == pytest.approx(0.05, abs=0.01)


def test_a_record_and_vectors_of_one_probe_go_together():
    found = compare_runs({"record": record(1e-6), "table": vectors(1e-6, axes=("x",))})
    assert found.axes == ("x", "y")
    x = {p["run"]: p for p in found.peaks() if p["axis"] == "x"}
    assert x["table"]["um"] == pytest.approx(x["record"]["um"], rel=0.05)
    figure = overlay(found)
    assert [trace.name for trace in figure.data] == ["record"] * 4 + ["table"] * 2


def test_true_against_measured_displacements_are_stated(tmp_path, capsys):
    true, table = record(1e-6), vectors(1e-6)
    seen = true.rename(disc="disc_measured")
    assert compare_runs({"a": true, "b": true}).mixed == compare_runs({"a": seen, "b": table}).mixed == ""
    found = compare_runs({"a": true, "b": seen})
    assert found.channels == {"a": "disc", "b": "disc_measured"} and "(a)" in found.mixed and "(b)" in found.mixed
    for name, one in (("a", true), ("b", seen)):
        save(one, tmp_path / f"{name}.nc")
    with pytest.raises(SystemExit):
        main(["compare", *(str(tmp_path / f"{n}.nc") for n in "ab"), "--json", "--out", str(tmp_path / "c")])
    shown = capsys.readouterr()
    assert json.loads(shown.out)["warnings"] == [found.mixed] and found.mixed in shown.err
    assert found.mixed in (tmp_path / "c" / "report.html").read_text()


def test_the_table_states_the_phase_lag_that_the_figure_draws():
    found = compare_runs({"a": vectors(1e-6), "b": vectors(2e-6)})
    figure = overlay(found)
    lags = {trace.xaxis: trace for trace in figure.data if trace.name == "a" and trace.yaxis in ("y3", "y4")}
    for peak, trace in zip((p for p in found.peaks() if p["run"] == "a"), lags.values(), strict=True):
        speed = np.asarray(trace.x, float)
        drawn = np.asarray(trace.y, float)[np.abs(speed - peak["rpm"]).argmin()]
        assert peak["phase_lag_deg"] == pytest.approx(drawn, abs=3.0)


def test_peaks_far_apart_are_not_compared():
    found = compare_runs({"a": vectors(1e-6), "b": vectors(1e-6, 1.6 * CRITICAL)})
    assert next(p for p in found.peaks() if p["run"] == "b")["um_change"] is None


@pytest.mark.parametrize(
    ("runs", "order", "sentence"),
    [
        ({"a": vectors(1e-6)}, 1, "compare: 1 run"),
        ({"a": vectors(1e-6), "b": vectors(1e-6)}, 2, "a: .*2X.* 1"),
        ({"a": vectors(1e-6), "b": record(1e-6).drop_vars("disc")}, 1, "b: .*disc"),
        ({"a": vectors(1e-6), "b": record(1e-6).isel(time=slice(0, 100))}, 1, "b: .*1X"),
    ],
)
def test_what_cannot_be_compared_is_refused(runs, order, sentence):
    with pytest.raises(DataError, match=sentence):
        compare_runs(runs, order)


def test_the_command_writes_peaks_and_page(tmp_path, capsys):
    for name, size in (("a", 1e-6), ("b", 2e-6)):
        save(vectors(size), tmp_path / f"{name}.nc")
    given = [str(tmp_path / "a.nc"), str(tmp_path / "b.nc"), "--out", str(tmp_path / "c")]
    with pytest.raises(SystemExit) as end:
        main(["compare", *given])
    assert end.value.code == 0 and "+100.0 % against the first" in capsys.readouterr().out
    assert len(json.loads((tmp_path / "c" / "compare.json").read_text())["peaks"]) == 4
    assert "plotly" in (tmp_path / "c" / "report.html").read_text().lower()
    for arguments in (given, [given[0]], [given[0], given[0], "--out", str(tmp_path / "d")]):
        with pytest.raises(SystemExit) as end:
            main(["compare", *arguments])
        assert end.value.code == 2
    assert not (tmp_path / "d").exists()


def test_a_folder_of_a_run_stands_for_the_record_in_it(tmp_path, capsys):
    for name, size in (("before", 1e-6), ("after", 2e-6)):
        (tmp_path / name).mkdir()
        save(vectors(size), tmp_path / name / "runup.nc")
        (tmp_path / name / "report.html").touch()
    given = [str(tmp_path / "before"), str(tmp_path / "after"), "--no-report", "--out", str(tmp_path / "c")]
    with pytest.raises(SystemExit) as end:
        main(["compare", *given])
    out = capsys.readouterr().out
    assert end.value.code == 0 and "after, x: " in out and "+100.0 % against the first" in out
    save(vectors(1e-6), tmp_path / "after" / "again.nc")
    with pytest.raises(SystemExit) as end:
        main(["compare", *given, "--force"])
    assert end.value.code == 2 and "again.nc, runup.nc" in capsys.readouterr().err


def turned(lag, critical=CRITICAL):
    """Vectors about 1 um whose phase lag [deg] is `lag` plus that of a resonance, over speeds up to the peak."""
    speed = np.linspace(50, 150, 101)
    a = response(speed, 1e-6, critical) * np.exp(-1j * np.radians(lag))
    return make_vectors(speed, np.abs(a)[:, None, None], -np.angle(a)[:, None, None], (1,), axes=("x",))


def test_phases_a_degree_apart_are_drawn_a_degree_apart():
    """Lags whose medians lie on both sides of 270 deg were drawn a turn apart."""
    lags = -np.degrees(np.unwrap(np.angle(response(np.linspace(50, 150, 101), 1.0))))
    shift = 269.5 - np.median(lags)
    figure = overlay(compare_runs({"a": turned(shift), "b": turned(shift + 1.0)}))
    first, other = (np.asarray(t.y, float) for t in figure.data if t.yaxis == "y2")
    np.testing.assert_allclose(other - first, 1.0, atol=1e-3)
    found = compare_runs({"a": turned(shift), "b": turned(shift + 1.0)}).peaks()
    assert found[1]["phase_lag_deg"] - found[0]["phase_lag_deg"] == pytest.approx(1.0, abs=1e-6)


def test_a_peak_at_the_end_of_a_run_is_stated(tmp_path, capsys):
    for name in "ab":
        save(turned(0.0), tmp_path / f"{name}.nc")
    with pytest.raises(SystemExit):
        main(["compare", str(tmp_path / "a.nc"), str(tmp_path / "b.nc"), "--no-report", "--out", str(tmp_path / "c")])
    assert "rpm at an end of the tracked speeds, +0.0 % against the first" in capsys.readouterr().out


def command(*words):
    with pytest.raises(SystemExit) as end:
        main(["compare", *map(str, words)])
    return end.value.code


def test_a_mapping_is_read_whatever_the_files(tmp_path, capsys):
    """One that is not there is refused; of one with columns only the conditions hold for a record."""
    for name in "ab":
        save(vectors(1e-6), tmp_path / f"{name}.nc")
    pair, rest = [tmp_path / "a.nc", tmp_path / "b.nc"], ["--no-report", "--out", tmp_path / "c"]
    assert command(*pair, "--mapping", tmp_path / "none.toml", *rest) == 2
    assert "none.toml" in capsys.readouterr().err and not (tmp_path / "c").exists()
    (tmp_path / "slow.toml").write_text('[slow_roll]\nbelow = "60 rad/s"\n')
    assert command(*pair, "--mapping", tmp_path / "slow.toml", *rest) == 0
    subtracted = json.loads((tmp_path / "c" / "compare.json").read_text())["peaks"][0]["um"]
    assert subtracted != pytest.approx(
        compare_runs({"a": vectors(1e-6), "b": vectors(1e-6)}).peaks()[0]["um"], rel=1e-4
    )
    save(vectors(1e-6), tmp_path / "m.csv")
    text = (tmp_path / "m.csv").read_text()
    (tmp_path / "m.csv").write_text(text.replace("amplitude_1X_x", "mine"))
    (tmp_path / "rig.toml").write_text(
        "[speed]\ncolumn = 'speed'\nunit = 'rad/s'\n[vectors.1X.x]\n"
        "amplitude = {column = 'mine', unit = 'm'}\nphase = {column = 'phase_1X_x', unit = 'rad'}\n"
    )
    assert command(*pair, "--mapping", tmp_path / "rig.toml", "--force", *rest) == 2
    assert "a netCDF record describes itself" in capsys.readouterr().err
    assert command(pair[0], tmp_path / "m.csv", "--mapping", tmp_path / "rig.toml", "--force", *rest) == 0


@pytest.mark.parametrize("runs", [[vectors(1e-6), vectors(2e-6)], vectors(1e-6)])
def test_runs_without_names_are_refused(runs):
    with pytest.raises(DataError, match=r"runs: a (list|Dataset)"):
        compare_runs(runs)


def test_names_in_the_page_are_text(tmp_path):
    found = compare_runs({"<b>": vectors(1e-6), "b": vectors(1e-6)})
    assert "<h1><b>" not in write(found, tmp_path / "p.html").read_text()
