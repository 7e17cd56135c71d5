r"""Proportional feedback with first-order low-pass on each axis (thesis eq. C.21, section C.5).

.. math:: r = H\,g\,(p - p_c), \qquad H(s) = \frac{2\pi f}{s + 2\pi f}

The thesis gives kappa = 1.125 and 0.99 m/m at 1 kHz, with positive feedback: what damps the rotor is the lag of film
and actuators. One volt being 4.5 um of piezo reference, kappa is a gain kappa / (4.5 um/V): 0.25 and 0.22 V/um.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rotorsim.base.errors import ControllerError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.guard import FARTHEST, OK, SENSOR, SIZE, Guarded, guard
from rotorsim.experiments.experiment import attributes, check_parameters, param


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
