r"""Modes of a live rig: frequencies and damping ratios from ring-downs, and eigenvalues of the plant as it is set.

The motion before the blow (rest position, 1X, 2X, 3X over the shaft angle) is taken away from the samples after it. The
free vibration of disc x, y that is left is a sum of damped oscillations; the eigensystem realisation (Juang and Pappa
1985) takes their poles s from the shift of its Hankel matrix's singular vectors:

.. math:: f = |s| / 2 \pi, \qquad \zeta = -\mathrm{Re}\, s / |s|

The mode of an axis is the one that the blow moves most along it. The stated scatter is the spread over four model
orders and two stretches of the ring-down, and an allowance for the film's nonlinearity, which shifts both with the
square of the motion over the clearance. A blow that was disturbed has no reading but a reason.

The eigenvalues are those of the open loop, at the present operating point and effect settings.

Cites: juang_1985.
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorsim.analysis.modes_over_speed import least_damped
from rotorsim.base.errors import RotorsimError
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import AT, FORCE, REFERENCE, SUPPLY, inputs_of
from rotorsim.plant.linearise import LinearPlant, linearise
from rotorsim.plant.simulation import settle

BEFORE = 2000
"""Samples before a blow that must be steady."""
RING = 2000
"""Samples after a blow that ring."""
LEAD = 10
"""Samples from the blow to the first that counts."""
THIN = 5
"""Samples that are averaged to one."""
STRETCHES = (0, 40)
"""First averaged samples of the stretches of a ring-down that are compared."""
LENGTH = 240
"""Averaged samples of a stretch."""
SHIFTS = 40
"""Rows of the Hankel matrix for each axis."""
MODEL_ORDERS = (4, 6, 8, 12)
"""Orders of the models that are compared."""
REFERENCE_ORDER = 8
"""Order of the model from which the mode is chosen."""
LOWEST = 0.02
"""Lowest frequency of a reading times the time between two averaged samples: 20 Hz at 5 kHz."""
HIGHEST = 0.45
"""Highest frequency of a reading times the time between two averaged samples: 450 Hz at 5 kHz."""
ORDERS = (1, 2, 3)
"""Orders of the speed whose motion is taken out of a ring-down."""
SLOW = 10 * np.pi
"""Speed [rad/s], 300 rpm, below which the motion of a turn is slower than every reading and stays in the ring-down."""
DRIFT = 2.0
"""Change of speed [rad/s] within which a speed is held."""
UNSTEADY = 0.1
"""Motion before the blow, next to that of the turns, as a share of the motion after it."""
SMALLEST = 0.2e-6
"""Smallest motion [m] that is read."""
CURVED_F = 0.7
"""Relative shift of f for a journal motion as large as the clearance: 0.54 or less in sixteen hits on the shipped rig
at 0 to 12 krpm, 0.3 to 0.6 MPa."""
CURVED_Z = 0.35
"""Shift of zeta for a journal motion as large as the clearance: 0.37 or less in these hits."""
LEAST_F = 0.002
"""Least relative scatter of f."""
LEAST_Z = 0.001
"""Least scatter of zeta."""
MOST_F = 0.05
"""Relative scatter of f beyond which a reading is refused."""
MOST_Z = 0.35
"""Relative scatter of zeta beyond which a reading is refused."""


@dataclass(frozen=True)
class RingdownReading:
    """Frequency [Hz] and damping ratio of a ring-down with their scatter, or the reason why there is none."""

    axis: str = ""
    frequency: float = 0.0
    zeta: float = 0.0
    frequency_scatter: float = 0.0
    zeta_scatter: float = 0.0
    why: str = ""


def read_ringdown(rows: np.ndarray, axis: int, clearance: float, limit: float, Ts: float) -> RingdownReading:
    """Reading of an impact along x (0) or y (1) from samples (BEFORE + LEAD + RING, columns + 6) round the blow.

    The force begins in row BEFORE. Radial clearance [m] and largest reference [V] are infinite where there is none.
    """
    name = "xy"[axis]
    why = spoilt(rows, limit)
    if why:
        return RingdownReading(name, why=why)
    disc = rows[:, [AT["disc_x"], AT["disc_y"]]]
    free = _free(disc, rows)
    quiet, loud = (float(np.abs(part).max()) for part in (free[:BEFORE], free[BEFORE:]))
    if loud < SMALLEST:
        return RingdownReading(name, why="the hit was too small to be read")
    if quiet > UNSTEADY * loud:
        return RingdownReading(name, why="the rotor was not steady before the hit")
    return _reading(name, axis, free[BEFORE + LEAD :], _journal(rows) / clearance, Ts)


def spoilt(rows: np.ndarray, limit: float) -> str:
    """Reason why the rows around an impact cannot be evaluated; empty if they can."""
    if np.ptp(rows[:, AT["speed"]]) > DRIFT:
        return "the speed was changing"
    if np.ptp(inputs_of(rows)[:, SUPPLY]) > 0:
        return "the pressure was changing"
    if inputs_of(rows)[:BEFORE, FORCE].any():
        return "a second hit fell within its time"
    if rows[:, AT["contact"]].max() > 0:
        return "the journal touched"
    if np.abs(inputs_of(rows)[:, REFERENCE]).max() >= 0.999 * limit:
        return "the actuators were at their limit"
    return ""


def _free(disc: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Disc (n, 2) [m] without its motion before the blow."""
    turning = _orders(rows[:, AT["angle"]])
    if abs(float(rows[BEFORE, AT["speed"]])) < SLOW:
        turning = turning[:, :1]
    steady = np.linalg.lstsq(turning[:BEFORE], disc[:BEFORE], rcond=None)[0]
    return np.asarray(disc - turning @ steady)


