"""Whirl onset over supply pressure: lowest speed at which any mode of film and rotor loses its damping.

Every mode is followed that is slower than the highest speed that is searched and whose damping ratio is below one half,
their number proven at each step; motions that grow without oscillation count too: their onset has a frequency of 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from fe_shaft import crossings
from fe_shaft.follower import Followed, Node, follow
from fe_shaft.pencil import Modes, Region, nothing
from fe_shaft.spectrum import SMALL, modes_in, without_vectors
from rotorsim.analysis.axes import checked
from rotorsim.analysis.campbell import HIGHEST, highest_speed, top_speed
from rotorsim.analysis.modes_over_speed import at_speed, least_damped
from rotorsim.base.errors import DataError
from rotorsim.base.processes import one_thread
from rotorsim.base.rounding import DAMPED
from rotorsim.base.units import RPM, TO_HZ, TO_RPM
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant, region_up_to

if TYPE_CHECKING:
    import xarray as xr

STEP = 1e3 * RPM
"""Steps [rad/s] of the search up to the least highest speed, in proportion up to others."""
FEWEST = 10
"""Steps of `stability_limit`."""
NEARBY = 1e-4
"""Step of a derivative over the step between two nodes."""
AT_ONCE = 10
"""Steps that are followed before the next ones, as long as every mode is damped."""
POINTED = 1e-4
"""Relative accuracy of an onset that a sentence states."""


def whirl_onset(
    plant: Plant, pressures: Sequence[float] | np.ndarray, highest: float | None = None, step: float | None = None
) -> xr.Dataset:
    """Onset speed and whirl frequency [rad/s] and their ratio over the pressures [Pa]; NaN where there is none.

    The modes are followed up in steps until one grows, then Brent's method on the least damping ratio. `highest` is by
    default 40000 rpm, or four times the rotor's first natural frequency where that is more; `step` a fortieth of it.
    `onset_looked` is 1 where every mode was looked for at each speed up to the onset or the highest speed that carries
    the rotor, 0 where the number of modes is not proven somewhere, or where their damping may be lost and come back
    between two speeds and is not followed. An onset is not looked for where a table is over the whirl frequency: a
    Campbell diagram has the damping of each mode at its own frequency. Raises DataError for a machine without a film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.whirl_onset(plant, [0.5e6])
    """
    import xarray as xr

    if plant.machine.film is None:
        raise DataError("whirl onset: the machine has no gas film; use fe_shaft's run_stability")
    pressures = checked("whirl onset: pressures [Pa]", pressures)
    highest = highest_speed(plant) if highest is None else highest
    step = STEP * highest / HIGHEST if step is None else step
    speeds = np.arange(0.0, highest + step / 2, step)
    searches = [LeastDamped.up_to(plant, float(p), highest) for p in pressures]
    found = np.array([search.first_loss(speeds) for search in searches])
    over = ("pressure",)
    return xr.Dataset(
        {
            "onset_speed": (over, found[:, 0], {"units": "rad/s", "long_name": "whirl onset"}),
            "onset_frequency": (over, found[:, 1], {"units": "rad/s", "long_name": "whirl frequency at the onset"}),
            "onset_ratio": (over, _ratio(found[:, 1], found[:, 0]), {"units": "1", "long_name": "whirl over speed"}),
            "onset_looked": (over, found[:, 2], {"units": "1", "long_name": "1: every mode was looked for, 0: not"}),
        },
        {"pressure": (over, pressures, {"units": "Pa", "long_name": "supply pressure, gauge"})},
    )


def _ratio(frequency: np.ndarray, onset: np.ndarray) -> np.ndarray:
    """Frequency over onset (n,), 0 for a rotor that leaves its place without oscillation."""
    return np.where(frequency == 0, 0.0, frequency / np.where(onset == 0, np.nan, onset))


def stability_limit(
    plant: Plant, pressure: float, highest: float, accuracy: float = 1e-5, speeds: np.ndarray | None = None
) -> tuple[float, float, float]:
    """Onset of whirl [rad/s] at a gauge pressure [Pa] to a relative `accuracy`, and its frequency; NaN for none.

    The third number is `onset_looked` of `whirl_onset`, whose search this is, in `FEWEST` steps unless a mode needs
    shorter ones, or over ascending `speeds` [rad/s] up to `highest` at which the modes were followed. Raises
    NoLiftOffError where no speed carries the rotor.
    """
    search = LeastDamped.up_to(plant, pressure, highest)
    steps = np.linspace(0.0, highest, FEWEST + 1) if speeds is None else speeds
    found = search.first_loss(steps, accuracy, speeds is not None)
    if not np.isfinite(found[0]) and not found[2]:
        search.at(highest)  # which states that no speed carries
    return found


def onset_beyond(plant: Plant, fastest: float, pressures: Iterable[float]) -> str:
    """Sentence on the lowest onset between the fastest speed asked for [rad/s] and `top_speed`; empty without one.

    At gauge pressures [Pa], in the sense of rotation of the fastest speed. The sentence also states where a mode may be
    missing. A machine that whirls at the fastest speed already has been warned of.
    """
    top, found, complete = top_speed(plant), [], True
    sense, fastest = -1.0 if fastest < 0 else 1.0, abs(fastest)
    for pressure in pressures if fastest < top else ():
        search = replace(LeastDamped.up_to(plant, pressure, top), sense=sense)
        onset, frequency, looked = search.first_loss(np.array([fastest, top]), POINTED)
        complete &= bool(looked) or onset == fastest
        if onset > fastest:
            found.append((onset, frequency))
    if not found:
        return "" if complete else f"not looked at above {sense * fastest * TO_RPM:.0f} rpm: {why_open(plant)}"
    onset, frequency = min(found)
    what = f"a mode of {frequency * TO_HZ:.4g} Hz grows" if frequency else "the rotor leaves its place"
    return f"{what} from {sense * onset * TO_RPM:.0f} rpm on{'' if complete else ', or below: a mode may be missing'}"


def why_open(plant: Plant) -> str:
    """Why an onset of whirl is not known."""
    if plant.assembly.mesh.whirling:
        return "a table over the whirl frequency holds at each mode's own frequency; see the Campbell diagram"
    return "the film does not carry the rotor, or a mode may be missing"


@dataclass(frozen=True, eq=False)
class LeastDamped:
    """The least damped mode of a plant at a gauge pressure [Pa] in a region.

    The modes at each speed are found from those at the one before. Nodes are at sizes of speeds in one `sense` of
    rotation, -1 for that from y to x.
    """

    plant: Plant
    pressure: float
    region: Region
    hints: list[float]
    known: list[Modes] = field(default_factory=list)
    sense: float = 1.0

    @classmethod
    def up_to(cls, plant: Plant, pressure: float, highest: float) -> LeastDamped:
        """In the region of onsets up to the `highest` speed [rad/s]."""
        hints = plant.assembly.mesh.reduced.frequencies
        return cls(plant, pressure, region_up_to(hints, highest), np.unique(hints.round(3)).tolist())

    def at(self, speed: float) -> tuple[float, float, bool]:
        """Damping ratio (inf: no mode oscillates), frequency [rad/s] at a speed [rad/s], whether no mode is missing.

        Raises NoLiftOffError where the film does not carry the rotor.
        """
        return self.among(self.plant.linearise(speed, self.pressure))

    def among(self, model: LinearPlant) -> tuple[float, float, bool]:
        """The same of a linear model's modes."""
        if model.size > SMALL or model.complete:
            modes = self._modes(model)
        else:
            with one_thread():
                modes = without_vectors(model)
            self.known[:] = [modes]
        return *least_damped(modes, self.region), modes.proven

    def _modes(self, model: LinearPlant) -> Modes:
        with one_thread():
            modes = modes_in(model, self.region, self.hints, self.known[-1] if self.known else None)
        self.known[:] = [modes]
        return modes

    def node(self, speed: float) -> Node:
        """The modes at a speed [rad/s], none where the film does not carry."""
        model = self.model(speed)
        return Node(speed, model, nothing(0) if model is None else self._modes(model))

    def place(self, node: Node) -> crossings.ModesAt:
        """Damping ratios of a node's modes in the region; their slopes are NaN where the film does not carry."""
        modes = node.modes.take(self.region.holds(node.modes.values))
        s = modes.values

        def slopes(towards: float) -> np.ndarray:
            step = NEARBY * (towards - node.at)
            pencil = self.model(node.at + step) if s.size else None
            if pencil is None:
                return np.full(s.size, np.nan)
            return np.asarray(np.imag(crossings.rates(modes, pencil) * s.conj()) * s.imag / (step * np.abs(s) ** 3))

        return crossings.ModesAt(node.at, least_damped(node.modes, self.region), -s.real / np.abs(s), slopes)

    def certain(self, model: LinearPlant) -> float:
        """Least damping ratio of a linear model's modes; NaN where none grows, but one may be missing."""
        damping, _, proven = self.among(model)
        return damping if proven or damping < -DAMPED else float("nan")

    def first_loss(
        self, speeds: np.ndarray, accuracy: float = 1e-8, followed: bool = False
    ) -> tuple[float, float, float]:
        """The same as the function of this name, at kinks of tables too; not looked for on one over whirl frequency."""
        if self.plant.assembly.mesh.whirling:
            return float("nan"), float("nan"), 0.0
        return first_loss(self, self.with_kinks(speeds), accuracy, followed)

    def with_kinks(self, speeds: np.ndarray) -> np.ndarray:
        """Ascending speeds (n,) [rad/s] with those between at which a table of stiffness or damping bends."""
        kinks = self.plant.assembly.mesh.tables.speeds
        return np.unique([*speeds, *kinks[(kinks > speeds[0]) & (kinks < speeds[-1])]])

    def followed(self, speeds: Sequence[float]) -> Followed:
        """The modes followed over ascending speeds (n,) [rad/s]."""
        with one_thread():
            return follow(self.model, speeds, self.region, self.hints)

    def model(self, size: float) -> LinearPlant | None:
        """The linear model at a speed of this size [rad/s]; None where the film does not carry."""
        return at_speed(self.plant, self.pressure)(self.sense * size)


