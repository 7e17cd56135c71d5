"""Keys of a study's results: what each kind follows from, its sources included."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rotorsim.base import cache
from rotorsim.base.cache import PLANT, RUNS, sources_hash

HERE = str(Path(__file__).resolve().parent)
STUDY = "rotorsim/study"
IDENTIFICATION = ("identification_vs_physics", "pages")
MEASURES = ("limit", "measures", "measures_control", "measures_identification")
SOURCES = {
    "control": (
        "identification", "reynolds", "rotorsim/base", "rotorsim/machine", "rotorsim/control",
        f"{HERE}/control_cases.py", f"{HERE}/printed.py", f"{HERE}/data/printed.toml",
    ),
    "verify": (*RUNS, "rotorsim/analysis", "rotorsim/verify", "rotorsim/report", f"{HERE}/control_cases.py"),
    "hysteresis": (*PLANT, f"{HERE}/claims/hysteresis.py"),
    "experiments": (
        *RUNS, "rotorsim/analysis", "rotorsim/verify", f"{HERE}/control_study.py", f"{HERE}/control_cases.py",
        f"{STUDY}/identification_vs_physics.py", f"{HERE}/claims/control_numbers.py", f"{HERE}/claims/rules.py",
        f"{HERE}/claims/rules.toml", f"{HERE}/claims/amended.toml", f"{HERE}/claims/identification_numbers.py",
        *(f"{HERE}/experiments/{name}.py" for name in MEASURES),
    ),
    "identification": (
        *PLANT, "rotorsim/analysis", *(f"{STUDY}/{name}.py" for name in IDENTIFICATION),
        *(f"{HERE}/claims/{name}.py" for name in ("identification_numbers", "targets", "rules")),
        f"{HERE}/claims/rules.toml", f"{HERE}/claims/amended.toml",
    ),
}  # fmt: skip
"""Sources, files and folders, that a kind of result follows from."""


def key_of(*parts: Any, kind: str = "verify") -> str:
    """Key of a result of a kind by the values that it follows from."""
    return cache.key_of(*parts, sources_hash(*SOURCES[kind]))
