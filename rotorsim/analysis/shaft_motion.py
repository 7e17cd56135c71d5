r"""Motion of the whole shaft: steady whirl under unbalance about the equilibrium of each speed, and mode shapes.

With the modal dynamic stiffness D(s) of rotor and films, linear about the equilibrium at \Omega, and an unbalance me at
the angle \beta of the plane b,

.. math:: \hat q = D(i\Omega)^{-1} B_b^T\, me\,\Omega^2 e^{i\beta} (1, -i)^T, \qquad
          x = \mathrm{Re}(B \hat q e^{i\Omega t})

Source: Friswell et al. (2010), chapter 6, with the film's dynamic stiffness at the frequency of the whirl.
Assumes: small orbits, as the films are linear.  Lifted by: experiments.runup.

Mode shapes are complex at every node; some revolutions of the nonlinear plant can be shown too.

A run passes a critical speed too fast for that response where its acceleration alpha is not small against the square
of the decay: with tau = zeta Omega_c t and beta = alpha / (zeta Omega_c)^2 the amplitude over the steady one at
resonance is

.. math:: a(\tau) = \int_0^\infty e^{-u (1 + i \beta \tau) + i \beta u^2 / 2}\, du

whose largest modulus is .953 at beta = .5, and .90 at 1. Source: Lewis (1932).

Cites: friswell_2010, lewis_1932.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # loads its packages where they are first used

from fe_shaft.modal import half_axes
from fe_shaft.spectrum import NEAR, SMALL
from rotorsim.analysis.axes import checked
from rotorsim.analysis.campbell import crossing_numbers, highest_speed
from rotorsim.analysis.modes_over_speed import at_speed, modes_over_speed
from rotorsim.analysis.supply import felt
from rotorsim.analysis.whirl_onset import LeastDamped
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.base.processes import one_thread
from rotorsim.base.rounding import DAMPED, first_of_largest
from rotorsim.base.units import RIG_SAMPLE, TO_RPM, TO_UM
from rotorsim.effects.rotor.unbalance import RotorUnbalance
from rotorsim.machine.rotor import ShaftProbe
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant
from rotorsim.plant.validity import linear_warnings

if TYPE_CHECKING:
    import xarray as xr

ASIDE = 1e-13
"""Relative distance of a shift from its eigenvalue."""
SAME = 1e-6
"""Relative distance up to which two computed eigenvalues are one."""


def mode_shapes(plant: Plant, speed: float, pressure: float) -> xr.Dataset:
    """The modes next to the first critical speeds, at `speed` [rad/s] and gauge `pressure` [Pa].

    `shape_re`, `shape_im` (mode, node, axis): x = Re(X exp(st)), the largest displacement of a mode is 1; wn [rad/s],
    zeta, whirl by mode; radius [m] of the shaft next to each node; z [m] of the nodes;
    node and radius of the discs. The attributes hold what is known of all modes of the region in which onsets of whirl
    are looked for: `zeta_least`, NaN where none grows but one may be missing, and `not_listed` [rad/s], the frequencies
    of those that are not among the modes listed.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.mode_shapes(plant, 300.0, 0.5e6).sizes["axis"]
    2
    """
    import xarray as xr

    a = plant.assembly
    pressure = float(felt([plant.machine], [pressure])[0])
    model = plant.linearise(speed, pressure)
    reduced, nodes = a.mesh.reduced, a.mesh.nodes
    q = _sharper(model)[: reduced.Phi.shape[1]]
    shape = np.stack([reduced.Phi[axis::4] @ q for axis in range(2)], axis=-1).transpose(1, 0, 2)[:, : len(nodes)]
    shape = over_largest(shape)
    least = LeastDamped.up_to(plant, pressure, highest_speed(plant))
    damping, every = least.certain(model), least.known[-1].values
    every = every[least.region.holds(every)]
    known = (np.abs(every[:, None] - model.eigenvalues) < SAME * np.abs(every)[:, None]).any(axis=1)
    over = ("mode", "node", "axis")
    return xr.Dataset(
        {
            "shape_re": (over, shape.real, {"units": "1", "long_name": "mode shape, real part"}),
            "shape_im": (over, shape.imag, {"units": "1", "long_name": "mode shape, imaginary part"}),
            "wn": ("mode", model.wn, {"units": "rad/s", "long_name": "natural frequency"}),
            "zeta": ("mode", model.zeta, {"units": "1", "long_name": "damping ratio"}),
            "whirl": ("mode", list(model.whirl), {"long_name": "sense of whirl at the disc"}),
        }
        | outline(plant),
        axes(plant),
        plant.provenance() | {
            "kind": "modes", "speed": float(speed), "pressure": pressure, "zeta_least": damping,
            "not_listed": np.abs(every[~known]),
        },
    )  # fmt: skip


def _sharper(model: LinearPlant) -> np.ndarray:
    """Modal displacements (m, modes) after one more inverse iteration.

    What a search for the modes of a film leaves of others, 1e-11, depends on where it began, and a printed shape shows
    it. Modes near one another stay as they are.
    """
    s, vectors, m = model.eigenvalues, model.vectors.copy(), len(model.rotor.stiffness)
    alone = (np.abs(s[:, None] - s) < NEAR * np.abs(s)).sum(axis=0) == 1
    for k in np.flatnonzero(alone & (model.size > SMALL)).tolist():
        vectors[:, k] = model.factor(complex(s[k]) * (1 + ASIDE)).solve(model.times_S(vectors[:, [k]]))[:, 0]
    return np.asarray(vectors[-2 * m : -m])


def over_largest(shapes: np.ndarray) -> np.ndarray:
    """Mode shapes (mode, ...) over their largest component, the first of those equal within rounding."""
    found = [shape.flat[first_of_largest(np.abs(shape).ravel())] for shape in shapes]
    return np.asarray(shapes / np.reshape(found, (-1, *[1] * (shapes.ndim - 1))))


def outline(plant: Plant) -> dict[str, Any]:
    """Radius [m] of the element to the right of each node, at the last one left; node and radius of the discs."""
    mesh, discs = plant.assembly.mesh, [d for d in plant.machine.discs if d.mass > 0]
    radii = [0.5 * layers[-1].odl for layers in mesh.rotor.spans]
    return {
        "radius": (
            "node",
            np.array([*radii, 0.5 * mesh.rotor.spans[-1][-1].odr]),
            {"units": "m", "long_name": "radius of the shaft"},
        ),
        "disc_node": ("disc", [mesh.node(d.seated) for d in discs], {"long_name": "node of the disc"}),
        "disc_radius": ("disc", [(2 * d.polar_inertia / d.mass) ** 0.5 for d in discs], {"units": "m"}),
    }


def axes(plant: Plant) -> dict[str, Any]:
    """Coordinates of the nodes along the shaft and of the two directions."""
    z = ("node", plant.assembly.mesh.nodes, {"units": "m", "long_name": "position along the shaft"})
    return {"z": z, "axis": ["x", "y"]}


def shaft_motion(
    plant: Plant, speed: float, pressure: float = 0.0, settle: float = 0.5, revolutions: float = 1.0, frames: int = 72
) -> xr.Dataset:
    """Displacement of every node, and film pressure, over revolutions at constant speed after `settle`.

    Parameters
    ----------
    plant : Plant
    speed, pressure : float
        Operating point [rad/s], [Pa, gauge]; the shaft must turn.
    settle : float
        Time [s] from the equilibrium until the first frame.
    revolutions : float
        Length, in turns.
    frames : int
        Instants, at most one a sample of 0.2 ms.

    Returns
    -------
    Dataset
        displacement (time, node, axis) [m] from the undeflected line, z and radius (node) [m]; with a gas film
        film_pressure (time, theta, film_z) [Pa, absolute] and `film_radius`, `film_position` [m] as attributes.

    Raises
    ------
    DataError
        If the shaft stands or a length is not above 0.

    Examples
    --------
    >>> import rotorsim as rs
    >>> motion = rs.analysis.shaft_motion(rs.Plant("dtu_gas_bearing"), 500.0, 0.5e6, settle=0.1, frames=12)
    >>> motion["displacement"].dims
    ('time', 'node', 'axis')
    """
    import xarray as xr

    if not speed or settle < 0 or not revolutions > 0 or frames < 1:
        raise DataError(
            f"shaft motion: speed = {speed:g} rad/s, settle = {settle:g} s, {revolutions:g} turns, {frames} frames; "
            "give a turning shaft, lengths above 0 and a frame or more"
        )
    samples = max(round(2 * pi * revolutions / abs(speed) / RIG_SAMPLE), 1)
    at = np.unique(np.linspace(0, samples, frames, endpoint=False).astype(int))
    simulation = plant.start(speed, pressure)
    row = np.array([speed, pressure, 0.0, 0.0, 0.0, 0.0])
    if before := round(settle / RIG_SAMPLE):
        simulation.advance(np.tile(row, (before, 1)))
    a, film, over = plant.assembly, plant.machine.film, ("time", "node", "axis")
    motions, films = [], []
    for steps in np.diff(at, prepend=0):
        if steps:
            simulation.advance(np.tile(row, (steps, 1)))
        q = simulation.w[a.rotor.q :][: a.mesh.reduced.Phi.shape[1]]
        motions.append(np.column_stack([a.mesh.shaft_modes[axis::4] @ q for axis in range(2)])[: len(a.mesh.nodes)])
        if a.film_model is not None:
            films.append(simulation.film_pressure())
    values: dict[str, Any] = {
        "displacement": (over, np.array(motions), {"units": "m", "long_name": "displacement of the shaft"})
    } | outline(plant)
    coords: dict[str, Any] = {"time": ("time", at * RIG_SAMPLE, {"units": "s"})} | axes(plant)
    attrs = plant.provenance() | {"kind": "motion", "speed": float(speed), "pressure": float(pressure)}
    if films and film is not None and a.film_model is not None:
        grid = a.film_model.grid
        where = ("time", "theta", "film_z")
        values["film_pressure"] = (where, np.array(films), {"units": "Pa", "long_name": "film pressure, absolute"})
        coords |= {"theta": ("theta", grid.theta, {"units": "rad"}), "film_z": ("film_z", grid.z, {"units": "m"})}
        attrs |= {"film_radius": grid.radius, "film_position": film.position}
    return xr.Dataset(values, coords, attrs)


GRADE = 2.5e-3
"""Permissible speed of the mass centre [m/s] of balance quality grade G 2.5 (ISO 21940-11)."""
TOO_FAST = 0.5
"""Acceleration over the square of damping ratio times critical speed at which the peak is 5 % below the steady one."""
SWEPT = 0.02
"""Change of the speed over the highest one from which a run passes speeds."""
ENDS = {
    "start": "at the start of the speeds",
    "end": "at the end of the speeds",
    "first steady": "at the first speed at which the machine runs steadily",
    "last steady": "at the last speed at which the machine runs steadily",
    "first carried": "at the first speed that the film carries",
    "last carried": "at the last speed that the film carries",
}
"""Places of a largest response beyond which it may be larger, in words."""


def unbalance_response(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressure: float = 0.0,
    unbalances: Sequence[RotorUnbalance] | None = None,
) -> xr.Dataset:
    """Amplitude and phase over the speeds (n,) [rad/s] at a gauge supply pressure [Pa], about the static equilibrium.

    Parameters
    ----------
    plant : Plant
    speeds : array (n,)
        Shaft speeds [rad/s], ascending.
    pressure : float
        Supply pressure [Pa, gauge].
    unbalances : sequence of RotorUnbalance, optional
        By default those of the machine, or one of grade G 2.5 at the highest speed where it has none.

    Returns
    -------
    Dataset
        response_re, response_im (speed, place, axis) [m, 0-pk], major (speed, place) [m], the larger half axis of the
        orbit, zeta_least (speed); NaN where the film does not carry, zeta_least also where no mode grows but one may be
        missing. Places are the measuring plane, discs, bearings
        and shaft probes, with their positions z [m]. The attribute `warnings`, where there is one, holds a sentence a
        line about speeds beyond the tables of bearings or the checked range, at which a mode grows, and that the film
        does not carry. The attribute `pressure` is 0 for a machine without feed.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.unbalance_response(plant, [200.0, 400.0], 0.5e6)
    >>> found["major"].dims
    ('speed', 'place')
    """
    import xarray as xr

    speeds = checked("response: speeds [rad/s]", speeds)
    pressure = float(felt([plant.machine], [pressure])[0])
    unbalances = (
        tuple(unbalances) if unbalances is not None else unbalances_of(plant.machine, float(np.abs(speeds).max()))
    )
    places = measuring_places(plant)
    least = LeastDamped.up_to(plant, pressure, float(np.abs(speeds).max()))
    zeta, stiffness = np.full(len(speeds), np.nan), list[np.ndarray | None]()
    for k, model in enumerate(map(at_speed(plant, pressure), speeds.tolist())):  # one at a time: each has a film
        stiffness.append(None if model is None else synchronous_stiffness(model))
        zeta[k] = np.nan if model is None else least.certain(model)
    carried = np.array([one is not None for one in stiffness])
    response = whirl(plant, stiffness, speeds, unbalances, tuple(places.values()))
    major, _ = half_axes(response[..., 0], response[..., 1])
    over = ("speed", "place", "axis")
    metres = {"units": "m", "long_name": "response, 0-pk"}
    return xr.Dataset(
        {
            "response_re": (over, response.real, metres | {"long_name": "response, real part, 0-pk"}),
            "response_im": (over, response.imag, metres | {"long_name": "response, imaginary part, 0-pk"}),
            "major": (over[:2], major, metres | {"long_name": "major half axis of the orbit"}),
            "zeta_least": ("speed", zeta, {"units": "1", "long_name": "least damping ratio"}),
        },
        {
            "speed": ("speed", speeds, {"units": "rad/s", "long_name": "speed of the shaft"}),
            "place": list(places),
            "axis": ["x", "y"],
            "z": ("place", list(places.values()), {"units": "m", "long_name": "position along the shaft"}),
        },
        plant.provenance() | linear_warnings(plant, speeds, zeta, pressure, carried) | {
            "kind": "response", "pressure": pressure, "unbalance": describe(plant.machine, unbalances),
        },
    )  # fmt: skip


def synchronous_stiffness(model: LinearPlant) -> np.ndarray:
    """Modal dynamic stiffness (m, m) at the frequency of the model's speed."""
    with one_thread():
        return model.dynamic_stiffness(1j * model.speed)


