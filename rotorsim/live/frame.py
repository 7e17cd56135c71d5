"""Display frames and readings of the live page: rounded numbers in engineering units.

A frame is a pure function of the last samples and the film's pressure, so a replay of a record shows the same frames
as the run it was recorded from, number for number. A reading (mode from an impact, eigenvalues) is shown as long as it
is of the plant as it is set; else the reason why there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotorsim.base.rounding import DAMPED
from rotorsim.base.units import MPA, TO_MPA, TO_RPM, TO_UM
from rotorsim.live.modes import DRIFT, RigModes, RingdownReading
from rotorsim.live.rig import LENGTH, Rig
from rotorsim.live.settings import OFF
from rotorsim.machine import Machine
from rotorsim.machine.rotor import reading_unit
from rotorsim.plant.kernels.layout import AT, COLUMNS, DISC, DISC_READ, FILM_COLUMNS, READ, REFERENCE, inputs_of
from rotorsim.plant.simulation import journal_room
from rotorsim.signals.record_blocks import shown_reading

ORBIT = 1000
"""Samples behind an orbit: 0.2 s at 5 kHz."""
TRACE = 2500
"""Samples behind a trace: 0.5 s at 5 kHz."""
SPECTRUM = 5000
"""Samples behind a spectrum: 1 s at 5 kHz."""
POINTS = 500
"""Least number of points of an orbit or a trace."""
HIGHEST = 500
"""Lines of the spectrum; they are 1 Hz apart at 5 kHz."""
SWING = 1000
"""Samples behind the swing, 0.2 s at 5 kHz, where a turn takes no longer."""
SAFE = 0.8
"""Radius of the safety circle as a share of the clearance: 20 um on the shipped rig."""
ROOM = np.linspace(0, 2 * np.pi, 72, endpoint=False)
"""Directions [rad] in which the edge of a journal's room is drawn."""
STANDING = 0.1
"""Speed [rad/s] below which the shaft stands."""
LINE = 2 * np.pi
"""Change of speed [rad/s] by which 1X moves from a line of the spectrum to the next where they are 1 Hz apart."""


@dataclass(frozen=True)
class Geometry:
    """Fixed geometry of the views; lengths in um, angles in deg; `read`: pins have sensors; names and units of the
    probes; samples of Ts [s]; z (films, n_z), name, clearance and room of the journal in ROOM directions of each film.
    """

    clearance: float
    safety: float
    pins: int
    read: bool
    probes: tuple[tuple[str, str], ...]
    theta: np.ndarray
    z: np.ndarray
    ambient: float
    Ts: float
    films: tuple[tuple[str, float, np.ndarray], ...]

    @classmethod
    def of(cls, machine: Machine, theta: np.ndarray, z: np.ndarray) -> Geometry:
        """Geometry of a machine and its films' grid: angles (n_theta,) [rad], places (films, n_z) [m] along them."""
        film = machine.film
        clearance = 0.0 if film is None else film.clearance * TO_UM
        probes = tuple((p.name, reading_unit(p)) for p in machine.probes)
        effects = [one for tables in machine.effects.values() for one in tables]
        films = tuple(
            (name, one.clearance * TO_UM, journal_room(machine, k, ROOM) * TO_UM)
            for k, (name, one) in enumerate(zip(machine.film_names, machine.films, strict=True))
        )
        return cls(
            clearance, SAFE * clearance, len(machine.injectors), any(e.port == "pin_sensor" for e in effects), probes,
            theta, np.atleast_2d(z), machine.gas.ambient_pressure, machine.sampling_time, films,
        )  # fmt: skip

    @property
    def first_probe(self) -> int:
        """Column of the first probe."""
        return len(COLUMNS) + self.pins * (2 if self.read else 1)

    def alike(self, other: Geometry) -> bool:
        """True if a film of one can be drawn as one of the other; without a film there is nothing to draw."""
        return not len(self.theta) or (np.array_equal(self.theta, other.theta) and np.array_equal(self.z, other.z))

    def as_dict(self) -> dict[str, Any]:
        """Plain values for a page."""
        return {
            "clearance": round(self.clearance, 3), "safety": round(self.safety, 2), "pins": self.pins,
            "theta": _plain(np.degrees(self.theta), 2), "films": [
                {"name": name, "clearance": round(own, 3), "room": _plain(room, 3), "z": _plain(z * 1e3, 3)}
                for (name, own, room), z in zip(self.films, self.z, strict=False)
            ],
            "highest": round(HIGHEST / (SPECTRUM * self.Ts), 3),
            "spans": [round(n * self.Ts, 4) for n in (ORBIT, SPECTRUM, TRACE)],
        }  # fmt: skip


