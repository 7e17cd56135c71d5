"""`diagnose`: find the effects missing from a machine file, by measured records or run-up vectors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.cache import Cache
from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.data.intake import check_plane, check_ring, make_trials, open_records, record_notes
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.sweeps import RunupTrial, is_table, make_sweeps, rate_notes, with_tables
from rotorsim.discrepancy.diagnosis import diagnose_trials
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.discrepancy.plan.allowed import check_allowed
from rotorsim.discrepancy.residuals.comparison import THREADS
from rotorsim.discrepancy.residuals.floor import TOLERANCE
from rotorsim.discrepancy.twin.compiled_models import CompiledModels, Progress
from rotorsim.machine import Machine, load_machine

if TYPE_CHECKING:
    import xarray as xr


def diagnose(
    machine: Machine | str | Path,
    records: Iterable[Any],
    held_out: Iterable[Any] | None = None,
    untouched: Iterable[Any] | None = None,
    effects: Iterable[str] | None = None,
    seed: int = 0,
    tolerance: float = TOLERANCE,
    mapping: Any = None,
    models: CompiledModels | None = None,
    threads: int = THREADS,
    progress: Progress = lambda stage: None,
    resume: str | Path | None = None,
    plan_next: Iterable[str] | None = None,
) -> Diagnosis:
    """Compare a machine file with measured records, and identify the missing effect.

    Parameters
    ----------
    machine : Machine, name or path
        The machine as it is believed to be.
    records : Datasets or paths
        Records at constant operating points, tables of run-up vectors, and run-ups or coast-downs over time with an
        angle, which become such tables; of one kind or of several. Where `held_out` and `untouched` are not given,
        their attribute `role` states their use; without one records are fitted, and a table has rows for each use.
    held_out, untouched :
        Records at other operating points that choose the effect, and that only show the gap.
    effects : names
        Candidates: effects or their forms ('runout', 'runout.amplitude_2x'); the whole catalogue when not given.
    seed : int
        Kept with the verdict; nothing in the search is drawn, so that it changes nothing.
    tolerance : float
        Declared tolerance of the model, as a share of every line.
    progress : function of a stage's name
        Called with each stage and step of the work.
    resume : folder
        Where to keep what was computed, so that an interrupted diagnosis resumes; yours to delete once it is done.
    plan_next : names, optional
        Rank the experiments that may come next. The names, of `plan.allowed.ALLOWED`, may differ from the records;
        all that the machine can do for an empty one. `Diagnosis.planned` has them.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        If the records cannot be used, with one sentence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.diagnose("dtu_gas_bearing", "puzzle/records")  # doctest: +SKIP
    >>> found.sentence  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    allow = None if plan_next is None else check_allowed(plan_next)
    cache = None if resume is None else Cache(Path(resume))
    parts = {role: with_tables(open_records(given or (), mapping)) for role, given in
             (("fit", records), ("held_out", held_out), ("untouched", untouched))}  # fmt: skip
    stated = held_out is None and untouched is None
    trials = [t for role, part in parts.items() for t in trials_of(machine, part, None if stated else role)]
    if any(not t.orders for t in trials):
        trials = [replace(t, alone=False) if isinstance(t, RunupTrial) else t for t in trials]
    found = diagnose_trials(machine, trials, effects, tolerance, progress, models, threads, cache, allow)
    every = [one for part in parts.values() for one in part]
    tables = [(name, record) for name, record in every if is_table(record)]
    return replace(found, notes=(*record_notes(every), *rate_notes(tables), *found.notes))


def trials_of(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]], role: str | None) -> list[Trial]:
    """Trials of records over time and of tables of vectors, all of one role, or of the roles that they state."""
    tables = [(name, record) for name, record in opened if is_table(record)]
    others = [(name, record) for name, record in opened if not is_table(record)]
    return [*make_trials(machine, others, role), *vector_trials(machine, tables, role)]


def vector_trials(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]], role: str | None = None) -> list[Trial]:
    """Trials of tables of vectors; of six rows one is held out and one untouched, where no role is stated for all."""
    for name, vectors in opened:
        check_plane(machine, vectors.attrs.get("disc_position"), name)
    found = [
        replace(sweep, changes=known_changes(machine, vectors.attrs.get("changes"), name))
        for name, vectors in opened
        for sweep in make_sweeps(vectors, name, machine.film is not None, role or str(vectors.attrs.get("role", "")))
    ]
    for sweep in found:
        check_ring(machine, sweep)
    return list(found)
