r"""Modes of the coupled machine over speed, all of a region; where order lines cross them, with what margin is safe.

The region of the complex plane is a sector from a floor to a reach, of damping ratios below one half: beyond it lie
most motions of the gas, which the film's storage damps. Its reach covers every order line over the speeds that are
searched: the asked ones and those around them whose critical speeds matter to a margin of 15 %.

Coefficients of bearings over the whirl frequency are those at the frequency of the speed while modes are followed and
counted: crossings of 1X are exact. Each mode at a node then is a fixed point

.. math:: s = s\left(K(\Omega, |s|),\, C(\Omega, |s|)\right)

with the coefficients at its own frequency. These are the film's for a steady whirl, so that the eigenvalue is exact
to second order in the damping ratio.

Cites: childs_1993.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_shaft.crossings import Crossing, crossings
from fe_shaft.follower import Followed, Node, follow
from fe_shaft.pencil import Modes, Pencil, Region
from fe_shaft.spectrum import refined
from rotorsim.base.display import Report, silent
from rotorsim.base.errors import ConvergenceError, NoLiftOffError
from rotorsim.base.processes import one_thread
from rotorsim.base.rounding import DAMPED as STEADY, divergence
from rotorsim.base.units import TO_HZ, TO_RPM
from rotorsim.plant import Plant
from rotorsim.plant.linearise import ABOVE, BELOW, DAMPED, LinearPlant

MARGIN = 0.15
"""Distance of a speed from a critical speed, over it, below which the critical speed matters."""
ORDERS = (1, 2, 3)
"""Orders of the speed whose lines are crossed."""
PASSES = 60
"""Most steps to the fixed point of a mode."""
SETTLED = 1e-8
"""Relative step of a frequency that ends them."""
ONE_SPEED = 1e-12
"""Distance of two speeds, over the highest one, up to which they differ by rounding."""
EQUAL = 1e-6
"""Relative distance of eigenvalues up to which they are those of one plane and of the other one."""


@dataclass(frozen=True, eq=False)
class ModesOverSpeed:
    """Modes of a plant at a gauge pressure [Pa], followed over speeds, and its crossings with order lines.

    `searched` are the lowest and highest speed [rad/s] at which crossings were looked for; where the film does not
    carry the rotor in between, nothing was looked at.
    """

    plant: Plant
    pressure: float
    followed: Followed
    orders: tuple[int, ...] = ORDERS
    progress: Report = silent

    @property
    def region(self) -> Region:
        """The region of the complex plane."""
        return self.followed.region

    @property
    def searched(self) -> tuple[float, float]:
        """Lowest and highest speed [rad/s]."""
        return self.followed.nodes[0].at, self.followed.nodes[-1].at

    @cached_property
    def _crossed(self) -> tuple[list[Crossing], list[tuple[float, float]]]:
        with one_thread():
            return crossings(at_speed(self.plant, self.pressure, self.progress), self.followed, self.orders)

    @property
    def crossings(self) -> list[Crossing]:
        """Crossings of the order lines, by order and speed."""
        return self._crossed[0]

    @property
    def uncertain(self) -> list[tuple[float, float]]:
        """Intervals of speed [rad/s] in which a mode or its crossing is not certain."""
        return self._crossed[1]

    @property
    def refused(self) -> list[tuple[float, float]]:
        """Intervals of speed [rad/s] in which the film does not carry: nothing was looked at there."""
        out: list[tuple[float, float]] = []
        nodes = self.followed.nodes
        for k, node in enumerate(nodes):
            if node.pencil is None:
                low, high = nodes[max(k - 1, 0)].at, nodes[min(k + 1, len(nodes) - 1)].at
                if out and out[-1][1] >= low:
                    out[-1] = out[-1][0], high
                else:
                    out.append((low, high))
        return out

    def node(self, speed: float) -> Node:
        """The node at an asked speed [rad/s]."""
        return next(node for node in self.followed.nodes if node.at == speed)

    def least(self, speed: float) -> float:
        """Least damping ratio of all modes at an asked speed [rad/s], NaN without any."""
        damping, frequency = least_damped(self.own(self.node(speed)), self.region)
        return damping if np.isfinite(frequency) else float("nan")

    @cached_property
    def _own(self) -> dict[float, Modes]:
        return {}

    def own(self, node: Node) -> Modes:
        """Modes of a node, each with the coefficients of the bearings at its own frequency."""
        if not self.plant.assembly.mesh.whirling or not isinstance(node.pencil, LinearPlant):
            return node.modes
        if node.at not in self._own:
            with one_thread():
                self._own[node.at] = at_own_frequencies(self.plant, node.pencil, node.modes, self.region)
        return self._own[node.at]

    @property
    def unproven(self) -> list[float]:
        """Speeds [rad/s] of the nodes at which the number of modes is not proven."""
        return [n.at for n in self.followed.nodes if n.pencil is not None and not n.modes.proven]


def at_own_frequencies(plant: Plant, model: LinearPlant, modes: Modes, region: Region) -> Modes:
    """Modes of a model in a region, each with the coefficients of the bearings at its own frequency; others stay.

    Raises ConvergenceError where one does not settle.
    """
    values, right, left = modes.values.copy(), modes.right.copy(), modes.left.copy()
    todo = np.flatnonzero(region.holds(values)).tolist()
    while todo:
        equal = [k for k in todo if abs(values[k] - values[todo[0]]) < EQUAL * abs(values[k])]
        todo = [k for k in todo if k not in equal]
        found = own_frequency(plant, model, modes.take(equal))
        if found is None:
            raise ConvergenceError(
                f"modes: that of {abs(values[equal[0]]) * TO_HZ:.4g} Hz at {model.speed * TO_RPM:.4g} rpm does not "
                "settle at its own frequency; give the table more whirl frequencies"
            )
        values[equal], right[:, equal], left[:, equal] = found.values, found.right, found.left
    return replace(modes, values=values, right=right, left=left)


def own_frequency(plant: Plant, model: LinearPlant, modes: Modes) -> Modes | None:
    """Fixed point of a mode, or of equal ones of a round rotor together; None where it does not settle."""
    for _ in range(PASSES):
        before = float(np.abs(modes.values).mean())
        found = refined(at_whirl(plant, model, before), modes)
        if len(found.values) < len(modes.values):
            return None
        modes = found.take(np.argsort(np.abs(found.values - modes.values.mean()))[: len(modes.values)])
        size = np.abs(modes.values)
        if np.ptp(size) > EQUAL * before:
            every = (own_frequency(plant, model, modes.take([k])) for k in range(len(size)))
            parts = [part for part in every if part is not None]
            if len(parts) < len(size):
                return None
            right, left = (np.hstack([getattr(part, side) for part in parts]) for side in ("right", "left"))
            return Modes(np.concatenate([part.values for part in parts]), right, left)
        if abs(size.mean() - before) < SETTLED * before:
            return modes
    return None


def at_whirl(plant: Plant, model: LinearPlant, frequency: float) -> LinearPlant:
    """A model with the coefficients of tables at a whirl frequency [rad/s] in place of those at the speed."""
    mesh, rotor, speed = plant.assembly.mesh, model.rotor, model.speed
    change = np.zeros((2, *rotor.stiffness.shape))
    for number, table in mesh.whirling.items():
        rows = mesh.between(number)
        change += rows.T @ (np.array(table.at(speed, frequency)) - np.array(mesh.tables.at(number, speed))) @ rows
    return replace(
        model, rotor=replace(rotor, stiffness=rotor.stiffness + change[0], damping=rotor.damping + change[1])
    )


def at_speed(plant: Plant, pressure: float, progress: Report = silent) -> Callable[[float], LinearPlant | None]:
    """The linear model at a speed [rad/s]; None where the film does not carry."""

    def model(speed: float) -> LinearPlant | None:
        progress(f"modes at {speed * TO_RPM:.0f} rpm")
        try:
            return plant.linearise(speed, pressure)
        except NoLiftOffError:
            return None

    return model


def modes_over_speed(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressure: float = 0.0,
    least: int = 0,
    orders: tuple[int, ...] = ORDERS,
    progress: Report = silent,
) -> ModesOverSpeed:
    """All modes of the region over ascending speeds (n,) [rad/s] at a gauge pressure [Pa], and around them.

    The region also reaches over the `least` lowest natural frequencies of the rotor on its nominal bearings. `progress`
    takes each speed in words before its modes.
    """
    searched = around(speeds)
    family, hints = at_speed(plant, pressure, progress), plant.assembly.mesh.reduced.frequencies
    rotor = np.sort(hints)[: max(least, 1)]
    reach = ABOVE * max(max(orders) * float(np.abs(searched).max()), ABOVE * float(rotor[-1]) if least else 0.0)
    reach = reach or ABOVE * float(rotor[-1])
    floor = _floor(searched, orders) or BELOW * reach
    kinks = np.concatenate([-plant.assembly.mesh.tables.speeds, plant.assembly.mesh.tables.speeds])
    apart = np.abs(kinks[:, None] - searched).min(axis=1) > ONE_SPEED * np.abs(searched).max()
    inner = kinks[apart & (searched[0] < kinks) & (kinks < searched[-1])].tolist()
    with one_thread():
        region = Region(reach, floor, DAMPED)
        found = follow(family, np.unique([*searched, *inner]).tolist(), region, np.unique(hints.round(3)).tolist())
    return ModesOverSpeed(plant, pressure, found, orders, progress)


def _floor(searched: np.ndarray, orders: tuple[int, ...]) -> float:
    """Lowest frequency [rad/s] of the region: below every order line, or a small part of them where one begins at 0.

    The modes that are shown have no part in it.
    """
    lowest = BELOW * max(orders) * float(np.abs(searched).max())
    if searched[0] * searched[-1] <= 0:
        return lowest
    return min(lowest, 0.5 * min(orders) * float(np.abs(searched).min()))


def around(speeds: Sequence[float] | np.ndarray) -> np.ndarray:
    """Speeds (n,) [rad/s] with those on either side whose critical speeds lie within the margin of one of them.

    Examples
    --------
    >>> from rotorsim.analysis.modes_over_speed import around
    >>> around([100.0, 200.0]).round(1).tolist()
    [87.0, 100.0, 200.0, 235.3]
    """
    speeds = np.asarray(speeds, float)
    low, high = speeds[0], speeds[-1]
    low = low / (1 + MARGIN) if low > 0 else low / (1 - MARGIN)
    high = high / (1 - MARGIN) if high > 0 else high / (1 + MARGIN)
    return np.unique([low, *speeds, high])


def least_damped(modes: Modes, region: Region) -> tuple[float, float]:
    """Least damping ratio of the modes in a region and its frequency [rad/s]; (inf, NaN) without any mode.

    Growth without oscillation, a real positive eigenvalue, has a damping ratio of -1 and a frequency of 0, however fast
    it is: nothing bounds it by the speeds that are searched.
    """
    s, size = modes.values, np.abs(modes.values)
    if divergence(s) > 0:
        return -1.0, 0.0
    s = s[(size < region.reach) & (region.holds(s) | (s.real > STEADY * size) & (s.imag > 0))]
    if not s.size:
        return float("inf"), float("nan")
    k = int((-s.real / np.abs(s)).argmin())
    return float(-s[k].real / np.abs(s[k])), float(np.abs(s[k]))


def roundness(pencil: Pencil, modes: Modes) -> np.ndarray:
    """Roundness (k,) of the orbits of modes at the measuring plane: 1 a forward circle, -1 a backward one."""
    assert isinstance(pencil, LinearPlant)
    return pencil.roundness(modes.values, modes.right)
