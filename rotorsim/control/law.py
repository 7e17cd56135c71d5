r"""`Law`: common run-time form of all controllers, a discrete state space scheduled over speed and pressure.

.. math:: x_{k+1} = A(q) x_k + B(q) (y_k - y_c), \qquad u_k = C(q) x_k + D(q) (y_k - y_c)

y [m] is the measured disc, less the runout of the sensors where the law has a table of it, y_c the position that asks
for nothing, u [V] the reference, which the plant receives one sample later. The matrices are a table over (speed,
pressure); see `rotorsim.control.law_kernel` for a sample.

Cites: thesis.
"""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rotorsim.base.display import Card, Shown
from rotorsim.base.errors import LawError, OtherMachine
from rotorsim.base.files import write_json
from rotorsim.base.foreign_systems import is_mat, state_space, write_mat
from rotorsim.base.input_files import instead, parse_json
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control import law_exchange
from rotorsim.control.guard import Guarded
from rotorsim.control.law_kernel import LawLayout, make_layout, refresh, step
from rotorsim.control.plants import Model
from rotorsim.control.plausibility import Plausibility
from rotorsim.control.runout import RunoutTable

MATRICES = law_exchange.MATRICES
LIMIT = 5.0
"""Range of the reference [V]."""


class LawSettings(NamedTuple):
    """Settings of a running law apart from its table; times in samples."""

    refresh: float
    start: float
    average: float
    fade: float
    limit: float
    bias_x: float
    bias_y: float


