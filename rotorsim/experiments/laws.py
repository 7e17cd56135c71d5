r"""Laws in Python: proportional feedback, and harmonics of the speed that keep references from following the orbit.

A law feeds the orbit of imbalance, coupling and runout back, and the pins follow it. With harmonics of complex
amplitude a_k next to the law's reference r_c,

.. math:: r = r_c + \mathrm{Re} \sum_k a_k e^{i k \Omega t}

those of the sum answer linearly as in balancing by influence coefficients: s_k = s_k0 + S_k a_k. Trials on either axis
give S_k (2, 2), and a_k = -S_k^{-1} s_k0 takes s_k away; repeated, with S_k corrected by what a step did (Broyden
1965). The disc keeps the orbit that it has without the law; the loop and its answer to other references stay.

Proportional feedback has a first-order low-pass on each axis (thesis eq. C.21, section C.5).

.. math:: r = H\,g\,(p - p_c), \qquad H(s) = \frac{2\pi f}{s + 2\pi f}

The thesis gives kappa = 1.125 and 0.99 m/m at 1 kHz, with positive feedback: what damps the rotor is the lag of film
and actuators. One volt being 4.5 um of piezo reference, kappa is a gain kappa / (4.5 um/V): 0.25 and 0.22 V/um.

Cites: broyden_1965, goodman_1964, thesis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from identification.records.checks import SATURATED, saturated_share
from rotorsim.base.errors import ControllerError, DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.guard import FARTHEST, OK, SENSOR, SIZE, Guarded, guard
from rotorsim.experiments.catalogue.controlled import controlled
from rotorsim.experiments.experiment import REFERENCE_LIMIT, attributes, check_parameters, param
from rotorsim.plant.controller import as_controller, call, check_controller, name_of, provenance

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant.controller import Controller
    from rotorsim.plant.plant import Plant


@dataclass
class ProportionalLaw(Guarded):
    """The law with the state of its filter; `centre` (2,) [m] is the position that asks for no reference.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.ProportionalLaw(gain_x=1e5).step(np.array([1e-6, 0.0]), 300.0, 0.5e6).shape
    (2,)
    """

    gain_x: float = param("V/m", "Volts of reference x per metre of measured x; positive pushes outwards.", 0.25e6)
    gain_y: float = param("V/m", "The same of y.", 0.22e6)
    low_pass: float = param("Hz", "Bandwidth of the low-pass.", 1000.0, above=0, sampled=True)
    centre: tuple[float, float] = (0.0, 0.0)
    Ts: float = RIG_SAMPLE
    state: np.ndarray = field(default_factory=lambda: np.zeros(2), repr=False)
    memory: np.ndarray = field(default_factory=lambda: np.zeros(SIZE), repr=False)

    def __post_init__(self) -> None:
        check_parameters(self)

    def check_sampling(self, Ts: float) -> None:
        """Raise ControllerError unless the sampling time is that of the plant, Ts [s]."""
        if abs(self.Ts / Ts - 1) > 1e-9:
            raise ControllerError(
                f"controller ProportionalLaw: Ts = {self.Ts * 1e3:g} ms, and the plant samples every {Ts * 1e3:g} ms; "
                f"give it Ts={Ts:g}"
            )

    def reset(self) -> None:
        """Forget the past."""
        self.state, self.memory = np.zeros(2), np.zeros(SIZE)

    def step(self, measured: np.ndarray, speed: float, pressure: float) -> np.ndarray:
        """Reference (2,) [V] for the next sample from the measured disc (2,) [m]; held where that is not finite."""
        bad = not np.all(np.abs(measured) < FARTHEST)
        if not bad:
            keep = np.exp(-2 * np.pi * self.low_pass * self.Ts)
            asked = np.array([self.gain_x, self.gain_y]) * (np.asarray(measured) - self.centre)
            self.state = keep * self.state + (1 - keep) * asked
        output = self.state.copy()
        guard(self.memory, SENSOR if bad else OK, output)
        return output

    def attrs(self) -> dict[str, Any]:
        """Parameters for a record's attributes."""
        return attributes(self) | {"centre_x": float(self.centre[0]), "centre_y": float(self.centre[1])}


TURNS, SHORTEST, LONGEST = 30, 3.0, 60.0
"""Least number of revolutions of a trial run, of which the second half is looked at; how long [s] it lasts."""
ROUNDS, ENOUGH = 6, 0.02
"""Most steps; share of the first harmonics of the references at which they end."""
FADE = 0.3
"""Time [s] over which harmonics come in: a law with little margin may not stand their jump."""
MORE = 2
"""Harmonics beyond those taken away that are fitted too, so that they do not disturb them."""
LEFT, SMALL = 0.1, 0.01
"""Share of the harmonics of the references that may be left, and amplitude [V] that may be anyway."""


