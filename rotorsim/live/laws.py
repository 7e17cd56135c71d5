"""Controllers that can be switched on: the proportional law and saved laws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rotorsim.errors import DataError
from rotorsim.live.operating import OFF, P_LAW


def read_laws(paths: Sequence[Path]) -> dict[str, Any]:
    """Laws by the name of their file, behind `off` and `P`; raises LawError or DataError."""
    from rotorsim.control.law import load_law

    laws: dict[str, Any] = {OFF: None, P_LAW: P_LAW}
    for path in paths:
        if path.stem in laws:
            raise DataError(f"--law {path}: there is a controller '{path.stem}' already; rename the file")
        laws[path.stem] = load_law(path)
    return laws


def running(law: Any, centre: tuple[float, float]) -> Any:
    """A controller at rest that asks for nothing at `centre` [m] if it leaves that open."""
    from rotorsim.experiments.p_law import ProportionalLaw

    if law == P_LAW:
        return ProportionalLaw(centre=centre)
    return law.with_(centre=centre) if law.centre is None else law
