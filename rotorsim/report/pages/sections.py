"""Catalogue of report sections: data, figure and caption of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rotorsim.report.figures import bode_waterfall_plots, film3d, orbit_plots, time_plots
from rotorsim.report.figures.decay_plots import ring_down_figure
from rotorsim.report.figures.excitation_plots import excitation_figure
from rotorsim.report.figures.gain_plots import gain_figure, loop_figure
from rotorsim.report.figures.probes import probe_plots
from rotorsim.report.figures.probes.filtered_orbit_plots import filtered_orbits
from rotorsim.report.figures.probes.runout_plots import runout_figure
from rotorsim.report.figures.spectrum_plots import difference_figure, spectrum_figure
from rotorsim.report.figures.speed_plots import deceleration_figure
from rotorsim.report.figures.transfer_plots import transfer_figure
from rotorsim.report.pages.run import Run
from rotorsim.report.text import captions as c, experiment_captions as e
from rotorsim.signals import impact
from rotorsim.signals.frequency_response import Transfer, welch_transfer
from rotorsim.signals.orders import deceleration_of
from rotorsim.signals.probes import READINGS, probe_planes, runout_of
from rotorsim.signals.record_blocks import displacement_name, need, sampling_time
from rotorsim.signals.spectra import difference_of, spectrum_of
from rotorsim.signals.static_gain import loops, static_gain

RESPONSE_REACH = 500.0
"""Highest frequency [Hz] of a frequency response."""
SHORTEST = 0.5
"""A waterfall takes so many seconds, for two spectra."""


@dataclass(frozen=True)
class Section:
    """A figure of the report: its title, `find` makes what it shows or raises, `draw` and `caption` use it."""

    title: str
    find: Callable[[Run], Any]
    draw: Callable[[Run, Any], go.Figure]
    caption: Callable[[Run, Any], str]


def _simple(
    title: str, check: Callable[[Run], Any], draw: Callable[[Run], go.Figure], caption: Callable[[Run], str]
) -> Section:
    """A section whose figure and caption need nothing but the run."""
    return Section(title, check, lambda run, _: draw(run), lambda run, _: caption(run))


def _orders(run: Run) -> None:
    _moving(run)
    run.need_turning()
    reason = f"The shaft turns {run.revolutions:.2g} revolutions; orders are fitted over 8 within 0.25 to 30 s."
    need(run.tracked.sizes["window"] > 0, reason)


def _moving(run: Run) -> None:
    d = run.record[displacement_name(run.record)]
    need(bool(np.ptp(d.isel(time=slice(0, 50_000)).values, axis=0).any() or run.summary["largest_orbit"]["um"] > 0),
         "The disc does not move.")  # fmt: skip


def _spectra(run: Run) -> None:
    seconds = run.record.sizes["time"] * sampling_time(run.record)
    need(seconds >= SHORTEST, f"The record of {seconds:.2g} s is too short for spectra that follow the time.")
    _moving(run)


def _turns(run: Run) -> None:
    run.need_turning()
    _moving(run)


def _steady(run: Run) -> None:
    need(not run.swept, "The speed changes.")
    _orders(run)


def _film(run: Run) -> None:
    need(run.has_snapshots, "The record holds no film pressures.")


def _steady_spectrum(run: Run) -> Any:
    need(not run.swept, "The speed changes; see the waterfall.")
    _moving(run)
    return spectrum_of(run.record, run.output, run.highest_frequency)


def _per_volt(run: Run) -> Transfer:
    need("reference" in run.record, "The record has no reference of the actuators.")
    need("reference" in run.driven, "The reference of the actuators does not change.")
    return welch_transfer(run.record, run.driven["reference"], "reference", run.output, _reach(run))


def _per_newton(run: Run) -> Transfer:
    return impact.impact_transfer(run.record, run.output, _reach(run))


def _reach(run: Run) -> float:
    return min(RESPONSE_REACH, 0.4 / sampling_time(run.record))


def _gain(run: Run) -> Any:
    return static_gain(run.holds)


def _loops(run: Run) -> Any:
    need("pin" in run.record, "The record has no pin positions.")
    found = loops(run.holds, static_gain(run.holds))
    need(bool(found), "The pins do not move.")
    return found


def _runout(run: Run) -> Any:
    run.need_turning()
    return runout_of(run.record, run.output, run.revolutions)


def _turning(run: Run) -> float:
    """1X [Hz] to be marked; 0 where it is unknown or changes."""
    return 0.0 if run.swept else abs(run.mean_speed) / (2 * np.pi)


def _planes(run: Run) -> list[tuple[str, ...]]:
    _turns(run)
    planes = probe_planes(run.record)
    need(bool(planes), "No two displacement probes of one plane see x and y.")
    return planes


def _readings(run: Run) -> None:
    need(READINGS in run.record, "The record holds no readings of probes.")


def _excitation(run: Run) -> None:
    need(bool(run.driven) or run.kind == "controlled", "Neither reference nor force changes.")


COAST = Section("Speed and deceleration", lambda r: deceleration_of(r.record), lambda _, d: deceleration_figure(d),
                e.deceleration_caption)  # fmt: skip
BODE = _simple("Amplitude and phase of the orders", _orders, bode_waterfall_plots.bode, c.bode_caption)
WATERFALL = _simple("Waterfall", _spectra, bode_waterfall_plots.waterfall_map, c.waterfall_caption)
FULL = _simple("Forward and backward whirl", _spectra, bode_waterfall_plots.full_spectrum_map, c.full_spectrum_caption)
ORBITS = _simple("Orbits", _turns, orbit_plots.orbits, c.orbits_caption)
PLANES = Section("Orbits at the planes of the probes", _planes, probe_plots.plane_orbits, c.planes_caption)
READ = _simple("Readings of the probes", _readings, probe_plots.probe_readings, c.readings_caption)
OVERVIEW = _simple("The run against time", lambda _: None, time_plots.overview, c.overview_caption)
FILM_MAPS = _simple("Film pressure, unrolled", _film, film3d.film_maps, c.film_caption)
FILM_ROUND = _simple("Film pressure round the journal", _film, film3d.film_surface, c.surface_caption)
EXCITATION = _simple("Excitation and response", _excitation, excitation_figure, e.excitation_caption)
GAIN = Section("Static gain", _gain, lambda _, d: gain_figure(d), e.gain_caption)
LOOPS = Section("Hysteresis of the actuators", _loops, lambda _, d: loop_figure(d), e.loop_caption)
PER_VOLT = Section("Frequency response of the disc to the reference", _per_volt, lambda _, d: transfer_figure(d),
                   e.transfer_caption)  # fmt: skip
PER_NEWTON = Section("Frequency response of the disc to the force", _per_newton, lambda _, d: transfer_figure(d),
                     e.transfer_caption)  # fmt: skip
RING_DOWN = Section("Impact and ring-down", lambda r: impact.ring_downs(r.record, r.output),
                    lambda _, d: ring_down_figure(d), e.ring_down_caption)  # fmt: skip
SPECTRUM = Section("Spectra", _steady_spectrum, lambda r, d: spectrum_figure(d, _turning(r)), e.spectrum_caption)
FILTERED = _simple("Orbit, and its parts at 1X and 2X", _steady, filtered_orbits, e.filtered_caption)
RUNOUT = Section("Runout", _runout, lambda _, d: runout_figure(d), e.runout_caption)
SENSORS = Section("Measured against true displacement", lambda r: difference_of(r.record, r.highest_frequency),
                  lambda r, d: difference_figure(d, _turning(r)), e.difference_caption)  # fmt: skip
