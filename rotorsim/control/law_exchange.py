"""Laws from and for other programs: systems of the package `control`, MATLAB files."""

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base import foreign_systems as foreign
from rotorsim.base.errors import DataError, LawError, UnstableLaw
from rotorsim.base.input_files import parse_json
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.plants import Model
from rotorsim.control.plausibility import Plausibility, plausibility_of
from rotorsim.control.runout import RunoutTable
from rotorsim.control.systems import System, tustin

MATRICES = ("A", "B", "C", "D", "W")
DEFAULTS = {"average": 0.2, "fade": 0.05}
"""Seconds in which a law from elsewhere seeks its centre, and in which its output then comes in."""
MARGIN = 1e-6
"""Growth of a state a sample that still counts as that of an integrator."""
MAT_SETTINGS = ("refresh", "limit", "start", "average", "fade")
"""Scalars of a law in a .mat file; each has its default where it is missing."""


MAT_READ = (*MAT_SETTINGS, "W", "name", "speeds", "pressures", "centre", "bias", "gamma", "about", "plausibility",
            "runout", "InputName", "OutputName", "InputUnit", "OutputUnit")  # fmt: skip
"""Variables of a .mat file besides A, B, C, D and Ts."""


def from_control(
    kind: Any, system: Any, Ts: float | None, name: str | None, model: Model | None, settings: dict[str, Any]
) -> Any:
    """Law, of the class `kind`, of a system of the package `control` or of several; see `Law.from_control`."""
    make = _of_several if isinstance(system, Mapping) else _of_one
    law = make(kind, system, Ts, name, settings)
    if model is not None and "plausibility" not in settings:
        law = law.with_(plausibility=plausibility_of(model, law.Ts, law.limit, law.scheduled))
    warn_unstable(law)
    return law


def warn_unstable(law: Any) -> None:
    """Warn UnstableLaw if the law's own states grow, at a point of its table or half way between two."""
    over = law.A
    for axis in (0, 1):
        between = (over.take(range(1, over.shape[axis]), axis) + over.take(range(over.shape[axis] - 1), axis)) / 2
        over = np.concatenate([over, between], axis)
    radius = float(np.abs(np.linalg.eigvals(over)).max(initial=0.0))
    if radius > 1 + MARGIN:
        warnings.warn(
            f"law {law.name}: is unstable by itself, its states grow by a factor of {radius:.6g} a sample somewhere in "
            "its table; it winds up while the reference is limited, and diverges where the loop is open",
            UnstableLaw,
            stacklevel=4,
        )


def _of_several(kind: Any, systems: Any, Ts: float | None, name: str | None, settings: dict[str, Any]) -> Any:
    """Law over a grid of points, of systems by (speed, pressure)."""
    if not systems:
        raise LawError("law: no systems; give a control.StateSpace by (speed, pressure)", argument="system")
    speeds, pressures = (sorted({float(point[k]) for point in systems}) for k in (0, 1))
    missing = [(w, p) for w in speeds for p in pressures if (w, p) not in systems]
    if missing:
        raise LawError(
            f"law: the table has no system at {missing[0][0]:g} rad/s, {missing[0][1]:g} Pa; give one at each speed "
            "for each pressure",
            argument="system",
            value=missing[0],
        )
    made = {point: _of_one(kind, system, Ts, name, {}) for point, system in systems.items()}
    first = next(iter(made.values()))
    for point, law in made.items():
        if (law.order, law.Ts) != (first.order, first.Ts):
            raise LawError(
                f"law {law.name}: {law.order} states, {law.Ts:g} s at {point[0]:g} rad/s, {point[1]:g} Pa; the first "
                f"has {first.order}, {first.Ts:g} s",
                argument="system",
                value=point,
            )
    table = {
        letter: np.array([[getattr(made[w, p], letter)[0, 0] for p in pressures] for w in speeds])
        for letter in MATRICES
    }  # fmt: skip
    return first.with_(**table | {"speeds": speeds, "pressures": pressures} | settings)


def _of_one(kind: Any, system: Any, Ts: float | None, name: str | None, settings: dict[str, Any]) -> Any:
    """Law of one system, at every operating point."""
    label = name or getattr(system, "name", None) or type(system).__name__
    what = f"law {label}"
    try:
        foreign.check_channels(system, what, foreign.DISC, foreign.REFERENCES)
        A, B, C, D, own, _, _ = foreign.reorder(foreign.matrices(system), foreign.DISC, foreign.REFERENCES)
        if own == 0 and Ts is not None:
            A, B, C, D = tustin(System(A, B, C, D), Ts)
        elif system.dt is not True or Ts is None:
            foreign.check_period(system, what, Ts or RIG_SAMPLE, len(A), argument=True)
    except np.linalg.LinAlgError as error:
        raise LawError(f"{what}: has a pole at 2/Ts, which Tustin's rule cannot sample; choose another Ts") from error
    except DataError as error:
        raise LawError(str(error)) from error
    table: dict[str, Any] = {letter: M[None, None] for letter, M in zip("ABCD", (A, B, C, D), strict=True)}
    chosen: dict[str, Any] = DEFAULTS | {"about": {"from": f"control.{type(system).__name__}"}} | settings
    hold = chosen.pop("W", np.zeros((len(A), 2)))
    return kind(label, **table, W=np.asarray(hold)[None, None], speeds=np.zeros(1), pressures=np.zeros(1),
                Ts=Ts or RIG_SAMPLE, **chosen)  # fmt: skip


