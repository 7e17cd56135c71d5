"""Records in, figures and pages out; the only place that knows a plot library.

`write_report(record_path, html_path)` makes a page of any record; `waterfall(record)`, `bode(record)`,
`frequency_response(record)` and so on make single plotly figures, see `rotorsim.report.figures`; `shaft_campbell`,
`critical_speed_map`, `unbalance_response` and `sag` draw the `.dataset()` of results of `fe_shaft`. Names are imported
when they are first used, and plotly with them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.report.experiment import write_report
    from rotorsim.report.figures import (
        against_time,
        bode,
        deceleration_curve,
        excitation,
        film_pressure,
        filtered_orbits,
        frequency_response,
        full_spectrum,
        hysteresis_loops,
        orbits,
        ring_down,
        runout_profile,
        sensor_noise,
        spectra,
        static_gain,
        waterfall,
    )
    from rotorsim.report.image import save_png
    from rotorsim.report.shaft_plots import critical_speed_map, sag, shaft_campbell, unbalance_response

__all__ = [
    "against_time",
    "bode",
    "critical_speed_map",
    "deceleration_curve",
    "excitation",
    "film_pressure",
    "filtered_orbits",
    "frequency_response",
    "full_spectrum",
    "hysteresis_loops",
    "orbits",
    "ring_down",
    "runout_profile",
    "sag",
    "save_png",
    "sensor_noise",
    "shaft_campbell",
    "spectra",
    "static_gain",
    "unbalance_response",
    "waterfall",
    "write_report",
]
_SHAFT = ("critical_speed_map", "sag", "shaft_campbell", "unbalance_response")
_HOMES = {"write_report": "experiment", "save_png": "image"} | dict.fromkeys(_SHAFT, "shaft_plots")


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'rotorsim.report' has no attribute {name!r}")
    value = getattr(import_module(f"rotorsim.report.{_HOMES.get(name, 'figures')}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
