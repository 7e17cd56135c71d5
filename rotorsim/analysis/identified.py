"""Figures as a campaign measures them: identified in simulated records, with pins as their sensors read them.

A pair of pins is the thesis' model of actuators (two real poles and a gain by axis, Table C.2), its fit that of another
record. A delay is that of Model 2 behind the pins' readings, so a sensor's lag counts to the pins and not to the film.

Cites: thesis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification import Prefilter, filtered, fit_of, identify
from identification.local.fits import actuator_signals
from identification.local.greybox import actuator_poles
from rotorsim.base.errors import DataError
from rotorsim.experiments import prbs, steady

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant import Plant

RECIPE = Prefilter(median=3)
"""The thesis' prefilter: a running median of three."""
DURATION = 2.0
"""Duration [s] of each record, with and without excitation."""


def pin_figures(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """Poles [rad/s], gain and fit of the pairs of pins as read, at a speed [rad/s] and gauge pressure [Pa].

    Raises
    ------
    DataError
        If the machine has no actuators whose pins could be read.
    """
    first, second = (_record(plant, speed, pressure, number) for number in (1, 2))
    found = identify(first, "actuator", settings=RECIPE)
    assert plant.machine.actuators is not None
    poles, gain = actuator_poles(found.theta), np.diag(found.static_gain) / plant.machine.actuators.sensor_sensitivity
    fit = fit_of(found.model, actuator_signals(filtered(second, None, RECIPE)))
    columns = {"pole_slow": poles[:, 0], "pole_fast": poles[:, 1], "pin_gain": gain, "pin_fit": fit}
    return {f"{name}_{axis}": float(values[k]) for name, values in columns.items() for k, axis in enumerate("xy")}


def read_delays(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """Delay [s] by axis that Model 2 finds behind the pins as read, at a speed [rad/s] and gauge pressure [Pa].

    Raises
    ------
    DataError
        If the machine has no actuators whose pins could be read.
    """
    excited = _record(plant, speed, pressure, 1)
    quiet = steady(plant, speed, pressure, duration=DURATION) if speed else None
    found = identify(excited, "2", steady=quiet, settings=RECIPE, dead_time=0.0)
    return {f"delay_read_{axis}": float(found.delay[k]) for k, axis in enumerate("xy")}


def _record(plant: Plant, speed: float, pressure: float, number: int) -> xr.Dataset:
    if plant.machine.actuators is None:
        raise DataError(f"{plant.machine.name}: has no actuators whose pins could be read; take a machine that has")
    return prbs(plant, speed, pressure, amplitude=1.0, duration=DURATION, sequence=number)