class WithHarmonics:
    """A controller with harmonics k = 1, 2, ... of a constant speed [rad/s] added, complex amplitudes (k, 2) [V].

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.experiments.WithHarmonics(rs.experiments.ProportionalLaw(), 300.0, [[0.5, -0.5j]])
    >>> law.step(np.zeros(2), 300.0, 0.5e6).tolist()  # they come in over 0.3 s
    [0.0, 0.0]
    """

    def __init__(self, controller: Controller | Any, speed: float, amplitudes: ArrayLike) -> None:
        check_controller(controller)
        self.controller, self.speed = controller, float(speed)
        try:
            self.amplitudes = np.array(amplitudes, complex)
        except (TypeError, ValueError) as error:
            raise DataError(
                f"amplitudes {amplitudes!r}: give (k, 2) finite numbers, [V] of x and y",
                argument="amplitudes",
                value=amplitudes,
            ) from error
        if self.amplitudes.ndim != 2 or self.amplitudes.shape[1] != 2 or not np.all(np.isfinite(self.amplitudes)):
            raise DataError(
                f"amplitudes {self.amplitudes.shape}: give (k, 2) finite numbers, [V] of x and y",
                argument="amplitudes",
                value=amplitudes,
            )
        self.orders = np.arange(1, len(self.amplitudes) + 1)
        self.name = name_of(controller)
        self.Ts, self.sample, self.now = float(getattr(controller, "Ts", 0.0)), 0, np.zeros(2)

    def check_sampling(self, Ts: float) -> None:
        """Take over the plant's sampling time [s], where the controller accepts it."""
        call(self.controller, "check_sampling", Ts)
        self.Ts = Ts

    def check_machine(self, name: str) -> None:
        """Let the controller look at the machine's name."""
        call(self.controller, "check_machine", name)

    def reset(self) -> None:
        """Begin again."""
        self.sample, self.now = 0, np.zeros(2)
        call(self.controller, "reset")

    def applied(self, reference: np.ndarray) -> None:
        """Give the controller the reference (2,) [V] that acts less the harmonics, which to it are as an imbalance.

        With them a law's check of the signs takes the orbit, which its model has none of, for swapped sensors.
        """
        call(self.controller, "applied", reference - self.now)

    @property
    def runout(self) -> Any:
        """Runout table of the controller; None where it has none."""
        return getattr(self.controller, "runout", None)

    def step(self, measured: np.ndarray, speed: float, pressure: float, *angle: float) -> np.ndarray:
        """Reference (2,) [V]: the controller's and the harmonics of now."""
        time = self.Ts * self.sample
        turn = min(time / FADE, 1.0) * np.exp(1j * self.orders * self.speed * time)
        self.sample, self.now = self.sample + 1, (turn @ self.amplitudes).real
        return np.asarray(self.controller.step(measured, speed, pressure, *angle), float) + self.now

    @property
    def bad_samples(self) -> int:
        """Number of bad samples that the controller had."""
        return int(getattr(self.controller, "bad_samples", 0))

    @property
    def past_alarms(self) -> str:
        """Bad samples that the controller had."""
        return str(getattr(self.controller, "past_alarms", "") or "")

    def attrs(self) -> dict[str, Any]:
        """The controller's attributes for a record, and magnitude [V] and phase [rad] of each harmonic."""
        found = provenance(self.controller)
        for k, row in zip(self.orders, self.amplitudes, strict=True):
            for axis, value in zip("xy", row, strict=True):
                found |= {f"harmonic_{k}_{axis}": abs(value), f"harmonic_{k}_{axis}_phase": float(np.angle(value))}
        return found


