"""HTML report of a run: self-contained, escaped, from any record of the schema."""

import re
import subprocess
import sys
from pathlib import Path
from runpy import run_path

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr

import rotorsim as rs
from identification import make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError
from rotorsim.machine import machine_text
from rotorsim.report.figure_files import figures_of, save_png
from rotorsim.report.orbit import instants
from rotorsim.report.page import compact, phase_lag, write
from rotorsim.report.record import write_report
from rotorsim.report.run import analyse
from rotorsim.signals.record_blocks import envelopes

EVIL = 'name = "<script>alert(1)</script>"\ndescription = "a & b </pre><img src=x onerror=alert(2)>"\n'


def run_up(film: bool = True, machine: str = "", fastest: float = 80.0, duration: float = 6.0) -> xr.Dataset:
    """A record of a resonance at 40 Hz, with a touch near the end if there is a film."""
    time = np.arange(0, duration, 2e-4)
    f = fastest * time / duration
    angle = 2 * np.pi * fastest * time**2 / (2 * duration)
    size = 1e-6 / np.hypot(1 - (f / 40) ** 2, 0.2 * f / 40)
    disc = size[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
    values = {"disc": disc, "angle": angle, "speed": 2 * np.pi * f}
    if film:
        h = 10e-6 - size
        values |= {"journal": disc / 2, "h_min": h, "contact": (time > duration - 0.1).astype(float)}
        values |= {"mass_flow": np.full(time.size, 4e-5), "pressure": np.full(time.size, 3e5)}
    record = make_record(time, values, {"machine": machine, "seed": 3, "ended": "complete"})
    return with_snapshots(record) if film else record


def with_snapshots(record: xr.Dataset) -> xr.Dataset:
    theta, z = np.arange(0, 2 * np.pi, np.pi / 8), np.linspace(-0.01, 0.01, 6)
    p = 2e5 + 1e5 * np.cos(theta[:, None] - 1) * np.cos(z * 100) * np.array([0.5, 1.0])[:, None, None]
    return record.assign(
        film_pressure=(("snapshot", "theta", "z"), p),
        snapshot_time=("snapshot", [0.0, 6.0]),
        snapshot_speed=("snapshot", [0.0, 500.0]),
    ).assign_coords(theta=theta, z=z)


def report_of(record: xr.Dataset, folder: Path) -> str:
    record.to_netcdf(folder / "run.nc", engine="h5netcdf")
    write_report(folder / "run.nc", folder / "run.html")
    assert sorted(p.name for p in folder.iterdir()) == ["run.html", "run.nc"]
    return (folder / "run.html").read_text(encoding="utf-8")


def without_scripts(html: str) -> str:
    return re.sub(r"<script\b.*?</script>", "", html, flags=re.DOTALL)


def test_the_report_is_one_small_file_that_asks_the_network_for_nothing(tmp_path: Path) -> None:
    html = report_of(run_up(machine=machine_text("dtu_gas_bearing")), tmp_path)
    assert len(html) < 8e6
    assert not re.search(r"(src|href)\s*=\s*[\"']?(https?:)?//", without_scripts(html))
    assert not re.search(r"<script[^>]*\ssrc=", html)
    assert "default-src 'none'" in html
    assert html.count("plotly.js v") == 1
    assert len(figures_of(tmp_path / "run.html")) >= 7


def test_the_report_states_what_the_data_show(tmp_path: Path) -> None:
    text = without_scripts(report_of(run_up(machine=machine_text("dtu_gas_bearing")), tmp_path))
    assert "<h1>dtu_gas_bearing</h1>" in text
    assert "first at 5.90 s" in text
    found = re.search(r"1X peaks at (\d+) rpm", text)
    assert found and float(found[1]) == pytest.approx(2400, rel=0.06)
    assert "marked calibrated were fitted" in text
    assert "seat_gap" in text


def test_text_of_the_record_is_escaped(tmp_path: Path) -> None:
    record = run_up(film=False, machine=EVIL)
    record.attrs["ended"] = "<script>alert(3)</script>"
    html = report_of(record, tmp_path)
    assert "<script>alert" not in html and "<img src=x" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html


@pytest.mark.parametrize("record", [
    pytest.param(run_up(film=False), id="no film"),
    pytest.param(run_up(film=False, fastest=0.0, duration=1.0), id="standstill"),
    pytest.param(run_up(film=True, duration=0.02), id="short"),
    pytest.param(run_up().isel(time=slice(20000, 20002)), id="two samples"),
])  # fmt: skip
def test_records_with_little_in_them_still_make_a_report(record: xr.Dataset, tmp_path: Path) -> None:
    assert "<h1>Unnamed machine</h1>" in report_of(record, tmp_path)


def test_a_constant_speed_is_drawn_against_time(tmp_path: Path) -> None:
    record = run_up(film=False)
    t = record["time"].values
    angle = 2 * np.pi * 50 * t
    disc = np.column_stack((np.cos(angle), np.sin(angle))) * 1e-6
    record = make_record(t, {"disc": disc, "angle": angle, "speed": np.full(t.size, 2 * np.pi * 50)})
    run = analyse(record)
    assert run.abscissa(run.tracked)[1] == "time [s]"
    assert "1X is at most" in report_of(record, tmp_path)


def test_an_unwritable_place_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    run_up(film=False).to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with pytest.raises(WriteError, match="its folder is not there"):
        write_report(tmp_path / "run.nc", tmp_path / "no" / "run.html")


def test_envelopes_hold_every_value_and_do_not_depend_on_blocks() -> None:
    record = run_up()
    data = envelopes(record, ["h_min", "disc"], bins=50)
    assert data["disc"].most.shape == (50, 2)
    assert data["h_min"].least.min() == pytest.approx(float(record["h_min"].min()))
    np.testing.assert_allclose(data["disc"].most.max(axis=0), record["disc"].max("time"))


def test_phase_lag_is_continuous_through_a_resonance() -> None:
    f = np.linspace(0.1, 3, 200)
    lag = phase_lag(1 / (1 - f**2 + 0.1j * f))
    assert np.all(np.diff(lag) > 0)
    turning = phase_lag(np.exp(5j * f**3))
    assert np.nanmax(turning) - np.nanmin(turning) <= 360
    assert np.nanmax(np.abs(np.diff(turning))) <= 180
    assert lag[0] == pytest.approx(0.6, abs=0.1) and 175 < lag[-1] < 180


def test_orbits_are_shown_at_the_resonance_and_at_the_end() -> None:
    moments = instants(analyse(run_up()))
    assert [m.label for m in moments] == ["1X peak", "end"]
    assert moments[-1].rpm == pytest.approx(4800, rel=1e-3)


def test_compact_values_keep_five_digits() -> None:
    values = np.array([0.0, 1.2345678, -98765.4321, np.nan])
    np.testing.assert_allclose(compact(values), [0, 1.2346, -98765, np.nan], rtol=1e-6)


def test_the_readme_picture_shows_three_orders_next_to_the_waterfall() -> None:
    where = Path(__file__).parents[2] / "docs" / "runup_figure.py"
    figure = run_path(str(where))["runup_figure"](run_up())
    assert [t.name for t in figure.data[:3]] == ["1X", "2X", "3X"]
    assert figure.data[3].type == "heatmap"


def test_a_picture_without_a_browser_names_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BROWSER_PATH", str(tmp_path / "none"))
    with pytest.raises(DataError, match=r"a\.png: there is no Chrome, Chromium or Edge .*; install one or set"):
        save_png(go.Figure(), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_importing_rotorsim_does_not_import_a_plot_library() -> None:
    code = "import sys, rotorsim; sys.exit(any(m in sys.modules for m in ('plotly', 'matplotlib')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("result", [xr.DataArray(0.0), None, "run.nc"])
def test_a_report_of_anything_but_a_result_is_refused_with_the_types_it_takes(result, tmp_path):
    with refused(DataError, "report", type(result).__name__):
        write(result, tmp_path / "report.html")
    with pytest.raises(DataError, match=r"^record: neither .disc. nor"):
        write(xr.Dataset(), tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


def test_a_record_in_memory_makes_the_page_of_its_file(tmp_path):
    made = rs.experiments.steady("plain_rotor", duration=0.1)
    made.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    write_report(tmp_path / "run.nc", tmp_path / "file.html")
    write_report(made, tmp_path / "memory.html")
    write(made, tmp_path / "write.html")
    pages = [(tmp_path / f"{name}.html").read_text() for name in ("file", "memory", "write")]
    assert len(set(pages)) == 1