def make_frame(
    rows: np.ndarray, pressure: np.ndarray | None, geometry: Geometry, time: float, rest: np.ndarray,
    shown: int = 0,
) -> dict[str, Any]:  # fmt: skip
    """Frame of the last rows (n, columns + 6 inputs) and a film's pressure (n_theta, n_z) [Pa, absolute] at `time`
    [s]; the disc rests at `rest` (2,) [m], the film is number `shown`."""
    frame: dict[str, Any] = {"time": round(time, 4), "centre": _plain(rest * TO_UM, 2)}
    if len(rows) < 2:
        return frame
    film = pressure is not None
    frame["orbit"] = {"disc": _pair(rows[-ORBIT:], "disc", 2)}
    frame["trace"] = _traces(rows[-TRACE:], geometry, film)
    frame["spectrum"] = _plain(spectrum(rows[-SPECTRUM:]), 3) if len(rows) >= SPECTRUM else None
    frame["orders"] = no_orders(rows[-SPECTRUM:], geometry.Ts)
    away = float(np.hypot(*(rows[-ORBIT:, DISC] - rest).T).max()) * TO_UM
    frame["now"] = _numbers(rows, geometry.Ts) | {"probes": _probe_swings(rows, geometry), "away": round(away, 2)}
    if pressure is not None:
        frame["orbit"]["journal"] = (
            _pair(rows[-ORBIT:], "journal", 2) if not shown else _journal(rows[-ORBIT:], geometry, shown)
        )
        frame["shown"] = shown
        frame["film"] = _plain((pressure - geometry.ambient).ravel() / 1e3, 1)
    return frame


def spectrum(rows: np.ndarray) -> np.ndarray:
    """Amplitude [um, 0-pk] of the larger axis of the measured disc at lines 0 ... HIGHEST (Hann window)."""
    disc = rows[:, DISC_READ] * TO_UM
    window = np.hanning(len(rows) + 1)[:-1, None]
    size = np.abs(np.fft.rfft((disc - disc.mean(axis=0)) * window, axis=0)) * 2 / window.sum()
    return np.asarray(size[: HIGHEST + 1].max(axis=1))


def no_orders(rows: np.ndarray, Ts: float) -> str:
    """Reason why the lines of a spectrum have no order; empty if they have."""
    speed = rows[:, AT["speed"]]
    if len(rows) < SPECTRUM:
        return f"after {SPECTRUM * Ts:g} s"
    if np.ptp(speed) > LINE / (SPECTRUM * Ts):
        return "no orders: the speed was changing"
    return ""


def swing(rows: np.ndarray, Ts: float) -> tuple[list[float], str]:
    """Half the peak-to-peak value of the disc x, y [um] over SWING samples and a revolution, or the reason for none.

    It is that of the disc's displacement, not of what the sensors show: their noise is no swing.
    """
    speed, length = abs(float(rows[-1, AT["speed"]])), SWING
    if speed > STANDING:
        length = max(SWING, int(np.ceil(2 * np.pi / (speed * Ts))))
    if length > LENGTH:
        return [], f"a turn takes longer than {LENGTH * Ts:g} s"
    if len(rows) < length:
        return [], f"after {length * Ts:.1f} s"
    return _plain(0.5 * np.ptp(rows[-length:, DISC] * TO_UM, axis=0), 2), ""


def _numbers(rows: np.ndarray, Ts: float) -> dict[str, Any]:
    """The values of the last sample, and what the last 100 samples touched."""
    last = {name: float(rows[-1, column]) for name, column in AT.items()}
    found, why = swing(rows, Ts)
    return {
        "angle": round(last["angle"] % (2 * np.pi), 3),
        "speed": round(last["speed"] * TO_RPM, 3),
        "pressure": round(last["pressure"] / MPA, 4),
        "h_min": round(last["h_min"] * TO_UM, 3),
        "mass_flow": round(last["mass_flow"] * 1e3, 4),
        "contact": bool(rows[-100:, AT["contact"]].max() > 0),
        "swing": found,
        "no_swing": why,
        "force": _plain(rows[-100:, -2:].sum(axis=0) * Ts * 1e3, 3),
    }


def _probe_swings(rows: np.ndarray, geometry: Geometry) -> list[tuple[str, str]]:
    """Name of each probe and half the peak-to-peak value of its reading over the last SWING samples."""
    first = geometry.first_probe
    half = 0.5 * np.ptp(rows[-SWING:, first : first + len(geometry.probes)], axis=0)
    return [(name, shown_reading(value, unit)) for value, (name, unit) in zip(half, geometry.probes, strict=True)]


