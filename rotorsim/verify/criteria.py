"""Criteria of a verification and the rows of its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Criteria:
    """Bounds. Ratios are closed over open loop, and below their bound by more than a rounding; None is not judged.

    Attributes
    ----------
    mean, worst : float or None
        Impact response, averaged over the twenty points and at the worst of them.
    effort : float or None
        Largest reference in the hits [V].
    noise : float or None
        Standard deviation of the reference at rest [V].
    amplitude : float or None
        Imbalance amplitude at the end of the run-up.
    transient : float or None
        Largest distance [m] of the disc from its moving mean of 0.1 s in ramps, steps and faults, or 1.2 times that
        of the open loop where this is more.
    disturbed : float or None
        Impact response at the worst point of changed machines.
    disk : float or None
        Disk margin with the plant's own linearisation, at the worst of five points; at least.
    suspended : float or None
        Part of the samples of a run with sound sensors in which an alarm suspends the law. A step of the pressure may
        suspend it for 50 samples, 1.25 % of a run; with more than 2 % figures are those of the plant without the law.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.verify.Criteria(worst=1.2).worst
    1.2
    """

    mean: float | None = 1.0
    worst: float | None = 1.0
    effort: float | None = 5.0
    noise: float | None = 1.0
    amplitude: float | None = 1.0
    transient: float | None = 30e-6
    disturbed: float | None = 1.0
    disk: float | None = 0.3
    suspended: float | None = 0.02


ROUNDING = 1e-3
"""A ratio that differs from its bound by less is printed as the bound, and is not below it."""


def edited(before: Mapping[str, float | None], now: Mapping[str, float | None]) -> list[str]:
    """A sentence for each bound, by name, that differs from that of the first verification in a folder.

    Examples
    --------
    >>> from dataclasses import asdict
    >>> edited(asdict(Criteria()), asdict(Criteria(worst=1.2)))
    ['worst: 1.0 at the first verification here, 1.2 now']
    """
    names = [name for name in before if before[name] != now.get(name)]  # not those of a later version
    return [f"{name}: {before.get(name)} at the first verification here, {now.get(name)} now" for name in names]


@dataclass(frozen=True)
class Row:
    """One criterion: what, measured and bound with their unit, whether it passed (None: not judged), a remark."""

    check: str
    measured: float
    bound: float | None
    unit: str
    passed: bool | None
    remark: str = ""


def at_most(check: str, measured: float, bound: float | None, unit: str = "", remark: str = "") -> Row:
    """A row that passes up to its bound."""
    return Row(check, float(measured), bound, unit, None if bound is None else bool(measured <= bound), remark)


def below(check: str, measured: float, bound: float | None, remark: str = "") -> Row:
    """A row of a ratio of closed over open loop, which passes below its bound; a law that does nothing has 1."""
    passed = None if bound is None else bool(measured < bound * (1 - ROUNDING))
    same = "as the open loop: the law changes nothing" if abs(measured - 1) < ROUNDING else ""
    return Row(check, float(measured), bound, "of open loop", passed, "; ".join(filter(None, (same, remark))))


def at_least(check: str, measured: float, bound: float | None, unit: str = "", remark: str = "") -> Row:
    """A row that passes from its bound on."""
    return Row(check, float(measured), bound, unit, None if bound is None else bool(measured >= bound), remark)


def holds(check: str, good: bool, remark: str = "") -> Row:
    """A row that passes or not."""
    return Row(check, float(good), 1.0, "", bool(good), remark)
