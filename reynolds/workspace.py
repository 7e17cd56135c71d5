"""Film constants for the kernels: parameter record, index arrays and flat workspace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reynolds.grid import FilmError, FilmGrid, Layout, Texture, cells, fill, make_layout
from reynolds.injector import LAWS, Footprint, Injector, footprint, nozzle_coefficients
from reynolds.sleeve import PLAIN, Sleeve, fill_texture, stretches

CONSTANTS = (
    "mu", "mean_free_path", "radius", "dy", "dz", "pa", "area", "source", "clearance", "h_min", "uneven", "bend_time",
    "grooved", "recessed", "wide", "lobe", "stretches", "jumps", "strip",
)  # fmt: skip
FILM_DTYPE = np.dtype([(name, "f8") for name in CONSTANTS])


def at_cache_line(size: int) -> np.ndarray:
    """`size` zeros that begin at a multiple of 64 bytes: elsewhere a vector of eight is read from two cache lines."""
    room = np.zeros(size + 8)
    begin = -(room.ctypes.data // 8) % 8
    return room[begin : begin + size]


@dataclass(frozen=True)
class FilmGas:
    """Viscosity [Pa s], ambient pressure [Pa], temperature [K], gas constant [J/(kg K)], heat capacity ratio [1].

    A mean free path [m] at ambient pressure of 0 is a gas that does not slip.
    """

    viscosity: float = 1.85e-5
    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05
    heat_capacity_ratio: float = 1.4
    mean_free_path: float = 0.0


@dataclass(frozen=True)
class FilmModel:
    """Grid, gas, clearance [m] and injectors of one film, and how they fill a workspace.

    Forms of the sleeve that leave the gap as it is are no forms.
    """

    grid: FilmGrid
    clearance: float
    gas: FilmGas = FilmGas()
    injectors: tuple[Injector, ...] = ()
    h_min: float = 2.5e-7
    sleeve: Sleeve = PLAIN

    def __post_init__(self) -> None:
        if self.clearance <= 0:
            raise FilmError(f"clearance = {self.clearance} m: must be positive")
        if len({injector.law for injector in self.injectors}) > 1:
            raise FilmError("injectors: all must have the same law")
        if self.grid.half and not self.sleeve.symmetric:
            raise FilmError("grooves: a spiral is not symmetric about the midplane; use symmetric=False")
        reach = max((abs(one.offset) + one.orifice_diameter / 2 for one in self.injectors), default=0.0)
        for path, why in self.sleeve.unfed(reach) if self.injectors else ():
            raise FilmError(f"{path}: {why}", argument="injectors")
        if self.grid.half and any(injector.offset != 0 for injector in self.injectors):
            raise FilmError("injectors: one is off the midplane, so the film is not symmetric; use symmetric=False")
        object.__setattr__(self, "sleeve", self.sleeve.effective)

    @property
    def law(self) -> int:
        """0 for the orifice, 1 for the loss-factor form."""
        return LAWS.index(self.injectors[0].law) if self.injectors else 0

    def record(self) -> np.recarray:
        """Constants of the film as a one-element record array (its row has the constants as attributes)."""
        grid, gas = self.grid, self.gas
        rt = gas.gas_constant * gas.temperature
        area = grid.dy * grid.dz * (2 if grid.half else 1)
        sleeve = self.sleeve
        uneven = float(np.abs(sleeve.height(grid.theta, self.clearance)).max())
        bend_time = 0.0 if sleeve.foil is None else sleeve.foil.time
        grooved = 1.0 if sleeve.grooves is None else sleeve.grooves.sense
        row = (
            gas.viscosity, gas.mean_free_path, grid.radius, grid.dy, grid.dz, gas.ambient_pressure, area,
            rt / (grid.dy * grid.dz), self.clearance, self.h_min, uneven, bend_time, grooved,
            float(sleeve.recesses(grid.length) != ()), *sleeve.arc(self.clearance), len(self.stretches),
            self.stretches[:, -1].sum(), self.strip,
        )  # fmt: skip
        return np.array([row], FILM_DTYPE).view(np.recarray)

    @property
    def strip(self) -> float:
        """Deflection of a strip of bumps [m/Pa] by a node's share of the mean pressure along it; 0 without strips."""
        foil, grid = self.sleeve.foil, self.grid
        if foil is None or foil.bumps == "points":
            return 0.0
        return grid.dz * (2 if grid.half else 1) / (grid.length * foil.stiffness)

    @cached_property
    def stretches(self) -> np.ndarray:
        """Smooth stretches (n, STRETCH) round the sleeve."""
        return stretches(self.sleeve, self.grid, self.clearance)

    def build(self) -> tuple[Layout, np.ndarray, np.ndarray]:
        """Layout, the workspace (float64) with constants filled in, and the index array (int64)."""
        return build_films([self])

    def fill(self, w: np.ndarray, ix: np.ndarray, layout: Layout, prints: Sequence[Footprint]) -> None:
        """Write the film's constants into its parts of workspace and index array."""
        w[layout.mu] = self.gas.viscosity
        w[layout.slip] = 6 * self.gas.mean_free_path * self.gas.ambient_pressure
        self._fill_geometry(w, layout)
        self._fill_footprints(w, ix, layout, prints)
        self._fill_injectors(w, layout)

    def _fill_geometry(self, w: np.ndarray, layout: Layout) -> None:
        grid = self.grid
        shape = (grid.n_theta, grid.n_rows)
        theta = grid.theta[:, None]
        for offset, line in ((layout.cos, np.cos(grid.theta)), (layout.sin, np.sin(grid.theta))):
            fill(w, offset, layout, np.broadcast_to(line[:, None], shape), line)
        weight = np.ones(shape)
        if grid.half:
            weight[:, 0] = 0.5
        fill(w, layout.weight, layout, weight, 0.0)
        fill(w, layout.per_weight, layout, 1 / weight, 0.0)
        inside = cells(layout)
        area = float(self.record()["area"][0])
        w[layout.force_x + inside] = -area * weight * np.cos(theta)
        w[layout.force_y + inside] = -area * weight * np.sin(theta)
        fill(w, layout.link, layout, np.ones(shape), 0.0)
        if not grid.half:
            lines = layout.link + layout.first + np.arange(-1, grid.n_theta + 1) * layout.stride
            w[lines + grid.n_rows + 1] = 1.0
        gap = self.clearance + self.sleeve.height(grid.theta, self.clearance)
        for offset in (layout.form, layout.clearance, layout.h):
            fill(w, offset, layout, np.broadcast_to(gap[:, None], shape), gap)
        for offset in (layout.p, layout.p_1, layout.p_2, layout.p_3):
            fill(w, offset, layout, np.full(shape, self.gas.ambient_pressure), self.gas.ambient_pressure)
        w[layout.stretches : layout.stretches + self.stretches.size] = self.stretches.ravel()
        if layout.foil and self.sleeve.foil is not None and self.sleeve.foil.bumps == "points":
            w[layout.soft : layout.soft + layout.length] = 1 / self.sleeve.foil.stiffness
        if layout.textured:
            fill_texture(w, layout, grid, self.sleeve, self.clearance)
        if layout.strips:
            self._fill_strips(w, layout)

    def _fill_strips(self, w: np.ndarray, layout: Layout) -> None:
        """Keep the weights of the force; where strips carry, the edges stand for the ambient pressure on every line."""
        inside = cells(layout)
        for force, whole in ((layout.force_x, layout.whole_x), (layout.force_y, layout.whole_y)):
            w[force + inside[:, -1] + 1] = -w[force + inside].sum(axis=1)
            w[whole : whole + layout.length] = w[force : force + layout.length]

    def _fill_footprints(self, w: np.ndarray, ix: np.ndarray, layout: Layout, prints: Sequence[Footprint]) -> None:
        index = cells(layout)
        sources, readers = [p.source for p in prints], [p.reader for p in prints]
        for lists, offset in (
            (sources, layout.source_weight),
            (readers, layout.reader_weight),
            ([p.plain for p in prints], layout.plain_weight),
        ):
            flat = [value for entries in lists for _, _, value in entries]
            w[offset : offset + len(flat)] = flat
        w[layout.beta : layout.beta + len(prints)] = [p.beta for p in prints]
        share = 2 if self.grid.half else 1
        for k, entries in enumerate(sources):
            w[layout.inj_cos + k] = share * sum(v * np.cos(self.grid.theta[i]) for i, _, v in entries)
            w[layout.inj_sin + k] = share * sum(v * np.sin(self.grid.theta[i]) for i, _, v in entries)
        for lists, begin, cell in (
            (sources, layout.source_start, layout.source_cell),
            (readers, layout.reader_start, layout.reader_cell),
        ):
            ends = np.cumsum([0] + [len(entries) for entries in lists])
            # an injector that is not there has no cells
            ix[begin : begin + layout.n_inj + 1] = np.concatenate([ends, np.full(layout.n_inj - len(lists), ends[-1])])
            ix[cell : cell + ends[-1]] = [index[i, j] for entries in lists for i, j, _ in entries]

    def _fill_injectors(self, w: np.ndarray, layout: Layout) -> None:
        gas = self.gas
        table = nozzle_coefficients(gas.heat_capacity_ratio, gas.gas_constant, gas.temperature)
        w[layout.nozzle : layout.nozzle + table.size] = table
        rt = gas.gas_constant * gas.temperature
        p = gas.ambient_pressure
        # where another film has an injector that this one lacks: a closed chamber at ambient pressure
        w[layout.capacity : layout.capacity + layout.n_inj] = 1e-15
        w[layout.pin_conductance : layout.pin_conductance + layout.n_inj] = 1e-15
        for offset in (layout.plenum, layout.supply, layout.plenum_1, layout.plenum_2, layout.plenum_3):
            w[offset : offset + layout.n_inj] = p
        for k, injector in enumerate(self.injectors):
            w[layout.curtain + k] = injector.curtain_discharge * np.pi * injector.orifice_diameter
            w[layout.capacity + k] = injector.plenum_volume / (injector.polytropic_exponent * rt)
            w[layout.pin_conductance + k] = injector.conductance(injector.pin)