def _traces(rows: np.ndarray, geometry: Geometry, film: bool) -> dict[str, Any]:
    """Disc [um], references [V], pins [um] over the last TRACE samples, pins as their sensors read them."""
    thin = rows[:: max(len(rows) // POINTS, 1)]
    found: dict[str, Any] = {"x": _plain(thin[:, READ] * TO_UM, 2), "y": _plain(thin[:, READ + 1] * TO_UM, 2)}
    found["seconds"] = round(len(rows) * geometry.Ts, 4)
    reference = inputs_of(thin)[:, REFERENCE]
    found |= {"reference_x": _plain(reference[:, 0], 3), "reference_y": _plain(reference[:, 1], 3)}
    first = len(COLUMNS) + (geometry.pins if geometry.read else 0)
    for k in range(geometry.pins if film else 0):
        found[f"pin_{k + 1}"] = _plain(thin[:, first + k] * TO_UM, 2)
    return found


def _journal(rows: np.ndarray, geometry: Geometry, number: int) -> list[list[float]]:
    """Journal [um] in a film of several."""
    first = geometry.first_probe + len(geometry.probes) + FILM_COLUMNS * number
    thin = rows[:: max(len(rows) // POINTS, 1), first : first + 2] * TO_UM
    return [_plain(thin[:, k], 2) for k in range(2)]


def _pair(rows: np.ndarray, name: str, digits: int) -> list[list[float]]:
    thin = rows[:: max(len(rows) // POINTS, 1)]
    return [_plain(thin[:, AT[f"{name}_{axis}"]] * TO_UM, digits) for axis in "xy"]


def _plain(values: np.ndarray, digits: int) -> list[float]:
    return np.round(np.asarray(values, float), digits).tolist()


REPLAY = "not in a replay"
SAME = 1e-3
"""Distance of eigenvalues, over the frequency, up to which they are one."""


def hit_shown(rig: Rig, kept: tuple[int, float, RingdownReading], replay: bool) -> dict[str, Any]:
    """Displayed values of the last impact: axis, frequency [Hz], zeta, scatter of both, or the reason for none."""
    epoch, speed, reading = kept
    why = _hit_void(rig, epoch, speed, reading, replay)
    shown: dict[str, Any] = {"axis": reading.axis, "why": why or reading.why}
    if not shown["why"]:
        shown |= {
            "frequency": round(reading.frequency, 1), "frequency_scatter": round(reading.frequency_scatter + 0.05, 1),
            "zeta": round(reading.zeta, 4), "zeta_scatter": round(reading.zeta_scatter + 0.00005, 4),
        }  # fmt: skip
    return shown


def _hit_void(rig: Rig, epoch: int, speed: float, reading: RingdownReading, replay: bool) -> str:
    if replay:
        return REPLAY
    if rig.stopped:
        return "the plant has stopped"
    if rig.hit is not None:
        return f"{'xy'[rig.hit.axis]}: ringing"
    if not reading.axis:
        return "not yet"
    if epoch != rig.epoch:
        return f"{rig.change} since; hit again"
    if abs(rig.speed - speed) > DRIFT:
        return "the speed has changed since; hit again"
    return ""


def eigenvalues_shown(rig: Rig, kept: tuple[int, RigModes], replay: bool) -> dict[str, Any]:
    """Plain values of the open loop's eigenvalues: frequency [Hz] and zeta by axis, the speed [rpm] and pressure [MPa]
    they are at, why there are none."""
    epoch, modes = kept
    why = _eigenvalues_void(rig, epoch, replay) or modes.why
    if why:
        return {"why": why}
    shown: dict[str, Any] = {
        "why": "", "frequency": [round(f, 1) for f in modes.frequency], "zeta": [round(z, 4) for z in modes.zeta],
        "growing": another_growing(modes), "all": modes.proven, "speed": round(modes.speed * TO_RPM),
        "open": rig.settings.positions["controller"] != OFF,
    }  # fmt: skip
    return shown | {"pressure": round(modes.pressure * TO_MPA, 3)} if rig.has_film else shown


def another_growing(modes: RigModes) -> list[float]:
    """Frequency [Hz] and damping ratio of a mode that grows and is not among those of the axes; empty without one."""
    frequency, zeta = modes.least
    axes = zip(modes.frequency, modes.zeta, strict=True)
    shown = any(np.hypot(f - frequency, (z - zeta) * f) < SAME * f for f, z in axes)
    return [] if zeta >= -DAMPED or shown else [round(frequency, 1), round(zeta, 4)]


def _eigenvalues_void(rig: Rig, epoch: int, replay: bool) -> str:
    if replay:
        return REPLAY
    if epoch != rig.epoch:
        return "being computed"
    if any(rig.settings.numbers.get(f"reference_{axis}", 0.0) for axis in "xy"):
        return "is for references of 0 V"
    return ""
