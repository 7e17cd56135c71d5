"""Films of a record one by one: name of the bearing, pressures of the snapshots, places where gas enters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.machine import GasFilm, Machine
from rotorsim.report.pages.run import Run


@dataclass(frozen=True)
class FilmPart:
    """A film: pressure (snapshot, theta, z) [Pa, absolute], axial places z [m] from its middle, its entry if known.

    The name is empty for the only film of a record. `feeds` are angle [rad], offset [m] and name of each place where
    gas enters, position [m] that of the film's middle along the shaft.
    """

    name: str
    pressure: xr.DataArray
    z: np.ndarray
    film: GasFilm | None
    feeds: tuple[tuple[float, float, str], ...]

    @property
    def position(self) -> float:
        """Of the film's middle along the shaft [m]; 0 where it is not known."""
        return 0.0 if self.film is None else self.film.position

    @property
    def edge(self) -> float:
        """Half the length that the pressures cover [m]."""
        return float(np.abs(self.z).max())


def film_parts(run: Run) -> tuple[FilmPart, ...]:
    """The films whose pressures a record holds."""
    pressure = run.record["film_pressure"]
    if "bearing" not in pressure.dims:
        return (_part("", pressure, run.record["z"].values, run.machine, 0),)
    names = [str(name) for name in run.record["bearing"].values]
    places = run.record["film_z"].transpose("bearing", "z").values
    return tuple(
        _part(name, pressure.isel(bearing=k), places[k], run.machine, k) for k, name in enumerate(names)
    )  # fmt: skip


def _part(name: str, pressure: xr.DataArray, z: np.ndarray, machine: Machine | None, number: int) -> FilmPart:
    known = machine is not None and number < len(machine.films)
    if machine is None or not known:
        return FilmPart(name, pressure, z, None, ())
    return FilmPart(name, pressure, z, machine.films[number], tuple(feeds(machine, number)))


def feeds(machine: Machine, number: int) -> list[tuple[float, float, str]]:
    """Angle [rad], offset [m] and name of each injector and orifice of a film."""
    pinned = machine.injectors if number == machine.pinned_film else ()
    found = [(i.angle, i.offset, f"injector {k}") for k, i in enumerate(pinned, 1)]
    rows = machine.films[number].orifices
    for row, orifices in enumerate(rows, 1):
        place = f", row {row}" if len(rows) > 1 else ""
        found += [(angle, orifices.offset, f"orifice {k}{place}") for k, angle in enumerate(orifices.angles, 1)]
    return found


def feed_word(machine: Machine | None) -> str:
    """'injectors', 'orifices', both, or nothing where no gas is supplied or the machine is not known."""
    if machine is None:
        return "injectors"
    kinds = (("injectors", machine.pinned_film is not None), ("orifices", machine.orifice_count > 0))
    return " and ".join(name for name, there in kinds if there)