def _journal(rows: np.ndarray) -> float:
    """Amplitude [m] of the journal after the blow, from its rms along the larger axis."""
    journal = rows[:, [AT["journal_x"], AT["journal_y"]]]
    moved = journal[BEFORE + LEAD :] - journal[:BEFORE].mean(axis=0)
    return float(np.sqrt(2 * np.mean(moved**2, axis=0).max()))


def _reading(name: str, axis: int, free: np.ndarray, share: float, Ts: float) -> RingdownReading:
    """Reading from the ring-down (RING, 2) [m] of a motion that is `share` of the clearance."""
    thin = free[: len(free) // THIN * THIN].reshape(-1, THIN, 2).mean(axis=1)
    found = [poles(thin[at : at + LENGTH], THIN * Ts, MODEL_ORDERS) for at in STRETCHES]
    main = _pole_of_axis(thin[:LENGTH], found[0][REFERENCE_ORDER], axis, THIN * Ts)
    if main is None:
        return RingdownReading(name, why="the ring-down shows no oscillation")
    alike = [complex(each[np.abs(each - main).argmin()]) for one in found for each in one.values()]
    f, zeta = np.abs(alike) / (2 * np.pi), -np.real(alike) / np.abs(alike)
    middle_f, middle_z = float(np.median(f)), float(np.median(zeta))
    df = float(np.abs(f - middle_f).max()) + (LEAST_F + CURVED_F * share**2) * middle_f
    dz = float(np.abs(zeta - middle_z).max()) + LEAST_Z + CURVED_Z * share**2
    if df > MOST_F * middle_f or dz > max(MOST_Z * abs(middle_z), 10 * LEAST_Z):
        return RingdownReading(name, why="the ring-down is not that of a linear mode; hit less hard")
    return RingdownReading(name, middle_f, middle_z, df, dz)


def poles(signal: np.ndarray, dt: float, orders: tuple[int, ...]) -> dict[int, np.ndarray]:
    """Poles [rad/s] of a free vibration (n, 2) sampled every dt [s], by model order."""
    windows = np.lib.stride_tricks.sliding_window_view(signal, SHIFTS, axis=0)
    U, S, _ = np.linalg.svd(windows.reshape(len(windows), -1).T, full_matrices=False)
    found = {}
    for order in orders:
        seen = (U[:, :order] * np.sqrt(S[:order])).reshape(2, SHIFTS, order)
        shift = np.linalg.lstsq(seen[:, :-1].reshape(-1, order), seen[:, 1:].reshape(-1, order), rcond=None)[0]
        z = np.linalg.eigvals(shift).astype(complex)
        found[order] = np.log(z[np.abs(z) > 1e-9]) / dt
    return found


def _pole_of_axis(signal: np.ndarray, s: np.ndarray, axis: int, dt: float) -> complex | None:
    """The oscillation that is largest along an axis at the blow."""
    shapes = np.exp(np.outer(np.arange(len(signal)) * dt, s))
    size = np.abs(np.linalg.lstsq(shapes, signal.astype(complex), rcond=None)[0][:, axis])
    f = np.abs(s) / (2 * np.pi)
    swings = (s.imag > 0.4 * np.abs(s)) & (f > LOWEST / dt) & (f < HIGHEST / dt)
    if not swings.any():
        return None
    return complex(s[swings][size[swings].argmax()])


def _orders(angle: np.ndarray) -> np.ndarray:
    waves = [wave(order * angle) for order in ORDERS for wave in (np.cos, np.sin)]
    return np.stack([np.ones_like(angle), *waves], axis=1)


@dataclass(frozen=True)
class RigModes:
    """Frequency [Hz] and damping ratio of the lowest mode of each axis at a speed [rad/s] and gauge pressure [Pa], or
    the reason why there is none; `least` are frequency and damping ratio of the least damped of all modes,
    `proven` whether none is missing among them."""

    frequency: tuple[float, ...] = ()
    zeta: tuple[float, ...] = ()
    why: str = ""
    least: tuple[float, float] = (float("nan"), float("inf"))
    proven: bool = False
    speed: float = 0.0
    pressure: float = 0.0


def modes_at(a: Assembly, speed: float, pressure: float) -> RigModes:
    """Modes at a speed [rad/s] and gauge pressure [Pa], without controller."""
    try:
        return _modes_of(linearise(a, settle(a, speed, pressure), speed), pressure)
    except RotorsimError as error:
        return RigModes(why=str(error))
    except np.linalg.LinAlgError:
        return RigModes(why="cannot be computed here")


def _modes_of(plant: LinearPlant, pressure: float) -> RigModes:
    first = [plant.mode_of_axis(axis) for axis in range(2)] if plant.wn.size else []
    frequency, zeta = (plant.wn[first] / (2 * np.pi)).tolist(), plant.zeta[first].tolist()
    damping, omega = least_damped(plant.modes, plant.region)
    least = omega / (2 * np.pi), damping
    return RigModes(tuple(frequency), tuple(zeta), "", least, plant.proven, plant.speed, pressure)


def own_copy(a: Assembly) -> Assembly:
    """Private copy of an assembly's parameter record and workspace."""
    return replace(a, record=a.record.copy(), w=a.w.copy())