def build_films(films: Sequence[FilmModel]) -> tuple[Layout, np.ndarray, np.ndarray]:
    """Layout that all films share, their workspace (float64), film after film, and their index array (int64).

    Raises FilmError for films whose grids or laws are of different kinds.
    """
    first = films[0]
    if len({(f.grid.n_theta, f.grid.n_rows, f.grid.half) for f in films}) > 1:
        raise FilmError("films: all must have grids of the same size")
    laws = {f.law for f in films if f.injectors}
    if len(laws) > 1:
        raise FilmError("injectors: all must have the same law")
    if len({f.sleeve.foil.bumps for f in films if f.sleeve.foil is not None}) > 1:
        raise FilmError("foils: all must have the same kind of bumps; give all points or all strips", argument="foils")
    prints = [[footprint(film.grid, injector) for injector in film.injectors] for film in films]
    count = max(len(p) for p in prints)
    sources = _largest([[len(one.source) for one in p] for p in prints], count)
    readers = _largest([[len(one.reader) for one in p] for p in prints], count)
    layout = make_layout(
        first.grid, sources, readers,
        foil=any(f.sleeve.foil is not None for f in films), strips=any(f.strip > 0 for f in films),
        texture=_texture([f.sleeve for f in films]),
        edges=max(len(f.stretches) for f in films) - first.grid.n_theta,
    )  # fmt: skip
    w = np.zeros(len(films) * layout.size)
    ix = np.zeros(len(films) * layout.n_integers, np.int64)
    for k, (film, own) in enumerate(zip(films, prints, strict=True)):
        part = slice(k * layout.size, (k + 1) * layout.size)
        film.fill(w[part], ix[k * layout.n_integers : (k + 1) * layout.n_integers], layout, own)
        w[part][layout.law] = max(laws, default=0)
    return layout, w, ix


