"""Reports of every kind of record: figures shown, reasons for missing ones, bounded memory."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

import rotorsim.report as report
from identification import make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import EXPERIMENTS
from rotorsim.report.page import html
from rotorsim.report.record import made_sections, provenance, record_page, write_report
from rotorsim.report.run import SECTIONS, analyse
from rotorsim.signals.record_blocks import MissingError

DT = 5e-4
EVIL = "</script><script>alert(1)</script>"


def disc_of(u: np.ndarray) -> np.ndarray:
    """Motion [m] of an oscillator of 60 Hz per axis, driven by u (n, 2)."""
    t = np.arange(800) * DT
    h = 2e-7 * np.exp(-20 * t) * np.sin(2 * np.pi * 60 * t)
    return np.column_stack([np.convolve(u[:, k], h)[: len(u)] for k in (0, 1)])


def record(kind: str, speed: float = 0.0, seconds: float = 6.0, **inputs: np.ndarray) -> xr.Dataset:
    """A record with sensors of a disc at a shaft speed [Hz], driven by inputs (n, 2)."""
    rng, t = np.random.default_rng(1), np.arange(round(seconds / DT)) * DT
    f = {"runup": speed * t / seconds, "coastdown": speed * np.exp(-t / seconds)}.get(kind, np.full(t.size, speed))
    angle = 2 * np.pi * np.cumsum(f) * DT
    turn = np.column_stack((np.cos(angle), np.sin(angle))) * (f > 0)[:, None]
    disc = 1e-6 * turn + sum((disc_of(u) for u in inputs.values()), np.zeros((t.size, 2)))
    runout = 5e-7 * np.column_stack((np.cos(2 * angle), np.sin(3 * angle)))
    values = {"disc": disc, "disc_measured": disc + runout + 2e-8 * rng.standard_normal(disc.shape),
              "angle": angle, "speed": 2 * np.pi * f, "pressure": np.full(t.size, 5e5), **inputs}  # fmt: skip
    if "reference" in inputs:
        values["pin"] = 2e-5 + 4e-6 * inputs["reference"]
    return make_record(t, values, {"experiment": kind} if kind else {})


def steps() -> np.ndarray:
    levels = np.repeat(np.concatenate((np.arange(4), np.arange(2, -4, -1), np.arange(-2, 1))), 460).astype(float)
    levels = np.append(levels, np.zeros(6000 - levels.size))
    return np.vstack((np.column_stack((levels, 0 * levels)), np.column_stack((0 * levels, levels))))


def noise() -> np.ndarray:
    return np.random.default_rng(2).choice([-1.0, 1.0], (12000, 2))


def hits() -> np.ndarray:
    force = np.zeros((12000, 2))
    for k in range(6):
        force[2000 * k + 700 : 2000 * k + 706, k // 3] = 20
    return force


SAMPLES: dict[str, Callable[[], xr.Dataset]] = {
    "runup": lambda: record("runup", 90.0),
    "coastdown": lambda: record("coastdown", 90.0),
    "staircase": lambda: record("staircase", reference=steps()),
    "prbs": lambda: record("prbs", 40.0, reference=noise()),
    "chirp": lambda: record("chirp", reference=noise()),
    "multisine": lambda: record("multisine", reference=noise()),
    "impact": lambda: record("impact", 40.0, disc_force=hits()),
    "steady": lambda: record("steady", 50.0),
    "slow_roll": lambda: record("slow_roll", 1.0),
    "controlled": lambda: record("controlled", 50.0, reference=0.1 * noise(), disc_force=hits()),
}


def shown(data: xr.Dataset) -> dict[str, Any]:
    """Title and figure of every section of a report that is made, and None or the reason of every other."""
    run = analyse(data)
    return {f.section.title: f.section.draw(run, f.data) if f.why is None else f.why for f in made_sections(run)}


def page(data: xr.Dataset) -> str:
    return html(record_page(data))


def assert_not_empty(figure: go.Figure, title: str) -> None:
    """The first trace shows something, and so do most: only the phase of an absent order may be blank."""
    full = [_finite(trace) >= 2 for trace in figure.data if not (trace.type == "scatter" and trace.mode == "markers")]
    full = full or [_finite(trace) >= 2 for trace in figure.data]
    assert full and full[0] and np.mean(full) >= 0.5, title


def _finite(trace: Any) -> int:
    values = trace.z if trace.type in ("heatmap", "surface") else trace.y
    return int(np.isfinite(np.asarray(values, float)).sum())


@pytest.mark.parametrize("kind", sorted(SAMPLES))
def test_each_experiment_gets_its_figures_and_none_is_empty(kind: str) -> None:
    made = shown(SAMPLES[kind]())
    for title in (SECTIONS[name].title for name in EXPERIMENTS[kind].figures):
        assert isinstance(made[title], go.Figure), (title, made[title])
    assert isinstance(made["Measured against true displacement"], go.Figure)
    for title, figure in made.items():
        if isinstance(figure, go.Figure):
            assert_not_empty(figure, title)


@pytest.mark.parametrize("kind", sorted(EXPERIMENTS))
@pytest.mark.parametrize(("speed", "seconds"), [(0.0, 2.0), (0.0, 0.01), (50.0, 0.01), (50.0, 0.15)])
def test_short_and_standing_records_have_reasons_instead_of_empty_figures(
    kind: str, speed: float, seconds: float
) -> None:
    made = shown(record(kind, speed, seconds))
    for title, figure in made.items():
        if isinstance(figure, go.Figure):
            assert_not_empty(figure, title)
    for title in (SECTIONS[name].title for name in EXPERIMENTS[kind].figures):
        assert isinstance(made[title], go.Figure) or made[title].endswith("."), title


def test_the_page_states_why_a_figure_is_missing() -> None:
    text = page(record("runup", 0.0, 2.0))
    assert "Not shown" in text and "The shaft stands still." in text
    assert "Not shown" not in page(SAMPLES["runup"]())


def test_the_page_shows_gain_and_ring_down_in_words() -> None:
    assert "Reference x moves the disc by" in page(SAMPLES["staircase"]())
    rings = re.search(r"Along x the disc rings at ([\d.]+) Hz", page(SAMPLES["impact"]()))
    assert rings and float(rings[1]) == pytest.approx(60, rel=0.01)


def test_a_record_of_nothing_but_the_measured_disc_makes_a_report(tmp_path: Path) -> None:
    record("", 50.0)[["disc_measured"]].to_netcdf(tmp_path / "rig.nc", engine="h5netcdf")
    write_report(tmp_path / "rig.nc", tmp_path / "rig.html")
    text = (tmp_path / "rig.html").read_text(encoding="utf-8")
    for title in ("Waterfall", "Forward and backward whirl", "Spectra", "The run against time"):
        assert f"<h2>{title}</h2>" in text
    assert "The record holds no shaft angle" in text and "This is a simulation" not in text and " rpm" not in text


def test_a_measured_angle_is_enough_for_orders() -> None:
    data = record("runup", 90.0)
    made = shown(data[["disc_measured", "angle"]].rename(angle="angle_measured").assign_attrs(data.attrs))
    assert isinstance(made["Amplitude and phase of the orders"], go.Figure)
    assert made["Waterfall"].layout.xaxis.title.text == "shaft speed [rpm]"


def test_a_record_that_does_not_describe_itself_is_judged_by_what_it_holds() -> None:
    made = shown(SAMPLES["staircase"]().drop_attrs())
    assert isinstance(made["Static gain"], go.Figure)
    assert "Frequency response of the disc to the reference" not in made
    made = shown(SAMPLES["prbs"]().drop_attrs())
    assert isinstance(made["Frequency response of the disc to the reference"], go.Figure)


def test_text_in_attributes_is_escaped() -> None:
    data = record("steady", 50.0, 1.0).assign_attrs(
        experiment=EVIL, machine=f'name = "{EVIL}"', ended=EVIL, operator=EVIL, seed=EVIL
    )
    assert "<script>alert" not in page(data.assign_attrs({EVIL: 1}))


class Tape(BackendArray):
    """An endless signal that is computed where it is read and refuses to be read at once."""

    longest = 0

    def __init__(self, values: Callable[[np.ndarray], np.ndarray], shape: tuple[int, ...]) -> None:
        self.values, self.shape, self.dtype = values, shape, np.dtype(float)

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        rows = np.arange(self.shape[0])[key[0]]
        Tape.longest = max(Tape.longest, np.size(rows))
        return self.values(np.atleast_1d(rows))[(0 if np.ndim(rows) == 0 else slice(None), *key[1:])]


@pytest.mark.parametrize("kind", ["steady", "prbs", "staircase", "impact"])
def test_a_long_record_is_read_in_blocks(kind: str) -> None:
    """Ten minutes; no figure reads more than two of them at once."""
    n, two = 600_000, ("time", "axis")
    phase = lambda i: 2 * np.pi * 20 * i * 1e-3  # noqa: E731
    pair = lambda f: lambda i: np.column_stack((f(i), f(i + 3)))  # noqa: E731
    drive = {"prbs": lambda i: np.sin(1e-3 * i**2 % 7) * (i * 7919 % 13 > 6), "staircase": lambda i: i // 20_000 % 5,
             "impact": lambda i: (i % 20_000 < 5) * 9.0}.get(kind, lambda i: 0.0 * i)  # fmt: skip
    made = {
        "disc_measured": (two, Tape(pair(lambda i: 1e-6 * (np.cos(phase(i)) + drive(i))), (n, 2))),
        "reference" if kind != "impact" else "disc_force": (two, Tape(pair(drive), (n, 2))),
        "angle": (("time",), Tape(phase, (n,))),
        "time": (("time",), Tape(lambda i: i * 1e-3, (n,))),
    }
    lazy = {k: xr.Variable(dims, indexing.LazilyIndexedArray(tape)) for k, (dims, tape) in made.items()}
    data = xr.Dataset(coords=xr.Coordinates({"time": lazy.pop("time")}, indexes={}), attrs={"experiment": kind})
    Tape.longest = 0
    run = analyse(data.assign(lazy))
    for found in made_sections(run):
        if found.why is None:
            found.section.draw(run, found.data)
    assert 0 < Tape.longest <= 120_000


def test_single_figures_are_at_hand_by_name() -> None:
    assert isinstance(report.waterfall(SAMPLES["runup"]()), go.Figure)
    assert isinstance(report.static_gain(SAMPLES["staircase"]()), go.Figure)
    assert report.frequency_response(SAMPLES["impact"]()).layout.yaxis.title.text == "magnitude [µm/N]"
    assert report.frequency_response(SAMPLES["prbs"]()).layout.yaxis.title.text == "magnitude [µm/V]"
    of_runs = set(SECTIONS) & set(report.__all__)
    assert len(of_runs) > 15 and set(SECTIONS) - of_runs == {
        "film_surface", "response_to_force", "response_to_reference"
    }  # fmt: skip
    assert all(f"rs.report.{name}(" in str(getattr(report, name).__doc__) for name in of_runs)
    with refused(DataError, "record", "Static gain"):
        report.static_gain(SAMPLES["runup"]())
    with pytest.raises(AttributeError):
        _ = report.nothing


def test_a_record_without_a_displacement_is_refused() -> None:
    with pytest.raises(DataError, match="give the displacement"):
        report.waterfall(SAMPLES["runup"]()[["speed"]])


def test_naming_reports_does_not_import_a_plot_library() -> None:
    code = "import sys, rotorsim.report, rotorsim.signals.spectra; sys.exit('plotly' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_missing_is_no_error_of_the_user() -> None:
    assert not issubclass(MissingError, DataError)


def test_parameters_of_an_experiment_stand_on_its_page_with_their_units():
    """The page of a closed loop has the parameters of its law and excitations too; numbers of the solver are plain."""
    attrs = {
        "experiment": "controlled", "duration": 0.02, "controller": "ProportionalLaw", "gain_x": 0.25e6,
        "centre_x": 1e-6,
        "excitation_1_experiment": "impact", "excitation_1_peak": 20.0, "excitation_1_angle": np.pi / 2,
        "excitation_1_hits": 1, "excitation_1_width": np.float64(1e-3), "speed": 3000 * np.pi / 30, "iterations": 803.0,
    }  # fmt: skip
    rows = dict(provenance(SimpleNamespace(record=SimpleNamespace(attrs=attrs))))
    assert rows == {
        "Duration": "20 ms", "Controller": "ProportionalLaw", "Gain x": "250 V/mm", "Centre x": "1 µm",
        "Excitation 1 experiment": "impact", "Excitation 1 peak": "20 N", "Excitation 1 angle": "90 deg",
        "Excitation 1 hits": "1", "Excitation 1 width": "1 ms", "Speed": "3000 rpm", "Iterations": "803",
    }  # fmt: skip