def whirl(
    plant: Plant, stiffness: Sequence[np.ndarray | None], speeds: np.ndarray, unbalances: Sequence[RotorUnbalance],
    places: Sequence[float],
) -> np.ndarray:  # fmt: skip
    """Complex displacements (speeds, places, 2) [m, 0-pk] at speeds (n,) [rad/s]; the motion is Re(x exp(i speed t)).

    NaN at speeds whose synchronous stiffness (m, m) is None.
    """
    mesh = plant.assembly.mesh
    load = np.zeros(mesh.shape_between(mesh.probe).shape[1], complex)
    for one in unbalances:
        load += one.me * np.exp(1j * one.phase) * (mesh.shape_between(plane(plant, one), True).T @ np.array([1, -1j]))
    q = driven(stiffness, speeds, load[:, None])[:, :, 0]
    return np.stack([q @ mesh.shape_between(z).T for z in places], axis=1)


def driven(stiffness: Sequence[np.ndarray | None], speeds: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Modal displacements (speeds, m, k) at speeds (n,) [rad/s] under loads (m, k) times the square of the speed.

    NaN at speeds whose synchronous stiffness (m, m) is None.
    """
    q = np.full((len(speeds), *loads.shape), np.nan, complex)
    known = np.array([k for k, one in enumerate(stiffness) if one is not None], int)
    if known.size:
        with one_thread():
            D = np.array([one for one in stiffness if one is not None])
            padded = np.pad(loads, ((0, D.shape[1] - len(loads)), (0, 0)))
            q[known] = np.linalg.solve(D, speeds[known, None, None] ** 2 * padded)[:, : len(loads)]
    return q


def plane(plant: Plant, unbalance: RotorUnbalance) -> float:
    """Position [m] of an unbalance along the shaft."""
    return plant.assembly.mesh.place(unbalance)


def measuring_places(plant: Plant) -> dict[str, float]:
    """Positions [m] at which the response is read, by name."""
    machine = plant.machine
    found = {"measuring plane": plant.assembly.mesh.probe}
    found |= {name: disc.position for name, disc in zip(machine.disc_names, machine.discs, strict=True)}
    bearings = zip(machine.bearings_in_words, machine.bearings, strict=True)
    found |= {name.removeprefix("the "): bearing.position for name, bearing in bearings}
    return found | {p.name: p.position for p in machine.probes if isinstance(p, ShaftProbe)}


def peak_of(found: xr.Dataset, place: str) -> dict[str, Any] | None:
    """Largest response of a result at a place where no mode grows; None where there is none.

    um [0-pk], rpm, and `at_end`, a key of `ENDS` where it may be larger beyond, else "": it lies at an end of the
    speeds, or next to a speed at which a mode grows or that the film does not carry.
    """
    grows = found["zeta_least"].values < -DAMPED
    sizes = np.where(grows, np.nan, found["major"].sel(place=place).values)
    if not np.isfinite(sizes).any():
        return None
    k, speeds = int(np.nanargmax(sizes)), found["speed"].values
    return {"um": float(sizes[k]) * TO_UM, "rpm": float(speeds[k]) * TO_RPM, "at_end": _end(speeds, sizes, grows, k)}


def _end(speeds: np.ndarray, sizes: np.ndarray, grows: np.ndarray, k: int) -> str:
    """Key of `ENDS` for the place k of a largest response; "" where responses are known on both sides of it."""
    for near in (k - 1, k + 1):
        if 0 <= near < len(speeds) and np.isnan(sizes[near]):
            limit = "last" if abs(speeds[near]) > abs(speeds[k]) else "first"
            return f"{limit} {'steady' if grows[near] else 'carried'}"
    if len(speeds) == 1:
        return ""
    return "start" if k == 0 else "end" if k == len(speeds) - 1 else ""


def passed_too_fast(plant: Plant, record: xr.Dataset, pressure: float = 0.0) -> str:
    """Sentence on the critical speed that a run passes most too fast for its steady response; empty without one.

    Commands keep it as the record's attribute `passed_too_fast`, which pages and summaries state.

    Parameters
    ----------
    plant : Plant
    record : Dataset
        With `speed` [rad/s] over `time` [s].
    pressure : float
        Gauge supply pressure [Pa].

    Examples
    --------
    >>> import rotorsim as rs
    >>> rotor = rs.Plant("plain_rotor")
    >>> run = rs.experiments.runup(rotor, start=260.0, stop=290.0, rate=3000.0)
    >>> rs.analysis.passed_too_fast(rotor, run).split(",")[0]
    '2647 rpm'
    """
    speed, time = (np.asarray(record[name].values, float) for name in ("speed", "time"))
    low, high = float(np.abs(speed).min()), float(np.abs(speed).max())
    if high - low < SWEPT * high:
        return ""
    found = crossing_numbers(modes_over_speed(plant, [low, high], pressure, orders=(1,)).crossings)
    passed, rates = found[(found[:, 0] > low) & (found[:, 0] < high) & (found[:, 1] > 0), :2], np.gradient(speed, time)
    rate = np.array([abs(rates[np.abs(np.abs(speed) - at).argmin()]) for at, _ in passed])
    slow = TOO_FAST * np.prod(passed, axis=1) ** 2
    if not (rate > slow).any():
        return ""
    k = int((rate / slow).argmax())
    return (
        f"{passed[k, 0] * TO_RPM:.0f} rpm, a critical speed with a damping ratio of {passed[k, 1]:.3g}, is passed at "
        f"{rate[k] * TO_RPM:.4g} rpm/s: above {slow[k] * TO_RPM:.3g} rpm/s the peak is over 5 % below the steady one"
    )


def unbalances_of(machine: Machine, highest: float) -> tuple[RotorUnbalance, ...]:
    """The machine's own unbalances, or one of grade G 2.5 at the `highest` speed [rad/s] where it has none."""
    own = tuple(e for e in machine.effects.get("unbalance", ()) if isinstance(e, RotorUnbalance) and e.me > 0)
    if own:
        return own
    if not highest:
        raise DataError("response: a shaft at rest has no residual unbalance; give one or a highest speed above 0")
    return (RotorUnbalance(me=GRADE * machine.mass / abs(highest)),)


def describe(machine: Machine, unbalances: Sequence[RotorUnbalance]) -> str:
    """The unbalances in words."""
    if not unbalances:
        return "none"
    own = machine.effects.get("unbalance", ())
    source = "of the machine file" if set(unbalances) <= set(own) else "given, or of grade G 2.5 (ISO 21940-11)"
    return f"{', '.join(f'{one.me * 1e6:.4g} g mm' for one in unbalances)}, {source}"


def largest_response(
    plant: Plant, pressure: float, highest: float, unbalances: Sequence[RotorUnbalance], count: int = 24
) -> tuple[float, float]:
    """Largest major half axis [m, 0-pk] at the measuring plane up to the `highest` speed, and that speed [rad/s].

    Speeds at which a mode grows, without a steady response, are left out. Around every local maximum of `count` equal
    steps the least 1/size^2, near a resonance a parabola over the speed, is searched: however sharp a peak is, its
    height is found. NaN where no speed carries or is stable.
    """
    z, least = (plant.assembly.mesh.probe,), LeastDamped.up_to(plant, pressure, highest)

    def size(speed: float) -> float:
        try:
            model = plant.linearise(speed, pressure)
        except NoLiftOffError:
            return float("nan")
        if least.among(model)[0] < -DAMPED:
            return float("nan")
        return float(
            half_axes(*whirl(plant, [synchronous_stiffness(model)], np.array([speed]), unbalances, z)[0, 0])[0]
        )

    def flatness(speed: float) -> float:
        found = size(speed)
        return found**-2 if found > 0 else float("inf")

    speeds = np.linspace(highest / count, highest, count)
    flat = np.array([flatness(v) for v in speeds.tolist()])
    found = list(zip(flat.tolist(), speeds.tolist(), strict=True))
    around = np.concatenate([[np.inf], flat, [np.inf]])
    for k in np.flatnonzero((flat < around[:-2]) & (flat <= around[2:])).tolist():
        span = (speeds[max(k - 1, 0)], speeds[min(k + 1, count - 1)])
        peak = scipy.optimize.minimize_scalar(
            flatness, bounds=span, method="bounded", options={"xatol": 1e-6 * highest, "maxiter": 40}
        )
        found.append((float(peak.fun), float(peak.x)))
    least_flat, at = min(found)
    return (least_flat**-0.5, at) if np.isfinite(least_flat) else (float("nan"), float("nan"))
