"""`diagnose`: find the effects missing from a machine file, by measured records or run-up vectors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotorsim.base.cache import Cache
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.intake import make_trials, open_records, record_notes
from rotorsim.discrepancy.diagnosis import Progress, Workshop, work_on
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.discrepancy.plan.allowed import check_allowed
from rotorsim.discrepancy.residuals.comparison import THREADS
from rotorsim.discrepancy.residuals.floor import TOLERANCE
from rotorsim.discrepancy.runup_diagnosis import diagnose_vectors
from rotorsim.machine import Machine, load_machine


def diagnose(
    machine: Machine | str | Path,
    records: Iterable[Any],
    held_out: Iterable[Any] | None = None,
    untouched: Iterable[Any] | None = None,
    effects: Iterable[str] | None = None,
    seed: int = 0,
    tolerance: float = TOLERANCE,
    mapping: Any = None,
    workshop: Workshop | None = None,
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
        Records at constant operating points. Where `held_out` and `untouched` are not given, their attribute `role`
        states their use; without one they are fitted.
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
        Rank the experiments that may come next: what may differ from the records, of "speed", "pressure", "amplitude",
        "slow-roll"; all of them for an empty one. `Diagnosis.plan` has them.

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
    opened = open_records(records, mapping)
    cache = None if resume is None else Cache(Path(resume))
    if opened and all("speed" in record.dims for _, record in opened):
        if allow is not None:
            raise DataError("plan: needs records over time; of vectors alone no next experiment is planned")
        return diagnose_vectors(machine, opened, effects, tolerance, progress, cache)
    kept, last = open_records(held_out or (), mapping), open_records(untouched or (), mapping)
    trials = make_trials(machine, opened, None if held_out is None and untouched is None else "fit")
    trials += make_trials(machine, kept, "held_out")
    trials += make_trials(machine, last, "untouched")
    found = work_on(machine, trials, effects, tolerance, progress, workshop, threads, cache, allow)
    return replace(found, notes=(*record_notes([*opened, *kept, *last]), *found.notes))
