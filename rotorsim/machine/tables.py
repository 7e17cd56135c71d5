"""Tables of a machine file: rotor, bearings, gas film with injectors, effects, grid and solver, all in SI units."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, InstanceOf, Tag, field_validator

from rotorsim.effects import Effect
from rotorsim.machine import numerics
from rotorsim.machine.bearings import LinearBearing, TableBearing
from rotorsim.machine.gas_film import Actuators, Gas, GasFilm, Injection, PinnedInjector
from rotorsim.machine.numerics import Checked, Grid, Limits, Solver
from rotorsim.machine.part import Part
from rotorsim.machine.probes import AnyProbe
from rotorsim.machine.rotor import Disc, Drive, Probe, Shaft
from rotorsim.machine.values import read_effects


def _kind(bearing: Any) -> str | None:
    kind = bearing.get("kind") if isinstance(bearing, dict) else getattr(bearing, "kind", None)
    return kind if isinstance(kind, str) else None


Bearing = Annotated[
    Annotated[LinearBearing, Tag("linear")]
    | Annotated[TableBearing, Tag("table")]
    | Annotated[GasFilm, Tag("gas_film")],
    Discriminator(_kind),
]


class MachineTables(Part):
    """A rotor on its bearings, each part by itself."""

    name: str = Field(description="Short name.")
    description: str = Field("", description="A sentence about the machine.")
    shaft: Shaft = Field(description="The elastic shaft.")
    discs: tuple[Disc, ...] = Field((), description="Rigid discs on the shaft.")
    bearings: tuple[Bearing, ...] = Field(min_length=1, description="Bearings: gas films, linear ones, tables.")
    gas: Gas = Field(Gas(), description="The gas in film and injectors.")
    injection: Injection | None = Field(None, description="What all injectors have in common.")
    injectors: tuple[PinnedInjector, ...] = Field((), description="The injectors of the gas film.")
    actuators: Actuators | None = Field(None, description="Piezo actuators of the pins; ideal when not given.")
    drive: Drive = Field(Drive(), description="What turns and brakes the shaft.")
    probe: Probe | None = Field(None, description="Where displacement is measured; the first disc when not given.")
    probes: tuple[AnyProbe, ...] = Field((), description="Further probes, at any plane, angle and quantity.")
    grid: Grid = Field(Grid(symmetry="auto"), description="Grid of the gas film.")
    solver: Solver = Field(Solver(), description="Step and tolerances.")
    effects: dict[str, tuple[InstanceOf[Effect], ...]] = Field({}, description="Physical effects by name.")
    limits: Limits | None = Field(None, description="Where a run ends; see `rotorsim.machine.limits`.")
    checked: Checked | None = Field(None, description="Range in which the model was compared with measurements.")
    unusual: tuple[str, ...] = Field((), description="Paths of values that are meant, however unusual.")

    @property
    def films(self) -> tuple[GasFilm, ...]:
        """The gas films, in the order of the bearings."""
        return tuple(b for b in self.bearings if isinstance(b, GasFilm))

    @property
    def film_bearings(self) -> tuple[int, ...]:
        """Indices of the bearings that are gas films."""
        return tuple(i for i, b in enumerate(self.bearings) if isinstance(b, GasFilm))

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Name of every bearing; 'bearing 0' and so on, as the machine file counts them, where it has none."""
        return tuple(b.name or f"bearing {i}" for i, b in enumerate(self.bearings))

    @property
    def film_names(self) -> tuple[str, ...]:
        """Names of the bearings that are gas films."""
        return tuple(self.bearing_names[i] for i in self.film_bearings)

    @property
    def film(self) -> GasFilm | None:
        """The first gas film, if there is one."""
        return next(iter(self.films), None)

    @property
    def pinned_film(self) -> int | None:
        """Number from 0, among the films, of the one that the injectors with pins feed."""
        if not self.injectors or self.injection is None:
            return None
        return 0 if self.injection.bearing is None else self.film_at(self.injection.bearing)

    def film_at(self, bearing: float) -> int | None:
        """Number from 0, among the films, of a bearing; None where no gas film stands there."""
        films = self.film_bearings
        return films.index(int(bearing)) if bearing in films else None

    def film_number(self, effect: Effect) -> int | None:
        """Number from 0, among the films, of the one that an effect is about; None for all films, or none."""
        bearing = getattr(effect, "bearing", None)
        return None if bearing is None else self.film_at(bearing)

    def spring_number(self, effect: Effect) -> int | None:
        """Index of the linear bearing that an effect is about, the first where it names none; None without one."""
        named = getattr(effect, "bearing", None)
        springs = [i for i, b in enumerate(self.bearings) if isinstance(b, LinearBearing) and named in (None, i)]
        return next(iter(springs), None)

    @property
    def supported(self) -> tuple[int, ...]:
        """Indices of the bearings in a housing that moves."""
        return tuple(i for i, bearing in enumerate(self.bearings) if bearing.support is not None)

    def housing_of(self, probe: AnyProbe) -> int | None:
        """Index of the bearing on whose housing a probe is mounted; None where that stands still.

        That is the bearing it names, else the nearest one; a sensor without a position is on the only housing.
        """
        if probe.bearing is not None:
            nearest = int(probe.bearing)
        elif probe.position is None:
            return self.supported[0] if self.supported else None
        else:
            places = [abs(bearing.position - probe.position) for bearing in self.bearings]
            nearest = places.index(min(places))
        return nearest if nearest in self.supported else None

    def film_of(self, effect: Effect) -> GasFilm | None:
        """The film that an effect is about, the first where it is about all."""
        number = self.film_number(effect)
        return self.film if number is None else self.films[number]

    def injector_count(self, effect: Effect) -> int:
        """Number of injectors, orifices included, of the film that an effect is about; the largest of all films."""
        about = self.film_number(effect)
        counts = [
            sum(int(row.count) for row in film.orifices) + (len(self.injectors) if k == self.pinned_film else 0)
            for k, film in enumerate(self.films)
            if about in (None, k)
        ]
        return max(counts, default=0)

    @property
    def orifice_count(self) -> int:
        """Number of orifices without pins of all films."""
        return sum(int(row.count) for film in self.films for row in film.orifices)

    @property
    def fed(self) -> bool:
        """Whether gas is supplied to a film, by injectors or orifices."""
        return bool(self.orifice_count) or self.pinned_film is not None

    @property
    def mass(self) -> float:
        """Mass of shaft and discs [kg]."""
        return self.shaft.mass + sum(d.mass for d in self.discs)

    @property
    def sampling_time(self) -> float:
        """Time [s] between two samples of probes, encoder and laws; see `rotorsim.machine.numerics`."""
        return numerics.sampling_time(self)

    @property
    def time_step(self) -> float:
        """Step [s] of the solver, which divides the sampling time."""
        return numerics.time_step(self)

    @field_validator("effects", mode="before")
    @classmethod
    def _effects(cls, tables: Any) -> Any:
        return read_effects(tables)