def first_loss(
    search: LeastDamped, speeds: np.ndarray, accuracy: float = 1e-8, followed: bool = False
) -> tuple[float, float, float]:
    """Onset and frequency there [rad/s], NaN without one, and 1 if every mode was looked for up to there.

    Over ascending speeds (n,) [rad/s], between which the modes were followed or are; a rotor that is not carried does
    not whirl.
    """
    looked: list[Node] = []
    complete, every = True, list[bool]()

    def place(speed: float) -> crossings.ModesAt:
        looked.append(search.node(speed))
        return search.place(looked[-1])

    def least(speed: float) -> tuple[float, float]:
        model = search.model(speed)
        damping, frequency, proven = (np.inf, np.nan, True) if model is None else search.among(model)
        every.append(proven)
        return damping, frequency

    for start in range(0, max(len(speeds) - 1, 1), AT_ONCE):
        steps = speeds[start : start + AT_ONCE + 1].tolist()
        nodes = [search.node(v) for v in steps] if followed else search.followed(steps).nodes
        looked += nodes
        known = [search.place(node) for node in nodes]
        loss, decided = crossings.first_loss(place, known, least, xtol=1e-6, rtol=accuracy)
        complete &= decided and all(every) and all(node.pencil is None or node.modes.proven for node in looked)
        if loss is not None:
            return *loss, float(complete)
    return float("nan"), float("nan"), float(complete and any(node.pencil is not None for node in looked))
