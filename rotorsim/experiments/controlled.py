"""Closed loop with a discrete controller at the sampling rate; bias, dither and impacts from other experiments.

The controller sees a sample's measured displacement, speed and pressure and acts in the next sample. The total
reference is limited to the actuators' range and recorded as `reference`; `reference_external` is what was added to the
controller's output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import REFERENCE_LIMIT, AtPoint, Experiment
from rotorsim.experiments.given import Given
from rotorsim.experiments.parameters import param
from rotorsim.experiments.running import run
from rotorsim.plant.controller import as_controller, check_any_controller, provenance

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from rotorsim.plant.controller import Controller
    from rotorsim.plant.plant import Plant


@dataclass(frozen=True)
class Controlled(AtPoint):
    """Closed loop with a discrete controller; references and forces of `excitations` are added while they last.

    Examples
    --------
    >>> import rotorsim as rs
    >>> loop = rs.experiments.Controlled(300.0, 0.5e6, duration=0.1, controller=rs.experiments.ProportionalLaw())
    >>> rs.run(plant, loop).sizes["time"]
    500
    """

    name: ClassVar[str] = "controlled"
    drives_reference: ClassVar[bool] = True
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    bias_x: float = param("V", "Constant reference x.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    bias_y: float = param("V", "Constant reference y.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    controller: Controller | Any | None = None
    excitations: tuple[Experiment, ...] = ()

    def check(self) -> None:
        """Refuse what is neither a controller nor an excitation."""
        check_any_controller(self.controller)
        for other in self.excitations:
            if not isinstance(other, Experiment) or isinstance(other, Controlled):
                raise DataError(f"excitations: {other!r} is not an open-loop experiment; give e.g. Prbs(amplitude=0.2)")

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.duration)

    def sampled(self, Ts: float) -> Self:
        """The experiment at a sampling time [s], with its excitations."""
        excitations = tuple(other.sampled(Ts) for other in self.excitations)
        return replace(self, Ts=Ts, excitations=excitations) if Ts != self.Ts else self

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch; the reference is the external one."""
        rows = self.held(count)
        rows[:, 2:4] = self.bias_x, self.bias_y
        for other in self.excitations:
            n = max(min(count, other.samples - first), 0)
            if n:
                rows[:n, 2:6] += other.rows(first, n)[:, 2:6]
        return rows

    def attrs(self) -> dict[str, Any]:
        """Name and parameters of the experiment, its controller and its excitations, SI."""
        attrs = super().attrs() | provenance(as_controller(self.controller, lambda: (0.0, 0.0)))
        for number, other in enumerate(self.excitations, start=1):
            own = {key: value for key, value in other.attrs().items() if key not in ("speed", "pressure")}
            attrs |= {f"excitation_{number}_{key}": value for key, value in own.items()}
        return attrs


def controlled(
    plant: Plant,
    controller: Controller | Any,
    speed: float = 0.0,
    pressure: float = 0.3e6,
    duration: float = 10.0,
    bias: tuple[float, float] = (0.0, 0.0),
    reference: ArrayLike | None = None,
    disc_force: ArrayLike | None = None,
    excitations: Sequence[Experiment] = (),
    seed: int = 0,
    progress: bool = False,
) -> xr.Dataset:
    """Run in closed loop and return the record.

    Parameters
    ----------
    plant : Plant
        The machine.
    controller : object
        With a method ``step(measured, speed, pressure) -> reference``: from the measured disc (2,) [m], speed [rad/s]
        and gauge pressure [Pa] of a sample it makes the reference (2,) [V] of the next. Its `reset()`, if it has one,
        is called first. Also a function of these three, or a sampled system of the package `control`, which is given
        the displacement from the equilibrium.
    speed, pressure : float
        Shaft speed [rad/s] and gauge pressure [Pa].
    duration : float
        Length of the record [s].
    bias : (float, float)
        Constant reference [V], added to the controller's.
    reference, disc_force : array, optional
        Reference [V] that is added to the controller's and force on the disc [N], (n, 2) over the samples; nothing
        after the last of them.
    excitations : sequence of Experiment
        Their references and disc forces are added, e.g. ``[Prbs(amplitude=0.2), Impact(peak=20.0)]``.
    seed : int
        Of the excitations and of the plant's noise.
    progress : bool
        Show a bar on a terminal.

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.experiments.ProportionalLaw(gain_x=1e5, gain_y=1e5)
    >>> rs.experiments.controlled(plant, law, speed=300.0, pressure=0.5e6, duration=0.1).sizes["time"]
    500
    """
    if np.shape(bias) != (2,):
        raise DataError(f"bias = {bias}: is not a pair of voltages; give e.g. (0.5, 0.0)")
    added = list(excitations)
    if reference is not None or disc_force is not None:
        added.append(Given(reference=reference, disc_force=disc_force))
    loop = Controlled(speed, pressure, duration, bias[0], bias[1], controller, tuple(added))
    return run(plant, loop, seed, progress)
