"""Kinds of cases: experiments, which give a record, and analyses, which give a few numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotorsim.analysis.cases import ANALYSES, Analysis
from rotorsim.experiments import EXPERIMENTS, Experiment

Kind = type[Experiment] | type[Analysis]
KINDS: dict[str, Kind] = {**EXPERIMENTS, **ANALYSES}
"""Every kind of a case by its name."""


def is_analysis(name: str) -> bool:
    """Whether cases of a kind are analyses, without a record."""
    return name in ANALYSES


def make(kind: str, parameters: Mapping[str, Any], Ts: float) -> Experiment | Analysis:
    """The experiment of a kind at a sampling time [s], or the analysis."""
    return ANALYSES[kind](**parameters) if is_analysis(kind) else EXPERIMENTS[kind](**parameters, Ts=Ts)
