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
from rotorsim.base.input_files import parse_toml
from rotorsim.base.units import parse
from rotorsim.experiments.catalogue.steady import Given
from rotorsim.experiments.experiment import REFERENCE_LIMIT, Experiment, PointExperiment, param, register

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from rotorsim.plant.controller import Controller
    from rotorsim.plant.plant import Plant


@register
@dataclass(frozen=True)
class Controlled(PointExperiment):
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
    example: ClassVar[str] = (
        "--pressure '0.6 MPa' --gain-x '0.25 V/um' --gain-y '0.22 V/um' --hit '20 N' --duration '2 s'"
    )
    python: ClassVar[str] = (
        "rs.experiments.controlled(plant, rs.experiments.ProportionalLaw(0.25e6, 0.22e6, "
        "centre=plant.equilibrium(0.0, 0.6e6).disc), pressure=0.6e6, duration=2.0, "
        "excitations=(rs.experiments.Impact(peak=20.0, hits=2),))"
    )
    figures: ClassVar[tuple[str, ...]] = (
        "excitation", "spectra", "waterfall", "full_spectrum", "orbits", "against_time"
    )  # fmt: skip
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    bias_x: float = param("V", "Constant reference x.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    bias_y: float = param("V", "Constant reference y.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    controller: Controller | Any | None = None
    excitations: tuple[Experiment, ...] = ()

    def check(self) -> None:
        """Refuse what is neither a controller nor an excitation."""
        from rotorsim.plant.controller import check_any_controller

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
        from rotorsim.plant.controller import as_controller, provenance

        attrs = super().attrs() | provenance(as_controller(self.controller, lambda: (0.0, 0.0)))
        for number, other in enumerate(self.excitations, start=1):
            own = {key: value for key, value in other.attrs().items() if key not in ("speed", "pressure")}
            attrs |= {f"excitation_{number}_{key}": value for key, value in own.items()}
        return attrs

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Samples whose reference stands at its range, and alarms of the controller."""
        from rotorsim.signals.record_blocks import blocks

        limit = _range_of(record)
        limited = [np.any(np.abs(b["reference"]) >= limit, axis=1).sum() for b in blocks(record, ["reference"])]
        alarms = {key: str(record.attrs[key]) for key in ("controller_alarms",) if key in record.attrs}
        return {"saturated_samples": int(np.sum(limited)), **alarms}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Rows of the saturation, with a warning if most samples are saturated, and of the alarms."""
        limited, samples = summary["saturated_samples"], summary["samples"]
        share = f"{limited} samples, {100 * limited / samples:.3g} %"
        if limited > samples / 2:
            share += ": the loop is not in control; check the signs and the order of the sensors' axes, then the gain"
        alarms = [("Controller", summary["controller_alarms"])] if "controller_alarms" in summary else []
        return [("Reference at its limit", share), *alarms]


def _range_of(record: xr.Dataset) -> float:
    """Largest reference [V] of the machine that a record names; see `reference_range`."""
    actuators = parse_toml(str(record.attrs.get("machine", ""))).get("actuators", {})
    if "reference_limit" not in actuators:
        return REFERENCE_LIMIT
    return min(parse(actuators["reference_limit"], "V"), REFERENCE_LIMIT)


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
    from rotorsim.experiments.running import run

    if np.shape(bias) != (2,):
        raise DataError(f"bias = {bias}: is not a pair of voltages; give e.g. (0.5, 0.0)")
    added = list(excitations)
    if reference is not None or disc_force is not None:
        added.append(Given(reference=reference, disc_force=disc_force))
    loop = Controlled(speed, pressure, duration, bias[0], bias[1], controller, tuple(added))
    return run(plant, loop, seed, progress)
