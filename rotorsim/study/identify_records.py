"""Identification from records in folders, files and campaigns: their sources, one model of all, plans of a study.

The plans of a study are those of campaigns over a grid of operating points, its cells' centres and extra points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from signal import SIGINT
from typing import TYPE_CHECKING, Any

from identification import LinearModel, LpvModel, Prefilter, Source, UnfitError, files_of, pair, survey
from identification.campaign import NO_EXCITATION, SourceResult, identify_sources
from identification.local.identify import check_names
from rotorsim.base.errors import DataError
from rotorsim.base.units import RPM, TO_MPA
from rotorsim.campaign import Settings, open_store, run_campaign
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.store import DONE, record_path

if TYPE_CHECKING:
    from rotorsim.campaign.store import IndexRow, Store
    from rotorsim.machine import Machine

EXCITING = ("prbs", "chirp", "multisine")
"""Kinds of experiments that move both references and are at one operating point."""
QUIET = ("steady",)
ORDER = 6
"""Default order of a black-box model."""
COMPARED = 8
"""Order of the black-box model with which a grey box is compared."""
HELD = ("validation", "hold_out", "centre", "extra", "extra_second")
"""Roles of records that no surface is fitted to."""
COUNTED = ("identification", "centre", "extra")
"""Roles of records that local models are made of."""
KEPT = ("reference", "disc", "disc_measured", "pin", "pin_measured", "angle_measured", "speed_measured",
        "pressure_measured")  # fmt: skip
"""Variables that identification and the noise-free fit need; the rest would double the files."""
_HEAD = """name = "{name}"
machine = "machine"
time_limit = "30 min"
keep = {kept}
"""
_PRBS = """
[experiments.{name}]
kind = "prbs"
amplitude = "1 V"
duration = "{duration:g} s"
sequence = {number}
seed = {number}
"""
_STEADY = """
[experiments.unexcited]
kind = "steady"
duration = "2 s"
seed = 9
"""
_AXIS = """
[axes.{name}]
list = {values}
"""


def sources_of(paths: Iterable[str | Path], mapping: Any = None) -> list[Source]:
    """Sources of campaigns and other files; the name of a campaign's experiment is the role of its records.

    Raises
    ------
    UnfitError, ReadError
        If there is nothing to read.
    StoreError
        If a campaign's store is damaged.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sources = rs.study.sources_of(["run.nc"])
    """
    found: list[Source] = []
    others: list[Path] = []
    for path in map(Path, paths):
        if (path / "store.json").is_file():
            found += campaign_sources(path)
        else:
            others.append(path)
    return found + (survey(files_of(others), mapping) if others else [])


def campaign_sources(folder: Path) -> list[Source]:
    """Records with excitation in a campaign's store, each with the steady run at its operating point.

    Raises
    ------
    UnfitError
        If nothing that excites is done yet.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sources = rs.study.campaign_sources(Path("mine"))  # doctest: +SKIP
    """
    store = open_store(folder)
    with closing(store.index()) as index:
        rows = list(index.rows(DONE))
    known = [source for row in rows if (source := _source(store, row)) is not None]
    found = pair(known)
    if not found:
        raise UnfitError(
            f"{folder}: no {', '.join(EXCITING)} record in the campaign is done; run it, or take a plan that excites"
        )
    return found


def _source(store: Store, row: IndexRow) -> Source | None:
    entry = next(entry for entry in store.plan.entries if entry.name == row.experiment)
    values = {**entry.parameters, **row.parameters}
    if entry.kind not in EXCITING + QUIET or not {"speed", "pressure"} <= values.keys():
        return None
    path = record_path(store.folder, row.key)
    excited = entry.kind in EXCITING
    return Source(path, float(values["speed"]), float(values["pressure"]), excited, row.experiment)


def identify_records(
    paths: Sequence[str | Path],
    model: int | str = 3,
    order: int | None = None,
    method: str = "auto",
    settings: Prefilter | None = None,
    mapping: Any = None,
    surfaces: int | str = 2,
    refine: str = "none",
    workers: int = 2,
    progress: Callable[[int], Callable[[SourceResult], None]] | None = None,
    dead_time: float | str = "free",
) -> tuple[LinearModel | LpvModel, list[SourceResult]]:
    """Identify records of files, folders or campaigns: a linear model of one operating point, an LPV model of several.

    Parameters
    ----------
    paths : sequence of path
        Files of records, folders of them, folders of campaigns.
    model : int or str
        1, 2, 3, "actuator" or "blackbox".
    order, method
        Order of a black-box model, 6 if None; "auto", "oe" (output error), "two-stage" (closed loops) or "pem"
        (prediction error).
    settings : Prefilter, optional
        Runout, spike and low-pass filters, probes.
    mapping : path or Mapping, optional
        Which column of a measured file is which channel.
    surfaces : int or str
        Degree of the parameters over speed and pressure, or "hold-out", which chooses it.
    refine : str
        Refinement of the surfaces: "none", "frequency" or "global".
    workers : int
        Records identified at a time.
    progress : callable, optional
        Takes the number of records and returns what is called with each result.
    dead_time : float or "free"
        Of model 3 [s], as for `identify`.

    Returns
    -------
    model : LinearModel or LpvModel
    found : list of SourceResult
        Result or sentence of every record, then of several that one operating point joined.

    Raises
    ------
    UnfitError
        If no record gives a model, or for an order of a model that has none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model, found = rs.identify_records(["my_campaign"], model=2)  # doctest: +SKIP
    >>> model.save("model.json")  # doctest: +SKIP
    """
    check_names(model, method)
    if order is not None and str(model) != "blackbox":
        raise UnfitError(
            f"identify.order: {order} for model {model}; only model blackbox has an order, the degree of an LPV model "
            "is `--surfaces`"
        )
    order = ORDER if order is None else order
    sources = sources_of(paths, mapping)
    if not sources:
        raise UnfitError(f"{paths[0]}: {NO_EXCITATION}")
    shown = progress(len(sources)) if progress is not None else None
    return identify_sources(
        sources, model, order, method, settings, mapping, surfaces, refine, HELD, workers, shown, dead_time, COMPARED
    )


@dataclass(frozen=True)
class StudyGrid:
    """Grid of speeds [rad/s] and gauge pressures [Pa], duration of a record [s], extra points [rad/s, Pa].

    Examples
    --------
    >>> import rotorsim as rs
    >>> layout = rs.study.StudyGrid(speeds=(0.0, 300.0), pressures=(0.5e6,), duration=5.0)
    >>> [name for name, text in layout.texts()][:3]
    ['grid-0rpm', 'grid-2865rpm', 'centres-1432rpm']
    """

    speeds: tuple[float, ...] = tuple(1000 * RPM * k for k in range(7))
    pressures: tuple[float, ...] = (0.3e6, 0.4e6, 0.5e6, 0.6e6, 0.7e6)
    duration: float = 10.0
    more: tuple[tuple[float, float], ...] = ()

    def texts(self) -> Iterator[tuple[str, str]]:
        """Name and text of each plan: the grid with a second record, the centres of its cells, the extra points.

        Each speed has random sequences of its own. The two references of a finite sequence are a little alike, which
        moves the cross gains; one sequence for all would move them alike, and points left out would show it as an error
        of the surfaces.
        """
        for k, speed in enumerate(self.speeds):
            name = f"grid-{speed / RPM:.0f}rpm"
            yield name, self._text(name, ("identification", "validation"), 10 * k + 1, speed, self.pressures)
        for k, speed in enumerate(_middles(self.speeds)):
            name = f"centres-{speed / RPM:.0f}rpm"
            yield name, self._text(name, ("centre",), 10 * k + 3, speed, _middles(self.pressures))
        for k, (speed, pressure) in enumerate(self.extra_points()):
            name = f"extra-{speed / RPM:.0f}rpm-{pressure * TO_MPA:.2f}MPa"
            yield name, self._text(name, ("extra", "extra_second"), 10 * k + 4, speed, (pressure,))

    def extra_points(self) -> list[tuple[float, float]]:
        """Further points [rad/s, Pa] that are not on the grid."""
        grid = {_rounded(w, p) for w in self.speeds for p in self.pressures}
        return [q for q in dict.fromkeys(_rounded(*q) for q in self.more) if q not in grid]

    def _text(self, name: str, roles: tuple[str, ...], first: int, speed: float, pressures: tuple[float, ...]) -> str:
        text = _HEAD.format(name=name, kept=list(KEPT))
        for number, role in enumerate(roles, first):
            text += _PRBS.format(name=role, duration=self.duration, number=number)
        text += _STEADY + _AXIS.format(name="speed", values=[f"{speed / RPM:.9g} rpm"])
        return text + _AXIS.format(name="pressure", values=[f"{p:.9g} Pa" for p in pressures])


QUICK = StudyGrid(tuple(k * RPM for k in (0.0, 3000.0, 6000.0)), (0.3e6, 0.5e6, 0.7e6))


def _rounded(speed: float, pressure: float) -> tuple[float, float]:
    """An operating point to a thousandth of a turn per minute and a Pascal, to compare it."""
    return round(speed / RPM, 3) * RPM, round(pressure)


def _middles(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple((a + b) / 2 for a, b in pairwise(values))


def run(machine: Machine, layout: StudyGrid, out: Path, workers: int) -> list[Path]:
    """Folders of the campaigns below `out`, run now or gone on with.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C stopped a campaign.
    DataError
        If another signal did, or records are missing at its end; at once for a machine without pins.
    StoreError
        If a folder holds a campaign of another plan or machine.

    Examples
    --------
    >>> import rotorsim as rs
    >>> layout = rs.study.StudyGrid(speeds=(0.0, 300.0), pressures=(0.5e6,), duration=5.0)
    >>> folders = rs.study.run(machine, layout, Path("study"), workers=2)  # doctest: +SKIP
    """
    if not machine.injectors:
        raise DataError(
            f"study: {machine.name} has no pins in a gas film that a reference could move; take one that has"
        )
    folders = []
    plans = {name: make_plan(text, machines={"machine": machine.text}) for name, text in layout.texts()}
    for name, plan in plans.items():
        folder = out / name
        outcome = run_campaign(plan, folder, Settings(workers=workers, show=True))
        if outcome.stopped == SIGINT:
            raise KeyboardInterrupt
        if outcome.stopped or outcome.pending:
            raise DataError(f"{folder}: stopped with {outcome.pending} records left; the same command continues")
        folders.append(folder)
    return folders