@dataclass(frozen=True, eq=False, repr=False)
class Law(Guarded, Shown):
    """Scheduled discrete controller with saturation, anti-windup and a switch-on without a jump.

    Parameters
    ----------
    A, B, C, D, W : arrays (s, p, n, n), (s, p, n, 2), (s, p, 2, n), (s, p, 2, 2), (s, p, n, 2)
        Matrices over speeds and pressures; y in m, u in V. W is the anti-windup gain.
    speeds, pressures : arrays (s,), (p,)
        Grid of the table [rad/s], [Pa, gauge], ascending; one of each for a law that is not scheduled.
    Ts : float
        Sampling time [s].
    refresh : int
        The table is read every so many samples.
    limit : float
        Largest magnitude of u [V].
    bias : (float, float)
        Constant part of u [V].
    start, average, fade : float
        Seconds until the law wakes, during which it then seeks y_c as the mean of y, and in which its output then
        rises from nothing to all.
    centre : (float, float) or None
        y_c [m] where it is known; None seeks it if `average` is positive and takes zero if not.
    gamma : float or None
        Bound that the design has proved, where it has one.
    about : dict
        What it was designed from, as plain values.
    plausibility : Plausibility or None
        Limits beyond which a sample is bad; None: a sample is bad where it is not a finite number.
    runout : RunoutTable or None
        Runout over the shaft angle that is taken off every sample; None takes nothing off.

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.load_law("law.json")
    >>> law.step((1e-6, 0.0), 300.0, 0.5e6).shape
    (2,)
    """

    name: str
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    W: np.ndarray
    speeds: np.ndarray
    pressures: np.ndarray
    Ts: float = RIG_SAMPLE
    refresh: int = 1
    limit: float = LIMIT
    bias: tuple[float, float] = (0.0, 0.0)
    start: float = 0.0
    average: float = 0.0
    fade: float = 0.0
    centre: tuple[float, float] | None = None
    gamma: float | None = None
    about: dict[str, Any] = field(default_factory=dict)
    plausibility: Plausibility | None = None
    runout: RunoutTable | None = None

    def __post_init__(self) -> None:
        for name in (*MATRICES, "speeds", "pressures"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), float))
        if self.runout is not None and not isinstance(self.runout, RunoutTable):
            raise LawError(
                f"law {self.name}: runout is a {type(self.runout).__name__}; give rs.control.runout_table(slow_roll)",
                argument="runout",
            )
        check_shapes(self)
        check_numbers(self)

    def card(self) -> Card:
        """Order, schedule, settings and fingerprint."""
        s, p = self.speeds.size, self.pressures.size
        table = f"scheduled over {s} speeds x {p} pressures" if self.scheduled else "not scheduled"
        centre = "sought" if self.centre is None and self.average else "zero" if self.centre is None else "given"
        rows = [
            ("fingerprint", self.hash),
            ("Ts", f"{self.Ts * 1e3:g} ms"),
            ("limit", f"{self.limit:g} V"),
            ("bias", f"{self.bias[0]:g}, {self.bias[1]:g} V"),
            ("centre", centre),
        ]
        if self.plausibility is not None:
            rows.append(("plausibility", self.plausibility.text))
        if self.runout is not None:
            rows.append(("runout table", self.runout.text))
        if self.gamma is not None:
            rows.insert(0, ("gamma", f"{self.gamma:.4g}"))
        return Card(f"Law {self.name}: {self.order} states, {table}", rows)

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.A.shape[-1])

    @property
    def scheduled(self) -> bool:
        """Whether the matrices depend on the operating point."""
        return self.speeds.size * self.pressures.size > 1

    @cached_property
    def layout(self) -> LawLayout:
        """Offsets in table and memory."""
        predictors = None if self.plausibility is None else self.plausibility.sizes
        angles = 0 if self.runout is None else len(self.runout.values)
        return make_layout(self.order, self.speeds.size, self.pressures.size, predictors, angles)

    @cached_property
    def table(self) -> np.ndarray:
        """All matrices as one flat array, block after block; pressure runs fastest.

        Limits, predictors and runout follow.
        """
        parts = [getattr(self, name).reshape(self.speeds.size, self.pressures.size, -1) for name in MATRICES]
        flat = np.concatenate(parts, axis=2).ravel()
        checks = np.zeros(0) if self.plausibility is None else self.plausibility.table
        return np.concatenate([flat, checks, np.zeros(0) if self.runout is None else self.runout.values.ravel()])

    @cached_property
    def axes(self) -> np.ndarray:
        """Speeds, then pressures; those of the predictors follow."""
        own = (self.speeds, self.pressures)
        return np.concatenate(own if self.plausibility is None else (*own, self.plausibility.axes))

    @cached_property
    def settings(self) -> LawSettings:
        """Times in samples, limits, bias."""
        average = 0 if self.centre is not None else round(self.average / self.Ts)
        values = (self.refresh, round(self.start / self.Ts), average, round(self.fade / self.Ts), self.limit)
        return LawSettings(*map(float, values), *map(float, self.bias))

    @cached_property
    def memory(self) -> np.ndarray:  # type: ignore[override]
        """The running law's one flat memory; copy it to save, write it back to restore."""
        w = np.zeros(self.layout.size)
        w[self.layout.centre : self.layout.centre + 2] = self.centre or (0.0, 0.0)
        return w

    @cached_property
    def _out(self) -> np.ndarray:
        return np.zeros(2)

    def reset(self) -> None:
        """Forget the past."""
        self.memory[:] = 0.0
        self.memory[self.layout.centre : self.layout.centre + 2] = self.centre or (0.0, 0.0)

    def check_sampling(self, Ts: float) -> None:
        """Raise LawError unless the sampling time is that of the plant, Ts [s]."""
        if abs(self.Ts / Ts - 1) > 1e-9:
            raise LawError(
                f"law {self.name}: Ts = {self.Ts * 1e3:g} ms, and the plant samples every {Ts * 1e3:g} ms; "
                f"design it with Ts = {Ts:g} s",
                argument="Ts",
                value=self.Ts,
            )

    def other_machine(self, name: str) -> str:
        """A sentence if the law was designed on a model of another machine than that of this name; else empty."""
        return other_machine(self.name, str(self.about.get("machine", "")), name)

    def check_machine(self, name: str) -> None:
        """Warn OtherMachine as `other_machine` states, and of a runout table of another machine."""
        if sentence := self.other_machine(name):
            warnings.warn(sentence, OtherMachine, stacklevel=4)
        if self.runout is not None and self.runout.machine not in ("", name):
            warnings.warn(
                f"law {self.name}: its runout table is that of {self.runout.machine}, and the machine is {name}; take "
                "one from a slow roll of this machine",
                OtherMachine,
                stacklevel=4,
            )

    def step(self, measured: Any, speed: float, pressure: float, angle: float | None = None) -> np.ndarray:
        """Reference (2,) [V] from the measured disc (2,) [m], speed [rad/s] and gauge pressure [Pa] of a sample.

        A law with a runout table also takes the measured shaft `angle` [rad].
        A sample that is NaN, infinite or beyond the limits of `plausibility` does not reach the states: the last output
        is held for 5 samples and then fades out within 100; with good samples the law comes back without a jump, after
        a whole fade from rest.
        `alarm` is the reason.
        """
        if len(measured) != 2:
            raise LawError(f"law {self.name}: measured has {len(measured)} channels and the law 2; give disc x and y")
        if self.runout is not None and angle is None:
            raise LawError(
                f"law {self.name}: has a runout table and was given no shaft angle; call step(measured, speed, "
                "pressure, angle)",
                argument="angle",
            )
        x, y, turn = float(measured[0]), float(measured[1]), 0.0 if angle is None else float(angle)
        step(self.memory, self.table, self.axes, self.layout, self.settings, x, y, speed, pressure, turn, self._out)
        return self._out.copy()

    def applied(self, reference: Any) -> None:
        """Reference (2,) [V] that acts in this sample, given before `step` where it is not the law's last output.

        Without it what is added to the output, such as a PRBS, counts as evidence against the signs of the sensors;
        `simulate`, experiments and verification give it.
        """
        if self.layout.pn:
            at = self.layout.applied
            self.memory[at : at + 3] = 1.0, float(reference[0]), float(reference[1])

    @property
    def guard_at(self) -> int:
        """Place of the guard's memory in the law's."""
        return self.layout.guard

    def at(self, speed: float, pressure: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C, D as they run at an operating point."""
        w, L, n = np.zeros(self.layout.size), self.layout, self.order
        refresh(w, self.table, self.axes, L, float(speed), float(pressure))
        return (
            w[: L.B].reshape(n, n), w[L.B : L.C].reshape(n, 2), w[L.C : L.D].reshape(2, n), w[L.D : L.W].reshape(2, 2)
        )  # fmt: skip

    def with_(self, **changes: Any) -> Law:
        """The same law with other settings, at rest."""
        return replace(self, **changes)

    @classmethod
    def from_control(
        cls, system: Any, Ts: float | None = None, name: str | None = None, model: Model | None = None, **settings: Any
    ) -> Law:
        """The law of a linear system of the package `control`, or of several over speed and pressure.

        Parameters
        ----------
        system : control.StateSpace, control.TransferFunction or mapping
            Disc x, y [m] in, references x, y [V] out; the sign is the system's own: u = K y. Labels disc_x, disc_y,
            reference_x, reference_y in another order are followed. A mapping holds one by (speed [rad/s], gauge
            pressure [Pa]) at each point of a grid, all in the same coordinates of the state.
        Ts : float, optional
            Sampling time [s] that a continuous system is sampled at, by Tustin's rule; a sampled one must have it. By
            default 0.2 ms, the rig's, and a continuous system is refused.
        name : str, optional
            Of the law; by default the system's.
        model : LpvModel or LinearModel, optional
            Of the plant that the law is for: makes the plausibility limits, as for a law designed here.
        **settings
            Fields of `Law` such as `limit`, `bias`, `centre`. By default the law seeks its centre for 0.2 s and comes
            in within 0.05 s; ``average=0, fade=0`` switch that off.

        Raises
        ------
        LawError
            For a wrong number of signals, a continuous system without `Ts`, another sampling time, a grid with gaps.

        Warns
        -----
        UnstableLaw
            Of a law whose own states grow at a point of its table, or half way between two.

        Examples
        --------
        >>> import control, rotorsim as rs
        >>> lag = control.tf([0.2e6], [1 / 6283.0, 1.0])
        >>> rs.Law.from_control(control.append(lag, lag), Ts=2e-4).order
        2
        """
        return law_exchange.from_control(cls, system, Ts, name, model, settings)

    def to_control(self, speed: float = 0.0, pressure: float = 0.0) -> Any:
        """The law at an operating point [rad/s], [Pa, gauge] as control.StateSpace, without limits and bias.

        Examples
        --------
        >>> import rotorsim as rs
        >>> rs.load_law("law.json").to_control(300.0, 0.5e6).dt
        0.0002
        """
        A, B, C, D = self.at(speed, pressure)
        return state_space(A, B, C, D, self.Ts, ("disc_x", "disc_y"), ("reference_x", "reference_y"), self.name)

    def attrs(self) -> dict[str, Any]:
        """Name, order and fingerprint for a record's attributes."""
        machine = {"law_machine": self.about["machine"]} if self.about.get("machine") else {}
        table = {} if self.runout is None else {"law_runout": self.runout.origin}
        return {"law": self.name, "law_order": self.order, "law_hash": self.hash} | machine | table

    @cached_property
    def hash(self) -> str:
        """Fingerprint of everything that decides what the law does."""
        content = self.table.tobytes() + self.axes.tobytes() + repr((self.Ts, self.settings, self.centre)).encode()
        return hashlib.sha256(content).hexdigest()[:16]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for JSON."""
        data: dict[str, Any] = {"kind": "law"}
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            data[name] = value.tolist() if isinstance(value, np.ndarray) else value
        data["plausibility"] = None if self.plausibility is None else self.plausibility.to_dict()
        data["runout"] = None if self.runout is None else self.runout.to_dict()
        return data

    def save(self, path: str | Path) -> None:
        """Write the law as JSON, or as .mat by the ending; numbers come back bit for bit.

        In the .mat file A (n, n, speeds, pressures) and B, C, D, W alike are as ``ss(A, B, C, D, Ts)`` takes them.

        Examples
        --------
        >>> import rotorsim as rs
        >>> rs.load_law("law.json").save("again.mat")
        """
        if is_mat(path):
            write_mat(path, law_exchange.mat_content(self))
        else:
            write_json(path, self.to_dict(), indent=None)


def load_law(path: str | Path) -> Law:
    """Law of a JSON file that `Law.save` or `rotorsim design` wrote, or of a .mat file with A, B, C, D, Ts.

    Raises
    ------
    LawError
        For any other file.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_law("law.json").order
    8
    """
    path = Path(path)
    if is_mat(path) and path.is_file():
        return law_exchange.from_mat(Law, path)
    try:
        data = parse_json(path.read_text(encoding="utf-8-sig"))
        if (kind := data.pop("kind", None)) != "law":
            raise ValueError(f"its kind is '{kind}'" if kind else "it does not state its kind")
        if not any(np.size(data[name]) for name in NO_STATES):  # JSON does not keep the shape of a law without states
            grid = (len(data["speeds"]), len(data["pressures"]))
            data |= {name: np.zeros((*grid, *shape)) for name, shape in NO_STATES.items()}
        for name in ("bias", "centre"):
            data[name] = None if data[name] is None else tuple(data[name])
        if data.get("plausibility") is not None:
            data["plausibility"] = Plausibility.from_dict(data["plausibility"])
        if data.get("runout") is not None:
            data["runout"] = _runout_of(path, data["runout"])
        return Law(**data)
    except FileNotFoundError as error:
        raise LawError(f"{path}: is not there; give a file that 'rotorsim design' wrote") from error
    except (UnicodeDecodeError, IsADirectoryError, ValueError, KeyError, TypeError, AttributeError) as error:
        reason = instead(path, "a law", "a control law of 'rotorsim design'") or f"is not a law ({error})"
        raise LawError(f"{path}: {reason}; give a JSON file that 'rotorsim design' wrote") from error


def _runout_of(path: Path, data: Any) -> RunoutTable:
    """Runout table in a law's file, whose errors name the file."""
    try:
        return RunoutTable.from_dict(data)
    except LawError as error:
        raise LawError(f"{path}: {error}", **error.where) from error


MOST_STATES = 400
NO_STATES = {"A": (0, 0), "B": (0, 2), "C": (2, 0), "W": (0, 2)}
"""Matrices of a law without states and their shapes."""


def check_shapes(law: Any) -> None:
    """Raise LawError unless the matrices fit the grid, with two inputs and outputs, and the axes ascend."""
    grid = (law.speeds.size, law.pressures.size)
    n = law.A.shape[-1] if law.A.ndim == 4 else -1
    if law.B.ndim == 4 and law.C.ndim == 4 and (law.B.shape[-1] != 2 or law.C.shape[-2] != 2):
        raise LawError(
            f"law {law.name}: {law.B.shape[-1]} measured and {law.C.shape[-2]} driven channels; "
            "the plant has disc x, y and reference x, y: two each",
            argument="channels",
            value=(law.B.shape[-1], law.C.shape[-2]),
        )
    shapes = {"A": (n, n), "B": (n, 2), "C": (2, n), "D": (2, 2), "W": (n, 2)}
    for name, shape in shapes.items():
        found = getattr(law, name).shape
        if found != (*grid, *shape):
            raise LawError(f"law {law.name}: {name} has shape {found}; expected {(*grid, *shape)}")
        if not np.all(np.isfinite(getattr(law, name))):
            raise LawError(f"law {law.name}: {name} holds NaN or infinite numbers; design it again")
    if n > MOST_STATES:
        raise LawError(f"law {law.name}: {n} states; give at most {MOST_STATES}, reduce it")
    for name in ("speeds", "pressures"):
        if np.any(np.diff(getattr(law, name)) <= 0) or not np.all(np.isfinite(getattr(law, name))):
            raise LawError(f"law {law.name}: {name} do not ascend; sort them and give each once")


def check_numbers(law: Any) -> None:
    """Raise LawError for settings out of their range."""
    if not 0 < law.Ts < 1:
        raise LawError(f"law {law.name}: Ts = {law.Ts} s; give a time between 0 and 1 s, e.g. {RIG_SAMPLE:g}")
    if law.refresh < 1 or law.refresh != int(law.refresh):
        raise LawError(f"law {law.name}: refresh = {law.refresh}; give a whole number of samples, 1 or more")
    if not law.limit > 0:
        raise LawError(f"law {law.name}: limit = {law.limit} V; give a positive voltage")
    if not max(map(abs, law.bias)) < law.limit:
        raise LawError(f"law {law.name}: bias = {law.bias} V leaves no room below the limit of {law.limit:g} V")
    if min(law.start, law.average, law.fade) < 0:
        raise LawError(f"law {law.name}: start, average and fade are times; give 0 s or more")


def other_machine(law: str, designed: str, name: str) -> str:
    """A sentence if a law was designed on a model of another machine than `name`; else empty.

    `designed` is name and fingerprint of the model's machine, a space between, or empty.
    """
    designed = designed.rpartition(" ")[0]
    if designed in ("", name):
        return ""
    return (
        f"law {law}: was designed on a model of {designed}, and the machine is {name}: a test of robustness; "
        "design it on a model of this machine to use it there"
    )
