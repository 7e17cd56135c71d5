r"""Linear state-space models: modes, frequency response, discretisation, JSON files.

.. math:: \dot x = A x + B u,\; y = C x + D u \quad (T_s = 0), \qquad x_{k+1} = A x_k + B u_k \quad (T_s > 0)

Inputs are references [V], outputs displacements [m] from the operating point, time in s. A continuous model meets
sampled references through a zero-order hold, which is what a digital controller applies.

Cites: ljung_1999.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from identification.local.simulation import respond, zero_order_hold
from rotorsim.base import foreign_systems as foreign
from rotorsim.base.display import Card, Shown, several
from rotorsim.base.errors import DataError, ModelError
from rotorsim.base.files import write_json
from rotorsim.base.rounding import decays, unstable_poles
from rotorsim.base.units import TO_MPA, TO_RPM

OSCILLATING = 0.9
"""A pole pair counts as a mode below this damping ratio."""


@dataclass(frozen=True, eq=False, repr=False)
class LinearModel(Shown):
    """State-space model about an operating point.

    A (n, n), B (n, m), C (p, n), D (p, m) in SI units; Ts [s], 0 for continuous time; `speed` [rad/s] and `pressure`
    [Pa, gauge] of the operating point, NaN where unknown; `extrapolated` marks a model of an `LpvModel` outside the
    operating points it was made from; `machine` is name and fingerprint of the machine, empty where unknown.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model = rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    >>> model.stable
    True
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    Ts: float = 0.0
    inputs: tuple[str, ...] = ("reference_x", "reference_y")
    outputs: tuple[str, ...] = ("disc_x", "disc_y")
    speed: float = float("nan")
    pressure: float = float("nan")
    extrapolated: bool = False
    machine: str = ""

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)

    def card(self) -> Card:
        """Order, time, modes and operating point."""
        time = f"sampled every {self.Ts * 1e3:g} ms" if self.Ts else "continuous"
        rows = [("in", ", ".join(self.inputs)), ("out", ", ".join(self.outputs))]
        if len(self.wn):
            rows.insert(0, ("modes [Hz]", several(self.wn, scale=1 / (2 * np.pi))))
            rows.insert(1, ("damping ratios", several(self.zeta, ".3g")))
        if np.isfinite(self.speed):
            rows.insert(0, ("at", f"{self.speed * TO_RPM:.0f} rpm, {self.pressure * TO_MPA:g} MPa"))
        return Card(f"LinearModel: {self.order} states, {time}", rows)

    @property
    def poles(self) -> np.ndarray:
        """Poles (n,) [rad/s], of continuous time; those of a sampled model by the logarithm."""
        values = np.linalg.eigvals(self.A)
        return np.log(values.astype(complex)) / self.Ts if self.Ts else values

    @property
    def _modes(self) -> np.ndarray:
        poles = self.poles
        chosen = poles[(poles.imag > 0) & (-poles.real < OSCILLATING * np.abs(poles))]
        if self.Ts:
            chosen = chosen[chosen.imag < 0.999 * np.pi / self.Ts]
        return chosen[np.argsort(np.abs(chosen))]

    @property
    def wn(self) -> np.ndarray:
        """Natural frequencies of the oscillating modes [rad/s], ascending."""
        return np.abs(self._modes)

    @property
    def zeta(self) -> np.ndarray:
        """Damping ratios of the same modes."""
        return -self._modes.real / np.abs(self._modes)

    @property
    def stable(self) -> bool:
        """Whether every pole decays, by more than rounding."""
        return decays(np.linalg.eigvals(self.A)) if self.Ts else unstable_poles(self.A) == 0

    @property
    def static_gain(self) -> np.ndarray:
        """Outputs per constant input (p, m)."""
        left = np.eye(self.order) - self.A if self.Ts else -self.A
        return np.asarray(self.C @ np.linalg.solve(left, self.B) + self.D)

    def transfer(self, omega: Any) -> np.ndarray:
        """Frequency response (f, p, m) at frequencies omega (f,) [rad/s]."""
        omega = np.atleast_1d(np.asarray(omega, float))
        s = np.exp(1j * omega * self.Ts) if self.Ts else 1j * omega
        resolvent = np.linalg.solve(
            s[:, None, None] * np.eye(self.order) - self.A, np.broadcast_to(self.B, (len(s), *self.B.shape))
        )
        return np.asarray(self.C @ resolvent + self.D)

    def discrete(self, Ts: float) -> LinearModel:
        """The same model behind a zero-order hold of period Ts [s]; raises ModelError if it has another period."""
        if self.Ts:
            if abs(self.Ts / Ts - 1) > 1e-6:
                raise ModelError(f"model: is sampled at {self.Ts:g} s and not at {Ts:g} s; identify it from such data")
            return self
        A, B = zero_order_hold(self.A, self.B, Ts)
        return replace(self, A=A, B=B, Ts=Ts)

    def simulate(self, u: Any, Ts: float, x0: Any = None) -> np.ndarray:
        """Outputs (n, p) of inputs u (n, m) that are held for Ts [s], from the state x0."""
        model = self.discrete(Ts)
        start = np.zeros(self.order) if x0 is None else np.asarray(x0, float)
        return respond(model.A, model.B, model.C, model.D, start, np.ascontiguousarray(u, float))

    def to_control(self) -> Any:
        """The model as control.StateSpace; raises DataError where the package `control` is missing.

        Examples
        --------
        >>> import numpy as np, rotorsim as rs
        >>> model = rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
        >>> model.to_control().nstates
        2
        """
        return foreign.state_space(self.A, self.B, self.C, self.D, self.Ts, self.inputs, self.outputs)

    @classmethod
    def from_control(cls, system: Any, speed: float = float("nan"), pressure: float = float("nan")) -> LinearModel:
        """The model of a control.StateSpace or TransferFunction.

        Parameters
        ----------
        system : control.StateSpace or control.TransferFunction
            References [V] in, displacements [m] out; continuous or sampled. Names of its signals are kept unless they
            are the package's own u[0], y[0], ...; references and disc come in the order x, y.
        speed, pressure : float
            Operating point [rad/s], [Pa, gauge] that it holds for.

        Raises
        ------
        ModelError
            For anything else, an improper transfer function or an unknown sampling time.

        Examples
        --------
        >>> import control, rotorsim as rs
        >>> lag = control.tf([1e-6], [1e-3, 1.0])
        >>> rs.LinearModel.from_control(control.append(lag, lag), 300.0, 0.5e6).order
        2
        """
        try:
            found = foreign.reorder(foreign.matrices(system), foreign.REFERENCES, foreign.DISC)
            if found.Ts is None and len(found.A):
                raise DataError(f"{type(system).__name__}: its sampling time is not stated; give it dt=0 or dt=Ts")
        except DataError as error:
            raise ModelError(f"model: {error}") from error
        made = cls(*found[:4], found.Ts or 0.0, speed=speed, pressure=pressure)
        if any("[" in name for name in (*found.inputs, *found.outputs)):
            return made
        return replace(made, inputs=found.inputs, outputs=found.outputs)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for JSON."""
        content = {key: plain(value) for key, value in asdict(self).items() if key != "machine" or value}
        return {"kind": "linear", **content}

    def save(self, path: str | Path) -> None:
        """Write the model as JSON, or as .mat by the ending: A, B, C, D, Ts, InputName, OutputName, units, machine.

        Examples
        --------
        >>> import numpy as np, rotorsim as rs
        >>> model = rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
        >>> model.save("model.mat")
        >>> rs.load_model("model.mat").order
        2
        """
        if foreign.is_mat(path):
            foreign.write_mat(path, self._mat())
        else:
            write_json(path, self.to_dict())

    def _mat(self) -> dict[str, Any]:
        names = {"InputName": self.inputs, "OutputName": self.outputs}
        names |= {"InputUnit": ("V",) * len(self.inputs), "OutputUnit": ("m",) * len(self.outputs)}
        numbers = {"Ts": self.Ts, "speed": self.speed, "pressure": self.pressure}
        matrices = {name: getattr(self, name) for name in "ABCD"}
        machine = {"machine": self.machine} if self.machine else {}
        return {
            "kind": "linear",
            **matrices,
            **numbers,
            **machine,
            **{key: foreign.cells(one) for key, one in names.items()},
        }

    @classmethod
    def from_mat(cls, content: dict[str, Any]) -> LinearModel:
        """The model of a .mat file's variables; A, B, C, D and Ts are enough."""
        A, B, C, D = (np.asarray(content[name], float) for name in "ABCD")
        foreign.check_rest(content, MAT_READ)
        if (A.shape, B.shape, C.shape) != ((len(A), len(A)), (len(A), D.shape[1]), (D.shape[0], len(A))):
            raise ModelError(f"A {A.shape}, B {B.shape}, C {C.shape} and D {D.shape} do not fit together")
        B, C, D = foreign.in_si(content, B, C, D, "V", "m")
        numbers = [foreign.number(content, name, default) for name, default in MAT_NUMBERS.items()]
        if not (np.isfinite(numbers[0]) and numbers[0] >= 0):
            raise ModelError(f"Ts = {numbers[0]:g} s: give the sampling time, 0 for continuous time")
        signals = [foreign.texts(content, key, _signals(kind, count)) for key, kind, count in
                   (("InputName", "reference", D.shape[1]), ("OutputName", "disc", D.shape[0]))]  # fmt: skip
        machine = content.get("machine", "")
        if not isinstance(machine, str):
            raise ModelError("machine is not a text; give name and fingerprint of the machine, or leave it out")
        return cls(A, B, C, D, numbers[0], signals[0], signals[1], numbers[1], numbers[2], machine=machine)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> LinearModel:
        """The model of `to_dict`."""
        values = {field.name: data[field.name] for field in fields(cls) if field.name in data}
        rest = set(data) - set(values) - {"kind"}
        for name in "ABCD":
            values[name] = np.atleast_2d(np.asarray(values[name], float))
        for name in ("speed", "pressure"):
            values[name] = float("nan") if values.get(name) is None else float(values[name])
        made = cls(**values | {name: tuple(values[name]) for name in ("inputs", "outputs")})
        foreign.name_rest(rest)
        return made


MAT_READ = ("speed", "pressure", "InputName", "OutputName", "InputUnit", "OutputUnit", "machine")
"""Variables of a .mat file besides A, B, C, D and Ts."""
MAT_NUMBERS = {"Ts": 0.0, "speed": float("nan"), "pressure": float("nan")}
"""Scalars of a .mat file, with their values where they are missing."""


def _signals(kind: str, count: int) -> tuple[str, ...]:
    """Names of signals that a file does not name."""
    return tuple(f"{kind}_{label}" for label in ("xy" if count == 2 else range(1, count + 1)))


def plain(value: Any) -> Any:
    """Arrays as lists, numbers as Python's, NaN as None."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    return None if isinstance(value, float) and not np.isfinite(value) else value
