"""Campbell diagram, critical speeds and safe region of the coupled machine, from its modes followed over the speed.

All modes of film and rotor below a frequency and with a damping ratio below one half are followed, their number proven
at every speed; which of them are shown is a choice afterwards. A critical speed is a crossing of a natural frequency
with an order line, in either direction, solved with the linear model at that speed.

A point is safe where the shaft is lifted, every mode damped and the next critical speed at least 15 % away (thesis).
A crossing of a natural frequency with the speed counts as one where it amplifies, 1 / (2 zeta) of 2.5 or more;
API 684 calls one below that critically damped and asks for no margin. Crossings count whichever way the natural
frequency crosses and the mode whirls, since bearings and supports that are not isotropic answer to both. They are
looked for around each speed as far as they matter to it, beyond the ends of the map too. Where the film carries only on
a part of that, or the number of modes is not proven, a point that is not found unsafe is not known: NaN.

Cites: api_684, thesis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_shaft import BearingElement, Rotor
from fe_shaft.crossings import Crossing
from rotorsim.analysis.axes import checked
from rotorsim.analysis.modes_over_speed import MARGIN, ORDERS, ModesOverSpeed, modes_over_speed, roundness
from rotorsim.analysis.supply import felt
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError
from rotorsim.base.rounding import DAMPED, whirl_sense
from rotorsim.base.units import RPM, TO_HZ, TO_RPM
from rotorsim.machine.limits import speed_limit
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant
from rotorsim.plant.validity import linear_warnings

if TYPE_CHECKING:
    import xarray as xr

HIGHEST, ABOVE = 40e3 * RPM, 4.0
"""Speed [rad/s] up to which critical speeds are searched at least, and over the rotor's first natural frequency."""
PAST_WHIRL = 3.0
"""Top of the default speeds over the rotor's first natural frequency: a film whirls at half the speed or slower."""


def campbell(plant: Plant, speeds: Sequence[float] | np.ndarray, pressure: float = 0.0, modes: int = 8) -> xr.Dataset:
    """Modes over the speeds (n,) [rad/s], at a gauge supply pressure [Pa] for machines with a film.

    Parameters
    ----------
    plant : Plant
    speeds : array (n,)
        Ascending [rad/s].
    pressure : float
        Supply pressure [Pa, gauge].
    modes : int
        How many branches are shown, those of the lowest frequencies; fewer where the region holds fewer.

    Returns
    -------
    Dataset
        Over branch and speed wn [rad/s], zeta, log_dec, whirl_ratio and whirl (forward as the shaft turns), NaN where
        the branch is outside the region or the film does not carry; `begins` and `ends` say why. Over speed the
        numbers of modes in the region, of those `missing` among them (0: proven, NaN: not carried or not proven) and of
        others met beyond its limit of damping (`damped`), and `zeta_least` of all.
        Over critical, of all branches by order and speed: critical_speed [rad/s], critical_order, critical_direction
        (-1 where the natural frequency falls below the line, 1 where it rises above), critical_zeta,
        critical_amplification 1 / (2 zeta), critical_whirl and critical_branch. The attributes hold the region and the
        searched range of speeds, which reaches beyond the asked one by 15 %.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> found["wn"].shape
    (4, 3)
    """
    import xarray as xr

    speeds = checked("campbell: speeds [rad/s]", speeds)
    if modes < 1:
        raise DataError(f"campbell: {modes} modes; give 1 or more")
    pressure = float(felt([plant.machine], [pressure])[0])
    found = modes_over_speed(plant, speeds, pressure, least=modes)
    values, senses, shown = along_speeds(found, speeds, modes)
    wn = np.abs(values)
    zeta = -values.real / wn
    over = ("branch", "speed")
    counts = np.array([_counts(found, float(v)) for v in speeds])
    branches = [found.followed.branches[b] for b in shown]
    least = [found.least(v) for v in speeds.tolist()]
    return xr.Dataset(
        {
            "wn": (over, wn, {"units": "rad/s", "long_name": "natural frequency"}),
            "zeta": (over, zeta, {"units": "1", "long_name": "damping ratio"}),
            "log_dec": (over, 2 * np.pi * zeta / np.sqrt(1 - zeta**2), {"units": "1", "long_name": "log. decrement"}),
            "whirl_ratio": (over, senses, {"units": "1", "long_name": "roundness of the orbit, 1 forward"}),
            "whirl": (over, whirl_sense(senses), {"long_name": "sense of whirl"}),
            "begins": ("branch", [b.begins for b in branches], {"long_name": "where the branch begins"}),
            "ends": ("branch", [b.ends for b in branches], {"long_name": "where the branch ends"}),
            "modes": ("speed", counts[:, 0], {"units": "1", "long_name": "modes in the region"}),
            "missing": ("speed", counts[:, 1], {"units": "1", "long_name": "modes in the region that are not found"}),
            "damped": ("speed", counts[:, 2], {"units": "1", "long_name": "modes met beyond the limit of damping"}),
            "zeta_least": ("speed", least, {"units": "1", "long_name": "least damping ratio of all modes"}),
        }
        | criticals(found, shown),
        {
            "speed": ("speed", speeds, {"units": "rad/s", "long_name": "speed of the shaft"}),
            "branch": np.arange(1, len(shown) + 1),
        },
        plant.provenance() | linear_warnings(plant, speeds, least, pressure)
        | {"kind": "campbell", "pressure": pressure, "asked": modes} | about(found),
    )  # fmt: skip


