"""Analyses as cases of a campaign: frozen dataclasses of parameters whose result is a few numbers, not a record.

Each computes quantities of one machine at one point. Where there is none (the film does not carry the rotor, no mode
grows) the quantity is None and `reason` gives the cause in a few words.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.lift_off import HIGHEST, lift_off
from rotorsim.analysis.load_capacity import load_capacity
from rotorsim.analysis.unbalance_response import largest_response, unbalances_of
from rotorsim.analysis.whirl_onset import LeastDamped, stability_limit
from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.base.errors import ConvergenceError, NoLiftOffError, RotorsimError
from rotorsim.experiments.experiment import check_parameters, param
from rotorsim.plant import Plant

REASON = "reason"
CARRIED, SETTLED = "the film does not carry the rotor", "the equilibrium iteration did not converge"


class _NotKnownError(RotorsimError):
    """A quantity that was not looked for everywhere."""


@dataclass(frozen=True)
class Analysis(ABC):
    """Base of analyses; raises DataError with one sentence for bad parameters."""

    name: ClassVar[str]
    quantities: ClassVar[tuple[str, ...]]
    """Names of the numbers that it gives, in SI."""
    samples: ClassVar[int] = 0
    """It simulates nothing."""

    def __post_init__(self) -> None:
        check_parameters(self)

    @abstractmethod
    def values(self, plant: Plant) -> dict[str, float]:
        """Its quantities of a machine [SI], NaN where there is none; raises NoLiftOffError, ConvergenceError."""

    def missing(self, plant: Plant) -> str:
        """Reason why a quantity is NaN although the film carries."""
        return "not defined here"

    def run(self, plant: Plant) -> dict[str, Any]:
        """Quantities as numbers or None, with the `reason` where one is None."""
        try:
            found = self.values(plant)
        except NoLiftOffError:
            return dict.fromkeys(self.quantities) | {REASON: CARRIED}
        except ConvergenceError:
            return dict.fromkeys(self.quantities) | {REASON: SETTLED}
        except _NotKnownError as error:
            return dict.fromkeys(self.quantities) | {REASON: str(error)}
        plain = {name: value if isfinite(value) else None for name, value in found.items()}
        return plain | ({REASON: self.missing(plant)} if None in plain.values() else {})


@dataclass(frozen=True)
class LiftOff(Analysis):
    """Least gauge supply pressure at which the film carries the rotor."""

    name: ClassVar[str] = "lift_off"
    quantities: ClassVar[tuple[str, ...]] = ("lift_off",)
    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Lift-off pressure [Pa, gauge]."""
        return {"lift_off": float(lift_off(plant, [self.speed])[0])}

    def missing(self, plant: Plant) -> str:
        """No pressure was enough."""
        return f"not carried up to {HIGHEST * TO_MPA:g} MPa"


@dataclass(frozen=True)
class Onset(Analysis):
    """Whirl onset: lowest speed at which a mode of film and rotor loses its damping."""

    name: ClassVar[str] = "onset"
    quantities: ClassVar[tuple[str, ...]] = ("onset",)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    highest_speed: float | None = param("rad/s", "Highest speed searched.", None, above=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Onset speed [rad/s]."""
        onset, _, looked = stability_limit(plant, self.pressure, self.highest_speed or highest_speed(plant))
        if not looked:
            raise _NotKnownError("not known: the number of modes is not proven at every speed")
        return {"onset": onset}

    def missing(self, plant: Plant) -> str:
        """No mode grew."""
        return f"stable up to {(self.highest_speed or highest_speed(plant)) * TO_RPM:.4g} rpm"


@dataclass(frozen=True)
class AtPoint(Analysis):
    """An analysis at one speed and supply pressure."""

    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)


@dataclass(frozen=True)
class AtEquilibrium(AtPoint):
    """Gas flow, least damping ratio and first natural frequency at an operating point."""

    name: ClassVar[str] = "operating_point"
    quantities: ClassVar[tuple[str, ...]] = ("flow", "damping", "frequency")

    def values(self, plant: Plant) -> dict[str, float]:
        """Mass flow [kg/s] of all injectors, damping ratio, natural frequency [rad/s]."""
        flow = float(plant.equilibrium(self.speed, self.pressure).mass_flow.sum())
        model = plant.linearise(self.speed, self.pressure)
        if not model.zeta.size:
            return {"flow": flow, "damping": float("nan"), "frequency": float("nan")}
        damping = LeastDamped.up_to(plant, self.pressure, highest_speed(plant)).certain(model)
        return {"flow": flow, "damping": damping, "frequency": float(model.wn[0])}

    def missing(self, plant: Plant) -> str:
        """Overdamped modes alone."""
        return "no mode oscillates"


@dataclass(frozen=True)
class Load(AtPoint):
    """Load capacity at half the clearance, see `load_capacity`."""

    name: ClassVar[str] = "load"
    quantities: ClassVar[tuple[str, ...]] = ("load",)

    def values(self, plant: Plant) -> dict[str, float]:
        """Load [N]."""
        return {"load": load_capacity(plant, self.speed, self.pressure)}


@dataclass(frozen=True)
class Peak(Analysis):
    """Largest unbalance response at the measuring plane over the stable speeds."""

    name: ClassVar[str] = "peak"
    quantities: ClassVar[tuple[str, ...]] = ("peak",)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    highest_speed: float | None = param("rad/s", "Highest speed searched.", None, above=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Amplitude [m, 0-pk], of the machine's unbalance or, without one, that of grade G 2.5."""
        highest = self.highest_speed or highest_speed(plant)
        unbalances = unbalances_of(plant.machine, highest)
        return {"peak": largest_response(plant, self.pressure, highest, unbalances)[0]}

    def missing(self, plant: Plant) -> str:
        """No stable speed."""
        return "carried and stable at no speed"


ANALYSES: dict[str, type[Analysis]] = {kind.name: kind for kind in (LiftOff, Onset, AtEquilibrium, Load, Peak)}
"""Every analysis by its name."""

__all__ = ["ANALYSES", "REASON", "Analysis"]
