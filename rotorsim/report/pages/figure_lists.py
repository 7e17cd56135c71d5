"""Figures of each experiment's report, in order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rotorsim.experiments import EXPERIMENTS
from rotorsim.report.pages import sections as s
from rotorsim.report.pages.run import Run
from rotorsim.report.pages.sections import Section
from rotorsim.signals.record_blocks import MissingError

SWEPT = (s.BODE, s.WATERFALL, s.FULL, s.ORBITS, s.OVERVIEW)
EXPECTED: dict[str, tuple[Section, ...]] = {
    name: tuple(getattr(s, section.upper()) for section in kind.figures) for name, kind in EXPERIMENTS.items()
}
"""Where one of these cannot be made, the report states the reason."""
POSSIBLE = (s.GAIN, s.LOOPS, s.RING_DOWN, s.PER_NEWTON, s.PER_VOLT, s.EXCITATION, s.SPECTRUM, s.FILTERED)
"""Shown as well, if they can be made, for a record that does not name its experiment."""
ADDED = (s.PLANES, s.READ, s.SENSORS, s.FILM_MAPS, s.FILM_ROUND)
"""Shown if they can be made, whatever the experiment."""


@dataclass(frozen=True)
class Found:
    """A section with what it shows, or with `why` it is left out; empty where nobody would expect it."""

    section: Section
    data: Any = None
    why: str | None = None


def found_sections(run: Run) -> Iterator[Found]:
    """Sections of a run's report in order, those left out with their reason."""
    expected = EXPECTED.get(run.kind, SWEPT)
    possible = () if run.kind in EXPECTED else POSSIBLE
    levels = False
    for section in (*expected, *possible, *ADDED):
        if section is s.PER_VOLT and levels and section in possible:
            continue
        try:
            yield Found(section, section.find(run))
            levels |= section is s.GAIN
        except MissingError as missing:
            yield Found(section, why=str(missing) if section in expected else "")
