"""Options of `rotorsim experiment controlled`: a law from its file or a built-in one, dither and impacts."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.experiments.catalogue.controlled import Controlled
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.experiments.catalogue.prbs import Prbs
from rotorsim.experiments.experiment import REFERENCE_LIMIT, Experiment, check_parameters, param, sequence

if TYPE_CHECKING:
    from rotorsim.control import Law
    from rotorsim.experiments import ProportionalLaw, WithHarmonics
    from rotorsim.plant import Plant

LawFile = Annotated[
    Path | None, typer.Option("--law", help="Law that 'rotorsim design' wrote, in place of controller and gains.")
]
WithoutOrbit = Annotated[
    bool,
    typer.Option(
        "--without-orbit", help="Add harmonics of the speed that keep the references from following the orbit."
    ),
]
FILES: dict[str, tuple[Any, Any]] = {"law": (LawFile, None), "without_orbit": (WithoutOrbit, False)}
"""Options that are no parameters: annotation and default."""
BUILT_IN = ("controller", "gain_x", "gain_y", "low_pass")
"""Parameters of the built-in law."""


@dataclass(frozen=True)
class ClosedLoopSetup:
    """Closed loop with a controller, dither and hits."""

    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    controller: str = param("1", "Controller: p is proportional feedback of the displacement.", "p", choices=("p",))
    gain_x: float = param("V/m", "Volts of reference x per displacement x; positive pushes outwards.", 0.25e6)
    gain_y: float = param("V/m", "Volts of reference y per displacement y.", 0.22e6)
    low_pass: float = param("Hz", "Bandwidth of the law's low-pass.", 1000.0, above=0, sampled=True)
    bias_x: float = param("V", "Constant reference x.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    bias_y: float = param("V", "Constant reference y.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    dither: float = param("V", "Level of binary references on both axes; 0 for none.", 0.0, low=0, high=REFERENCE_LIMIT)
    hold: float = param("s", "Shortest time between jumps of the dither.", Prbs.hold, above=0, samples=True)
    sequence: int = sequence()
    hit: float = param("N", "Peak of a hammer's hit on the disc every second; 0 for none.", 0.0, low=0)
    hit_angle: float = param("rad", "Direction of the hits.", 0.0)
    law: Path | None = None
    without_orbit: bool = False
    Ts: float = RIG_SAMPLE

    def __post_init__(self) -> None:
        check_parameters(self)
        given = [f.name for f in fields(self) if f.name in BUILT_IN and getattr(self, f.name) != f.default]
        if self.law is not None and given:
            words = ", ".join(f"--{name.replace('_', '-')}" for name in given)
            raise DataError(f"--law: the law of the file replaces the built-in one; leave out {words}")
        drawn = [name for name in ("hold", "sequence") if getattr(self, name) != getattr(Prbs, name)]
        if drawn and not self.dither:
            raise DataError(f"--{drawn[0]}: is of the dither, which is 0; give e.g. --dither '0.3 V'")

    def experiment(self, plant: Plant) -> Controlled:
        """The experiment; the built-in law acts on the displacement from the plant's equilibrium."""
        point = (self.speed, self.pressure, self.duration)
        return Controlled(*point, self.bias_x, self.bias_y, self.controlled_by(plant), self.excitations(), Ts=self.Ts)

    def controlled_by(self, plant: Plant) -> Law | ProportionalLaw | WithHarmonics:
        """The law, with harmonics of the speed where these are asked for."""
        law = self._law(plant)
        if not self.without_orbit:
            return law
        from rotorsim.experiments.orbit import without_orbit

        return without_orbit(plant, law, self.speed, self.pressure)

    def _law(self, plant: Plant) -> Law | ProportionalLaw:
        """The law of the file, or the built-in one."""
        if self.law is not None:
            from rotorsim.control import load_law

            return load_law(self.law)
        from rotorsim.experiments.proportional_law import ProportionalLaw

        centre = plant.equilibrium(self.speed, self.pressure).disc
        return ProportionalLaw(self.gain_x, self.gain_y, self.low_pass, (float(centre[0]), float(centre[1])), self.Ts)

    def excitations(self) -> tuple[Experiment, ...]:
        """Dither and hits."""
        added: list[Experiment] = []
        if self.dither:
            signal = Prbs(
                amplitude=self.dither, duration=self.duration, bias=0.0, hold=self.hold, sequence=self.sequence,
                Ts=self.Ts,
            )  # fmt: skip
            added.append(signal)
        if self.hit:
            added.append(Impact(peak=self.hit, angle=self.hit_angle, hits=max(round(self.duration), 1), Ts=self.Ts))
        return tuple(added)