def without_orbit(
    plant: Plant,
    controller: Controller | Any,
    speed: float,
    pressure: float,
    harmonics: int = 2,
    trial: float = 0.2,
    seed: int = 0,
) -> WithHarmonics:
    """The controller with the harmonics of the speed that keep its references from following the orbit.

    Takes up to nine short runs of the closed loop without excitation. For records to identify: the film answers strokes
    of the pins at the shaft's speed with another stiffness and damping.

    Parameters
    ----------
    plant : Plant
        The machine.
    controller : object
        As `controlled` takes it.
    speed, pressure : float
        Shaft speed [rad/s], constant, and gauge pressure [Pa].
    harmonics : int
        How many are taken away.
    trial : float
        Amplitude of the trials [V].
    seed : int
        Of the plant's noise.

    Raises
    ------
    DataError
        If the shaft turns slower than 30 rpm, or more than a tenth of the harmonics is left, as where the references
        are at their range or the loop is unstable.

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.experiments.ProportionalLaw(gain_x=1e5, gain_y=1e5)
    >>> calm = rs.experiments.without_orbit(plant, law, speed=600.0, pressure=0.6e6)
    >>> calm.amplitudes.shape
    (2, 2)
    """
    if not speed * LONGEST >= 2 * np.pi * TURNS:
        raise DataError(
            f"speed = {speed:g} rad/s: the shaft hardly turns and has no orbit; take the law as it is",
            argument="speed",
            value=speed,
        )
    whole = type(harmonics) is int and harmonics in range(1, 6)
    if not whole or not 0 < trial <= REFERENCE_LIMIT:
        raise DataError(
            f"harmonics = {harmonics}, trial = {trial} V: give 1 to 5 harmonics and a trial up to "
            f"{REFERENCE_LIMIT:g} V",
            argument="trial" if whole else "harmonics",
            value=trial if whole else harmonics,
        )
    Ts = plant.machine.sampling_time
    lasting = Ts * np.ceil(max(SHORTEST, TURNS * 2 * np.pi / speed) / Ts)
    law = as_controller(controller, lambda: plant.equilibrium(speed, pressure).disc, Ts)

    def left(added: np.ndarray) -> np.ndarray:
        record = controlled(plant, WithHarmonics(law, speed, added), speed, pressure, lasting, seed=seed)
        if not added.any() and (share := saturated_share(record["reference"].values)) >= SATURATED:
            raise DataError(
                f"controller {name_of(law)}: stands at the range of the references in {100 * share:.3g} % of the "
                "samples without any excitation; reduce its gain",
                argument="controller",
                value=share,
            )
        return harmonics_of(record, speed, harmonics)

    added, first, found = _solved(left, harmonics, trial)
    if not np.abs(found).max() <= max(LEFT * np.abs(first).max(), SMALL):
        raise DataError(
            f"controller {name_of(law)}: {np.abs(found).max():.2g} V of {np.abs(first).max():.2g} V of its "
            f"references' harmonics are left after {ROUNDS} rounds; reduce its gain, or take it as it is",
            argument="controller",
            value=float(np.abs(found).max()),
        )
    return WithHarmonics(law, speed, added)


def _solved(
    left: Callable[[np.ndarray], np.ndarray], harmonics: int, trial: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Amplitudes added, harmonics of the references before and with them, all (harmonics, 2) [V]."""
    none = np.zeros((harmonics, 2), complex)
    first = found = left(none)
    if np.abs(first).max() <= SMALL:
        return none, first, found
    units = [np.tile(row, (harmonics, 1)) for row in np.eye(2)]
    S = np.stack([(left(none + trial * unit) - first) / trial for unit in units], axis=2)
    added = none
    for _ in range(ROUNDS):
        step = -np.einsum("kij,kj->ki", np.linalg.pinv(S), found)
        added, before = added + step, found
        found = left(added)
        if np.abs(found).max() <= ENOUGH * np.abs(first).max():
            break
        S = S + (found - before - np.einsum("kij,kj->ki", S, step))[:, :, None] * _dual(step)[:, None, :]
    return added, first, found


def _dual(step: np.ndarray) -> np.ndarray:
    """Rows (k, 2) whose product with the steps (k, 2) is one."""
    return np.asarray(step.conj() / np.maximum(np.sum(np.abs(step) ** 2, axis=1, keepdims=True), 1e-300))


def harmonics_of(record: xr.Dataset, speed: float, count: int) -> np.ndarray:
    """Complex amplitudes (count, 2) [V] of the references at multiples of a speed [rad/s], second half of a record.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.harmonics_of(record, 300.0, 2).shape
    (2, 2)
    """
    u, time = np.asarray(record["reference"].values, float), np.asarray(record["time"].values, float)
    second = slice(len(u) // 2, None)
    turn = np.exp(1j * speed * (time[second] - time[0])[:, None] * np.arange(1, count + MORE + 1))
    columns = np.hstack([np.ones((len(turn), 1)), turn.real, -turn.imag])
    found = np.linalg.lstsq(columns, u[second], rcond=None)[0]
    return np.asarray(found[1 : count + 1] + 1j * found[count + MORE + 1 : 2 * count + MORE + 1])