def mat_content(law: Any) -> dict[str, Any]:
    """Variables of a .mat file; matrices first, operating points after, as MATLAB's arrays of systems are."""
    content: dict[str, Any] = {"kind": "law", "name": law.name, "Ts": law.Ts}
    content |= {name: getattr(law, name).transpose(2, 3, 0, 1) for name in MATRICES}
    content |= {"speeds": law.speeds, "pressures": law.pressures, "bias": np.array(law.bias, float)}
    content |= {name: float(getattr(law, name)) for name in MAT_SETTINGS}
    content |= {"centre": np.array([] if law.centre is None else law.centre, float)}
    content |= {"gamma": np.nan if law.gamma is None else law.gamma, "about": json.dumps(law.about)}
    if law.plausibility is not None:
        content |= {"plausibility": json.dumps(law.plausibility.to_dict())}
    if law.runout is not None:
        content |= {"runout": json.dumps(law.runout.to_dict())}
    return content | {"InputName": foreign.cells(foreign.DISC), "OutputName": foreign.cells(foreign.REFERENCES)}


def from_mat(kind: Any, path: Path) -> Any:
    """Law, of the class `kind`, of a .mat file; raises LawError."""
    try:
        content = foreign.read_mat(path)
        if content.get("kind", "law") != "law":
            raise DataError(f"is a {content['kind']} model; give a control law, or design one on it")
        Ts = foreign.number(content, "Ts", 0.0)
        if Ts == 0:
            raise DataError(f"is continuous, Ts = 0; sample it in MATLAB: sys = c2d(sys, {RIG_SAMPLE:g}, 'tustin')")
        law = _of_content(kind, path.stem, content, Ts)
    except (DataError, LawError) as error:
        raise LawError(f"{path}: {error}") from error
    except (ValueError, TypeError, AttributeError) as error:
        raise LawError(f"{path}: is not a law ({error}); save one by 'law.save' or A, B, C, D, Ts") from error
    warn_unstable(law)
    return law


def _ordered(content: dict[str, Any], table: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Matrices with the channels in the order x, y where the file names them otherwise; raises DataError."""
    orders = []
    for key, names in (("InputName", foreign.DISC), ("OutputName", foreign.REFERENCES)):
        labels = foreign.texts(content, key, names)
        foreign.check_labels(labels, names, key)
        orders.append(foreign.channel_order(labels, names))
    into, out = orders
    if orders == [[0, 1], [0, 1]]:
        return table
    B, C, D, W = (table[letter] for letter in "BCDW")
    return table | {"B": B[:, into], "C": C[out], "D": D[out][:, into], "W": W[:, out]}


def _of_content(kind: Any, name: str, content: dict[str, Any], Ts: float) -> Any:
    speeds, pressures = (np.ravel(content.get(key, 0.0)) for key in ("speeds", "pressures"))
    n = len(content["A"])
    table = {"W": np.zeros((n, 2, speeds.size, pressures.size))} | {k: content[k] for k in MATRICES if k in content}
    foreign.check_rest(content, MAT_READ)
    B, C, D = (np.asarray(table[letter], float) for letter in "BCD")
    table |= dict(zip("BCD", foreign.in_si(content, B, C, D, "m", "V"), strict=True))
    table = _ordered(content, table)
    stacked = {}
    for letter, M in table.items():
        full = np.asarray(M, float).reshape(M.shape[0], M.shape[1], *M.shape[2:], *(1,) * (4 - M.ndim))
        stacked[letter] = full.transpose(2, 3, 0, 1)
    chosen: dict[str, Any] = dict(DEFAULTS)
    chosen |= {key: foreign.number(content, key, np.nan) for key in MAT_SETTINGS if key in content}
    chosen |= {} if "refresh" not in chosen else {"refresh": int(chosen["refresh"])}
    centre, gamma = np.ravel(content.get("centre", ())), foreign.number(content, "gamma", np.nan)
    chosen |= {"centre": tuple(map(float, centre)) if centre.size == 2 else None}
    chosen |= {"bias": tuple(map(float, np.ravel(content["bias"])))} if "bias" in content else {}
    chosen |= {"gamma": None if np.isnan(gamma) else gamma, "about": parse_json(content.get("about", "{}"))}
    if "plausibility" in content:
        chosen |= {"plausibility": Plausibility.from_dict(parse_json(content["plausibility"]))}
    if "runout" in content:
        chosen |= {"runout": RunoutTable.from_dict(parse_json(content["runout"]))}
    return kind(content.get("name", name), **stacked, speeds=speeds, pressures=pressures, Ts=Ts, **chosen)
