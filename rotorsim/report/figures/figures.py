"""Single figures of a record for notebooks: Dataset in, plotly figure out.

Each function raises DataError with a sentence where the record holds nothing for its figure. They are also at hand as
`rotorsim.report.waterfall` and so on.
"""

from __future__ import annotations

import plotly.graph_objects as go
import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.report.pages import sections
from rotorsim.report.pages.run import analyse
from rotorsim.signals.record_blocks import MissingError


def _figure(record: xr.Dataset, section: sections.Section) -> go.Figure:
    run = analyse(record)
    try:
        return section.draw(run, section.find(run))
    except MissingError as missing:
        raise DataError(f"record: no figure '{section.title}': {missing}") from missing


def bode(record: xr.Dataset) -> go.Figure:
    """Amplitude [um 0-pk] and phase lag [deg] of 1X, 2X, 3X against speed [rpm]; against time at constant speed.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.bode(runup)
    """
    return _figure(record, sections.BODE)


def waterfall(record: xr.Dataset) -> go.Figure:
    """Amplitude spectra [um 0-pk] of disc x and y against speed [rpm] or time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.waterfall(runup)
    """
    return _figure(record, sections.WATERFALL)


def full_spectrum(record: xr.Dataset) -> go.Figure:
    """Spectra [um 0-pk] of x + i y, forward above and backward below zero, against speed [rpm] or time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.full_spectrum(runup)
    """
    return _figure(record, sections.FULL)


def orbits(record: xr.Dataset) -> go.Figure:
    """Orbits of disc and journal [um] at the resonances and at the end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.orbits(runup)
    """
    return _figure(record, sections.ORBITS)


def probe_orbits(record: xr.Dataset) -> go.Figure:
    """Orbits [um] at each plane where two displacement probes see x and y, at the resonances and at the end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.runup("probes.toml", stop=300.0)  # doctest: +SKIP
    >>> figure = rs.report.probe_orbits(record)  # doctest: +SKIP
    """
    return _figure(record, sections.PLANES)


def probe_readings(record: xr.Dataset) -> go.Figure:
    """Envelopes of the readings of all probes against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.runup("probes.toml", stop=300.0)  # doctest: +SKIP
    >>> figure = rs.report.probe_readings(record)  # doctest: +SKIP
    """
    return _figure(record, sections.READ)


def against_time(record: xr.Dataset) -> go.Figure:
    """Envelopes of speed [rpm], disc [um], film [um], flow [mg/s] and pressure [MPa] against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.against_time(record)
    """
    return _figure(record, sections.OVERVIEW)


def excitation(record: xr.Dataset) -> go.Figure:
    """Reference [V], force [N], pins [um] and disc [um] against time [s]: the whole record and a stretch of it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.excitation(record)
    """
    return _figure(record, sections.EXCITATION)


def frequency_response(record: xr.Dataset) -> go.Figure:
    """Response of the disc to the reference [um/V], or to impacts [um/N] where the reference rests.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.frequency_response(record)
    """
    driven = analyse(record).driven
    return _figure(
        record, sections.PER_NEWTON if "reference" not in driven and "disc_force" in driven else sections.PER_VOLT
    )


def ring_down(record: xr.Dataset) -> go.Figure:
    """Force pulse [N] and ring-down of the disc [um] after impacts, with the fitted decay.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.ring_down(impact)
    """
    return _figure(record, sections.RING_DOWN)


def static_gain(record: xr.Dataset) -> go.Figure:
    """Rests of the disc [um] over the reference [V] of a staircase, with line and deviations.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steps = rs.experiments.staircase(plant, pressure=0.5e6, axis="x", step=1.0, hold=0.2)
    >>> figure = rs.report.static_gain(steps)
    """
    return _figure(record, sections.GAIN)


def hysteresis_loops(record: xr.Dataset) -> go.Figure:
    """Rests of the pins [um] over the reference [V] of a staircase.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steps = rs.experiments.staircase(plant, pressure=0.5e6, axis="x", step=1.0, hold=0.2)
    >>> figure = rs.report.hysteresis_loops(steps)
    """
    return _figure(record, sections.LOOPS)


def spectra(record: xr.Dataset) -> go.Figure:
    """Averaged spectra [um 0-pk] of x, y and x + i y at constant speed, with the orders marked.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.spectra(record)
    """
    return _figure(record, sections.SPECTRUM)


def filtered_orbits(record: xr.Dataset) -> go.Figure:
    """Orbit [um] at constant speed, raw and its parts at 1X and 2X.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.filtered_orbits(turning)
    """
    return _figure(record, sections.FILTERED)


def runout_profile(record: xr.Dataset) -> go.Figure:
    """Runout [um] over the shaft angle [deg] of a slow roll, and its harmonics.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=60.0, pressure=0.5e6, revolutions=2)
    >>> figure = rs.report.runout_profile(slow)
    """
    return _figure(record, sections.RUNOUT)


def sensor_noise(record: xr.Dataset) -> go.Figure:
    """Spectrum [um 0-pk] of measured less true displacement.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.sensor_noise(record)
    """
    return _figure(record, sections.SENSORS)


def deceleration_curve(record: xr.Dataset) -> go.Figure:
    """Speed [rpm] and deceleration [rpm/s] of a coast-down against time [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> down = rs.experiments.coastdown(plant, start=300.0, stop=280.0, rate=100.0, pressure=0.5e6)
    >>> figure = rs.report.deceleration_curve(down)
    """
    return _figure(record, sections.COAST)


def film_pressure(record: xr.Dataset) -> go.Figure:
    """Film pressure [MPa absolute] over angle and length at the snapshots of a run.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steady = rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1)
    >>> outcome = rs.record(plant, steady, "film.nc")
    >>> figure = rs.report.film_pressure(rs.open_record("film.nc"))
    """
    return _figure(record, sections.FILM_MAPS)