def _texture(sleeves: Sequence[Sleeve]) -> Texture | None:
    """Texture that all sleeves together need; None for smooth ones."""
    if not any(sleeve.textured for sleeve in sleeves):
        return None
    return Texture(
        max(len(sleeve.steps) for sleeve in sleeves),
        any(sleeve.grooves is not None for sleeve in sleeves),
        any(sleeve.jumps for sleeve in sleeves),
    )


def _largest(sizes: Sequence[Sequence[int]], count: int) -> list[int]:
    """Sizes of `count` injectors with room for each film's own, whose sums may differ."""
    if len(sizes) == 1:
        return list(sizes[0])
    largest = max(map(sum, sizes))
    return [largest, *[0] * (count - 1)] if count else []


def nodal_pressure(model: FilmModel, layout: Layout, w: np.ndarray) -> np.ndarray:
    """Pressure (n_theta, n_z + 1) at the nodes over the full length, edges included."""
    p = w[layout.p + cells(layout)]
    edge = np.full((layout.n_theta, 1), model.gas.ambient_pressure)
    if model.grid.half:
        return np.hstack([edge, p[:, :0:-1], p, edge])
    return np.hstack([edge, p, edge])


def interval_pressure(model: FilmModel, layout: Layout, w: np.ndarray) -> np.ndarray:
    """Pressure (n_theta, n_z): mean of the two nodes that bound each interval in z."""
    nodes = nodal_pressure(model, layout, w)
    return np.asarray(0.5 * (nodes[:, 1:] + nodes[:, :-1]))