def along_speeds(found: ModesOverSpeed, speeds: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Eigenvalues and roundness (shown, speed) of the branches with the lowest frequencies, and their numbers."""
    followed, place = found.followed, {float(v): k for k, v in enumerate(speeds)}
    every = np.full((len(followed.branches), len(speeds)), np.nan, complex)
    senses = np.full(every.shape, np.nan)
    number = [dict(branch.places) for branch in followed.branches]
    for i, node in enumerate(followed.nodes):
        if node.at not in place or node.pencil is None:
            continue
        modes = found.own(node)
        s, orbits = modes.values, roundness(node.pencil, modes)
        inside = found.region.holds(s)
        for b in (b for b, one in enumerate(number) if i in one and inside[one[i]]):
            every[b, place[node.at]], senses[b, place[node.at]] = s[number[b][i]], orbits[number[b][i]]
    seen = [b for b in range(len(every)) if np.isfinite(every[b]).any()]
    shown = sorted(seen, key=lambda b: float(np.nanmin(np.abs(every[b]))))[:count]
    return every[shown], senses[shown], shown


def _counts(found: ModesOverSpeed, speed: float) -> tuple[float, float, float]:
    """Modes in the region at a speed [rad/s], those missing among them, and others met beyond the limit of damping."""
    node = found.node(speed)
    if node.pencil is None:
        return float("nan"), float("nan"), float("nan")
    s, region = node.modes.values, found.region
    beyond = replace(region, zeta=1.0).holds(s) & ~region.holds(s)
    return float(region.holds(s).sum()), node.modes.missing, float(beyond.sum())


def crossing_numbers(crossings: Sequence[Crossing]) -> np.ndarray:
    """Numbers (k, 5) of crossings: speed [rad/s], damping ratio, direction, frequency [rad/s], roundness of the orbit.

    The direction is 1 where the natural frequency rises above the line and -1 where it falls below.
    """
    rows = []
    for one in crossings:
        s = complex(one.modes.values[0])
        orbit = float(roundness(one.pencil, one.modes)[0])
        rows.append((one.at, -s.real / abs(s), 1.0 if one.upward else -1.0, abs(s), orbit))
    return np.array(rows).reshape(-1, 5)


def criticals(found: ModesOverSpeed, shown: Sequence[int] = ()) -> dict[str, Any]:
    """Variables of the critical speeds, over critical; `shown` are the branches with the first numbers."""
    every = found.crossings
    speed, zeta, direction, _, ratio = crossing_numbers(every).T
    rest = [b for b in range(len(found.followed.branches)) if b not in shown]
    number = {b: k for k, b in enumerate([*shown, *rest], 1)}
    with np.errstate(divide="ignore"):
        amplification = np.where(zeta > 0, 1 / (2 * zeta), np.inf)
    over = ("critical",)
    return {
        "critical_speed": (over, speed, {"units": "rad/s", "long_name": "critical speed"}),
        "critical_order": (over, np.array([c.order for c in every], int), {"units": "1", "long_name": "order"}),
        "critical_direction": (
            over, direction.astype(int),
            {"units": "1", "long_name": "natural frequency leaves the line, 1 upwards"},
        ),
        "critical_zeta": (over, zeta, {"units": "1", "long_name": "damping ratio at the critical speed"}),
        "critical_amplification": (
            over, amplification, {"units": "1", "long_name": "amplification factor 1/(2 zeta), inf where it grows"},
        ),
        "critical_whirl": (over, whirl_sense(ratio), {"long_name": "sense of whirl at the critical speed"}),
        "critical_branch": (over, np.array([number[c.branch] for c in every], int), {"long_name": "branch"}),
    }  # fmt: skip


def about(found: ModesOverSpeed) -> dict[str, Any]:
    """Attributes: region, searched speeds, intervals that were not looked at, and whether the modes are proven."""
    region, nodes = found.region, [n for n in found.followed.nodes if n.pencil is not None]
    (low, high), slowest = found.searched, found.region.floor / min(found.orders)
    return {
        "region_reach": region.reach, "region_floor": region.floor, "region_zeta": region.zeta,
        "searched_from": max(low, slowest) if low >= 0 else low,
        "searched_to": min(high, -slowest) if high <= 0 else high,
        "not_looked_at": np.array(found.refused, float).ravel(),
        "not_certain": np.array(found.uncertain, float).ravel(),
        "nodes": len(nodes), "nodes_proven": len(nodes) - len(found.unproven),
    }  # fmt: skip


def critical_rows(found: xr.Dataset) -> list[tuple[int, float, str, float, str, int]]:
    """Critical speeds of a diagram: order, speed [rpm], how a natural frequency passes it, damping, whirl, branch."""
    names = ("order", "speed", "direction", "zeta", "whirl", "branch")
    columns = [found[f"critical_{name}"].values.tolist() for name in names]
    return [
        (int(order), speed * TO_RPM, "rises above" if direction > 0 else "falls below", zeta, str(whirl), int(branch))
        for order, speed, direction, zeta, whirl, branch in zip(*columns, strict=True)
    ]


def modes_line(found: xr.Dataset) -> str:
    """Sentence on the number of modes in the region of a Campbell diagram, and at how many speeds it is proven."""
    (counts, missing, damped), attrs = (found[name].values for name in ("modes", "missing", "damped")), found.attrs
    carried = np.isfinite(counts)
    if not carried.any():
        return "none: the film carries the rotor at no speed"
    low, high = (_nice(attrs[name] * TO_HZ) for name in ("region_floor", "region_reach"))
    text = (
        f"{_between(counts)} with a damping ratio below {attrs['region_zeta']:g}, searched from {low} to {high} Hz, "
        f"proven to be all of them at {int((missing == 0).sum())} of {len(counts)} speeds"
    )
    if found.sizes["branch"] >= attrs["asked"]:
        return text
    beyond = f"; at least {_between(damped)} with more damping are not listed" if np.nanmax(damped) > 0 else ""
    return f"{text}, fewer than the {attrs['asked']} asked for{beyond}"


def _between(counts: np.ndarray) -> str:
    least, most = int(np.nanmin(counts)), int(np.nanmax(counts))
    return str(most) if least == most else f"{least} to {most}"


def _nice(value: float) -> str:
    return f"{float(f'{value:.3g}'):.12g}"


def searched_line(found: xr.Dataset) -> str:
    """Range of speeds in which critical speeds were searched, and what was not looked at in it."""
    low, high = (_nice(found.attrs[name] * TO_RPM) for name in ("searched_from", "searched_to"))
    text = f"{low} to {high} rpm"
    if not found.sizes["critical"]:
        text += ": there is no critical speed among them"
    for name, why in (("not_looked_at", "the film does not carry"), ("not_certain", "a mode cannot be followed")):
        for a, b in np.reshape(found.attrs[name], (-1, 2)) * TO_RPM:
            text += f"; not looked at {_nice(a)} to {_nice(b)} rpm, {why}"
    return text


def critical_speeds(
    plant: Plant,
    pressures: Sequence[float] | np.ndarray,
    orders: tuple[int, ...] = ORDERS,
    highest: float | None = None,
) -> xr.Dataset:
    """Critical speeds [rad/s] from rest up to `highest` [rad/s], at gauge pressures (p,) [Pa], ascending by order.

    By default `highest` is 40000 rpm, or four times the rotor's first natural frequency on its nominal bearings. A
    critical speed is a crossing of an order line with the natural frequency of any mode with a damping ratio below one
    half, in either direction; NaN behind the last one. `searched` is 0 at pressures where some speeds carry no rotor
    or the number of modes is not proven somewhere: not all was looked at there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.critical_speeds(plant, [0.5e6], orders=(1,))
    >>> found["critical_speed"].dims[0]
    'pressure'
    """
    import xarray as xr

    pressures = checked("critical speeds: pressures [Pa]", pressures)
    top = highest_speed(plant) if highest is None else highest
    rows = [modes_over_speed(plant, [0.0, top], float(p), orders=orders) for p in pressures]
    lists = [[[c for c in row.crossings if c.order == order and c.at <= top] for order in orders] for row in rows]
    size = max((len(one) for row in lists for one in row), default=0)
    found = np.full((len(pressures), len(orders), max(size, 1), 5), np.nan)
    for i, j in np.ndindex(found.shape[:2]):
        found[i, j, : len(lists[i][j])] = crossing_numbers(lists[i][j])
    speed, zeta, direction, _, ratio = np.moveaxis(found, -1, 0)
    over = ("pressure", "order", "mode")
    complete = [float(not (row.refused or row.unproven or row.uncertain)) for row in rows]
    return xr.Dataset(
        {
            "critical_speed": (over, speed, {"units": "rad/s", "long_name": "critical speed"}),
            "critical_zeta": (over, zeta, {"units": "1", "long_name": "damping ratio at the critical speed"}),
            "critical_direction": (over, direction, {"units": "1", "long_name": "natural frequency leaves the line"}),
            "critical_whirl": (over, whirl_sense(ratio), {"long_name": "sense of whirl at the critical speed"}),
            "searched": ("pressure", complete, {"units": "1", "long_name": "whether every speed was looked at"}),
        },
        {
            "pressure": ("pressure", pressures, {"units": "Pa", "long_name": "supply pressure, gauge"}),
            "order": ("order", list(orders), {"units": "1", "long_name": "order of the speed"}),
            "mode": ("mode", np.arange(1, found.shape[2] + 1), {"long_name": "number of the critical speed"}),
        },
        {"searched_to": float(top)},
    )


def highest_speed(plant: Plant) -> float:
    """Speed [rad/s] up to which critical speeds and the onset of whirl are searched when none is given."""
    first = float(plant.assembly.mesh.reduced.frequencies.min())
    return max(HIGHEST, ABOVE * first, plant.machine.drive.highest_speed or 0.0)


def top_speed(plant: Plant) -> float:
    """Speed [rad/s] up to which a machine matters: the top of the default speeds of its analyses.

    That is `drive.highest_speed`; else the last speed of the bearing tables; else three times the rotor's first natural
    frequency on its nominal bearings, rounded up to two digits in rpm, as far as a run may go.

    Examples
    --------
    >>> import rotorsim as rs
    >>> from rotorsim.analysis.campbell import top_speed
    >>> round(top_speed(rs.Plant("foil_turbo_rotor")) / (2 * np.pi / 60))
    30000
    """
    mesh, made = plant.assembly.mesh, plant.machine.drive.highest_speed
    if made is not None:
        return made
    if mesh.tables.speeds.size:
        return mesh.tables.last
    rpm = PAST_WHIRL * float(mesh.reduced.frequencies.min()) * TO_RPM
    digit = 10 ** np.floor(np.log10(rpm) - 1)
    return min(float(np.ceil(rpm / digit - 1e-9) * digit * RPM), speed_limit(plant.machine)[0])


def default_speeds(plant: Plant, steps: int) -> np.ndarray:
    """Speeds (steps + 1,) [rad/s] from rest to `top_speed`, where none are given."""
    return np.linspace(0.0, top_speed(plant), steps + 1)


def critical_speed_map(
    plant: Plant, stiffness: tuple[float, float] = (1e5, 1e9), points: int = 60, modes: int = 4
) -> xr.Dataset:
    """Undamped critical speeds wn (mode, stiffness) [rad/s] of the rotor over the stiffness [N/m] of every bearing.

    Parameters
    ----------
    plant : Plant
    stiffness : (float, float)
        Range [N/m], from above 0.
    points, modes : int
        Values of the stiffness, evenly in its logarithm, and critical speeds.

    Raises
    ------
    ShaftError
        For a range that does not ascend, or a rotor with bearings at one node alone.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.critical_speed_map(rs.Plant("plain_rotor"), points=5).sizes["stiffness"]
    5
    """
    mesh = plant.assembly.mesh
    held = [
        BearingElement(mesh.node(b.position), 1.0, 0.0, mxx=b.masses[0], myy=b.masses[1])
        for b in plant.machine.bearings
    ]
    masses = [m for m in mesh.constant.point_mass_elements if m.n < mesh.constant.n_nodes]
    rotor = Rotor(mesh.constant.shaft_elements, mesh.constant.disk_elements, held, masses)
    found = rotor.run_ucs(stiffness, points, modes).dataset()
    return found.assign_attrs(plant.provenance() | {"kind": "critical_speed_map"})


AMPLIFIED = 2.5
"""Amplification factor 1 / (2 zeta) from which a crossing is a critical speed."""
SHOWN = 6
"""Branches that are kept for a Campbell diagram."""
FIRST = 4
"""Modes that are looked at at every speed, however low it is: the first two pairs."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Modes at and critical speeds around the speeds (n,) of a row of a map.

    `looked` (n,) is 1 where all modes there and all critical speeds within the margin were looked for, `zeta_least`
    (n,) the least damping ratio, `critical` (k, 4) by crossing: speed [rad/s], damping ratio, 1 where the natural
    frequency rises above the speed and -1 where it falls below, roundness of the orbit. `branches` (b, n, 3) are
    natural frequency [rad/s], damping ratio and roundness of the lowest modes, followed. `models` are the linear models
    by speed.
    """

    looked: np.ndarray
    zeta_least: np.ndarray
    critical: np.ndarray
    branches: np.ndarray
    models: dict[float, LinearPlant]


def surroundings(plant: Plant, speeds: np.ndarray, pressure: float) -> Surroundings:
    """Modes at and critical speeds around the speeds (n,) [rad/s] at a gauge pressure [Pa].

    Nothing is known where no film carries, or where the eigenvalues do not converge; other errors are raised.
    """
    none = np.full(len(speeds), np.nan)
    try:
        found = modes_over_speed(plant, speeds, pressure, FIRST, (1,))
        critical = crossing_numbers(found.crossings)[:, [0, 1, 2, 4]]
    except (NoLiftOffError, ConvergenceError, np.linalg.LinAlgError):
        return Surroundings(np.zeros(len(speeds)), none, np.zeros((0, 4)), np.zeros((0, len(speeds), 3)), {})
    nodes = {node.at: node for node in found.followed.nodes}
    least = [found.least(speed) for speed in speeds.tolist()]
    models = {at: node.pencil for at, node in nodes.items() if isinstance(node.pencil, LinearPlant)}
    s, senses, _ = along_speeds(found, speeds, SHOWN)
    branches = np.stack([np.abs(s), -s.real / np.abs(s), senses], axis=-1)
    looked = np.array([float(_looked(found, speed)) for speed in speeds.tolist()])
    return Surroundings(looked, np.array(least), critical, branches, models)


def _looked(found: ModesOverSpeed, speed: float) -> bool:
    """Whether every mode and every critical speed within the margin of a speed was looked for."""
    low, high = sorted((speed / (1 + MARGIN), speed / (1 - MARGIN)))
    first, last = found.searched
    if low < first - 1e-9 * abs(first) or high > last + 1e-9 * abs(last):
        return False
    unknown = [*found.refused, *found.uncertain, *((v, v) for v in found.unproven)]
    return not any(a <= high and b >= low for a, b in unknown)


def safe_region(found: xr.Dataset, margin: float = MARGIN) -> xr.Dataset:
    """`safe` (..., speed) added to a map: 1 safe, 0 not safe, NaN not known.

    Where it is known, the reasons with it: `grows` where a mode grows, `undamped` where one neither grows nor decays,
    `near_critical` within the margin.

    Parameters
    ----------
    found : Dataset
        An operating map.
    margin : float
        Least distance from a critical speed, over the critical speed; at most the 15 % up to which a map looks.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.safe_region(rs.analysis.operating_map(plant, [300.0], [0.5e6], workers=1))
    >>> found["safe"].shape
    (1, 1)
    """
    order = [d for d in found["lifted"].dims if d != "speed"]
    text = f"1: lifted, damped and not within {100 * margin:g} % of a critical speed; 0: not; NaN: not known"
    label = {"units": "1", "long_name": text}
    lifted = found["lifted"].transpose(*order, "speed").values
    if "wn" not in found:
        return found.assign(safe=((*order, "speed"), np.where(lifted == 0, 0.0, np.nan), label))
    critical = found["critical_speed"].transpose(*order, "critical").values[..., None, :]
    counts = found["critical_zeta"].transpose(*order, "critical").values[..., None, :] <= 1 / (2 * AMPLIFIED)
    speeds = found["speed"].values[:, None]
    with np.errstate(invalid="ignore"):
        near = ((np.abs(speeds / critical - 1) < margin) & counts).any(axis=-1)
        zeta = found["zeta_least"].transpose(*order, "speed").values
        grows, undamped = zeta < -DAMPED, np.abs(zeta) <= DAMPED
    looked = found["looked"].transpose(*order, "speed").values == 1
    safe = np.where((lifted == 0) | grows | undamped | near, 0.0, np.where(looked & (lifted == 1), 1.0, np.nan))
    over = (*order, "speed")
    reasons = {
        "grows": (over, grows.astype(float), {"units": "1", "long_name": "1: a mode grows"}),
        "undamped": (over, undamped.astype(float), {"units": "1", "long_name": "1: a mode has no damping"}),
        "near_critical": (over, near.astype(float), {"units": "1", "long_name": f"1: {100 * margin:g} % or nearer"}),
    }
    return found.assign(reasons | {"safe": (over, safe, label)}).assign_attrs(
        safe_margin=margin, least_amplification=AMPLIFIED
    )
