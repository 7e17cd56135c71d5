"""Results of a calibration: the machine file with its new values, and all of it as plain numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rotorsim.analysis.calibrate import Calibration
from rotorsim.base.files import write_text
from rotorsim.machine import Machine
from rotorsim.machine.file_text import remarked, with_value


def save_calibrated(found: Calibration, name: str, path: str | Path, loaded: Machine) -> None:
    """Write the machine file with the new values: comments kept where they still hold, a remark at its head.

    Parameters
    ----------
    found : Calibration
        Result of `calibrate`.
    name : str
        Name of the targets, for the remark.
    path : path
        File to write; raises WriteError.
    loaded : Machine
        The machine before; its film grid is kept.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.calibrate(machine, rs.analysis.read_targets("dtu_orifice"))  # doctest: +SKIP
    >>> rs.analysis.save_calibrated(found, "dtu_orifice", "calibrated.toml", machine)  # doctest: +SKIP
    """
    path = Path(path)
    values = ", ".join(
        f"{p.name} {v:.5g} {p.unit}".strip() for p, v in zip(found.parameters, found.values, strict=True)
    )
    before, after, total = found.met()
    head = (
        f"# Calibrated, not predicted: fitted to '{name}': {values}.\n"
        f"# Targets met: {before} before, {after} after, of {total}{_on(found.machine, loaded)}.\n"
    )
    machine = found.machine.replace("grid.n_theta", loaded.grid.n_theta).replace("grid.n_z", loaded.grid.n_z)
    changed = [f.path for p in found.parameters for f in p.fields]
    text = remarked(machine._source or machine.text, changed, f"calibrated to '{name}'")
    write_text(path, head + with_value(text, "name", path.stem))


def _on(used: Machine, loaded: Machine) -> str:
    """The film grid that the figures are of, where it is not that of the file."""
    grid = (used.grid.n_theta, used.grid.n_z)
    same = used.film is None or grid == (loaded.grid.n_theta, loaded.grid.n_z)
    return "" if same else f", on a film grid of {grid[0]} x {grid[1]}"


def calibration_numbers(found: Calibration) -> dict[str, Any]:
    """Calibration result as plain numbers in SI, parameters in their own units.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.calibrate(machine, rs.analysis.read_targets("dtu_orifice"))  # doctest: +SKIP
    >>> rs.analysis.calibration_numbers(found)["cost"]  # doctest: +SKIP
    """
    return {
        "ended": found.ended,
        "cost": list(found.cost),
        "parameters": [
            {"name": p.name, "unit": p.unit, "start": p.start, "value": v, "sd": s, "at_bound": bool(b)}
            for p, v, s, b in zip(
                found.parameters, found.values.tolist(), found.sd.tolist(), found.at_bound, strict=True
            )
        ],
        "correlation": found.correlation.tolist(),
        "singular_values": found.singular_values.tolist(),
        "not_identifiable": list(found.unidentifiable),
        "targets": [
            {"name": r.target.name, "role": r.target.role, "target": [r.target.low, r.target.high],
             "before": list(r.before), "after": list(r.after), "verdicts": list(r.verdicts)}
            for r in found.rows
        ],
        "met": dict(zip(("before", "after", "of"), found.met(), strict=True)),
    }  # fmt: skip
