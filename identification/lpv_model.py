r"""LPV model: the parameters of a structure as polynomial surfaces over q = (speed, pressure) (thesis, 2.6 to 2.8).

.. math:: \dot x = A(q(t)) x + B(q(t)) u, \quad y = C x, \qquad
          \theta(q) = \sum_{i + j \le n} c_{ij}\, \bar q_1^i \bar q_2^j, \quad \bar q = (q - q_{mid}) / q_{half}

The surfaces are least squares over the points, each parameter alone; scaling to [-1, 1] keeps the columns apart. The
rate of change of q is neglected, as in the thesis (section 2.4): valid for slow scheduling. `load_model` reads the
files of models, local or parameter-varying.

Cites: thesis.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.local.blackbox import FullStateSpace
from identification.local.greybox import STRUCTURES, delays, modes, static_gain
from identification.local.models import LinearModel, plain
from identification.local.simulation import respond
from rotorsim.base.display import Card, Shown
from rotorsim.base.errors import DataError, ModelError, UnfitError
from rotorsim.base.files import write_json
from rotorsim.base.foreign_systems import cells, is_mat, name_rest, read_mat, sampling_call, write_mat
from rotorsim.base.input_files import instead, parse_json
from rotorsim.base.rounding import ALIKE
from rotorsim.base.units import RIG_SAMPLE, TO_MPA, TO_RPM

SAME = (0.5, 500.0)
"""Speeds [rad/s] and pressures [Pa] closer than this count as one grid line."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Monomials of scaled scheduling variables: exponents (t, 2), middle (2,) and half range (2,) [rad/s, Pa]."""

    exponents: np.ndarray
    middle: np.ndarray
    half: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (k, t) at operating points (k, 2) [rad/s, Pa]."""
        scaled = (np.atleast_2d(points) - self.middle) / self.half
        return np.asarray(np.prod(scaled[:, None, :] ** self.exponents[None], axis=2))


def make_basis(points: np.ndarray, order: int) -> Basis:
    """Basis of total degree `order` for operating points (k, 2); a variable that never changes gets no terms.

    Raises UnfitError if points or grid lines are too few for the order, or the points lie on a curve that leaves it
    open.
    """
    points = np.atleast_2d(np.asarray(points, float))
    if not np.all(np.isfinite(points)):
        raise UnfitError("fit_lpv: a result has no speed or no pressure; give both in the record, constant if need be")
    if order not in range(0, 6):
        raise UnfitError(f"fit_lpv.order: {order}; choose a total degree of 0 to 5, or 'hold-out'")
    lines = [1 + np.count_nonzero(np.diff(np.sort(points[:, i])) > SAME[i]) for i in range(2)]
    moving = [count > 1 for count in lines]
    exponents = [(i, j) for total in range(order + 1) for i in range(total, -1, -1) if (j := total - i) >= 0]
    exponents = [(i, j) for i, j in exponents if (moving[0] or not i) and (moving[1] or not j)]
    for name, count, moves in zip(("speeds", "pressures"), lines, moving, strict=True):
        if moves and count <= order:
            raise UnfitError(
                f"fit_lpv.order: {count} different {name}, order {order} needs {order + 1} or more; "
                "add points or lower the order (`--surfaces` of a command)"
            )
    if len(points) < len(exponents):
        raise UnfitError(
            f"fit_lpv.order: {len(points)} points, surfaces of order {order} need {len(exponents)} or more; "
            "add points or lower the order (`--surfaces` of a command)",
            argument="order",
            value=order,
        )
    low, high = points.min(axis=0), points.max(axis=0)
    basis = Basis(np.array(exponents), (low + high) / 2, np.where(moving, (high - low) / 2, 1.0))
    singular = np.linalg.svd(basis.at(points), compute_uv=False)
    if singular[-1] < ALIKE * singular[0]:
        raise UnfitError(
            f"fit_lpv.order: the points lie on a curve over speed and pressure, along which surfaces of order {order} "
            "cannot be distinguished; add points near it or lower the order (`--surfaces`)"
        )
    return basis


def fit_surfaces(basis: Basis, points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Coefficients (q, t) of the surfaces through values (k, q) at points (k, 2)."""
    return np.asarray(np.linalg.lstsq(basis.at(points), values, rcond=None)[0].T)


def rms(values: np.ndarray) -> np.ndarray:
    """Root mean square (q,) over the rows of (k, q)."""
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=0)))


class ExtrapolationWarning(UserWarning):
    """Raised as a warning where a model is asked for outside the operating points it was identified at."""


@dataclass(frozen=True, eq=False, repr=False)
class LpvModel(Shown):
    """Surfaces of parameters.

    kind '1', '2', '3' or 'blackbox'; parameters: q names; coefficients (q, t) over `basis`; order of the polynomials;
    points (k, 2) [rad/s, Pa] it was made from; low, high (2,): their range; rms_identification, rms_hold_out (q,):
    distance of surfaces and local values, the latter at points that were left out; Ts [s] of black-box models, else 0;
    `machine` is name and fingerprint of the machine, empty where unknown.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_model("model.json").at(300.0, 0.5e6).order > 0
    True
    """

    kind: str
    parameters: tuple[str, ...]
    coefficients: np.ndarray
    basis: Basis
    order: int
    points: np.ndarray
    rms_identification: np.ndarray
    rms_hold_out: np.ndarray
    refined: str = "none"
    Ts: float = 0.0
    states: int = 0
    machine: str = ""

    def card(self) -> Card:
        """Kind, range and points."""
        (w0, p0), (w1, p1) = self.low, self.high
        time = f"sampled every {self.Ts * 1e3:g} ms" if self.Ts else "continuous"
        rows = [
            ("speed", f"{w0 * TO_RPM:.0f} to {w1 * TO_RPM:.0f} rpm"),
            ("pressure", f"{p0 * TO_MPA:.4g} to {p1 * TO_MPA:.4g} MPa"),
            ("made of", f"{len(self.points)} operating points"),
            ("surfaces", f"degree {self.order}, {len(self.parameters)} parameters, refinement: {self.refined}"),
        ]
        return Card(f"LpvModel {self.kind}: {time}", rows)

    @property
    def low(self) -> np.ndarray:
        """Smallest speed [rad/s] and pressure [Pa]."""
        return np.asarray(self.points.min(axis=0))

    @property
    def slack(self) -> np.ndarray:
        """Speed [rad/s] and pressure [Pa] (2,) beyond the range at which a point still counts as inside."""
        return 0.01 * (self.high - self.low) + (0.5, 500.0)

    @property
    def high(self) -> np.ndarray:
        """Largest speed [rad/s] and pressure [Pa]."""
        return np.asarray(self.points.max(axis=0))

    def theta(self, speed: float, pressure: float) -> np.ndarray:
        """Parameters (q,) at an operating point."""
        return np.asarray(self.coefficients @ self.basis.at(np.array([[speed, pressure]]))[0])

    def outside(self, speed: float, pressure: float) -> bool:
        """Whether an operating point lies beyond the range of those identified, by more than 1 % of the range."""
        q = np.array([speed, pressure])
        return bool(np.any(q < self.low - self.slack) or np.any(q > self.high + self.slack))

    def at(self, speed: float, pressure: float) -> LinearModel:
        """Frozen model at `speed` [rad/s] and gauge `pressure` [Pa]; warns and marks it where it is extrapolated."""
        beyond = self.outside(speed, pressure)
        if beyond:
            (w0, p0), (w1, p1) = self.low, self.high
            warnings.warn(
                f"lpv: {speed:.4g} rad/s, {pressure:.4g} Pa lies outside {w0:.4g}-{w1:.4g} rad/s, {p0:.4g}-{p1:.4g} Pa;"
                " the model is extrapolated, identify records there",
                ExtrapolationWarning,
                stacklevel=2,
            )
        A, B, C, D = self._matrices(self.theta(speed, pressure))
        return LinearModel(
            A, B, C, D, self.Ts, speed=speed, pressure=pressure, extrapolated=beyond, machine=self.machine
        )  # fmt: skip

    def _matrices(self, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        if self.kind == "blackbox":
            return FullStateSpace(self.states, 2, 2).sampled(theta)
        return STRUCTURES[self.kind].matrices(theta)

    def derived(self, speed: float, pressure: float) -> dict[str, np.ndarray]:
        """wn [rad/s], zeta, delay [s] (2,) and static_gain (2, 2) [m/V] at an operating point."""
        theta = self.theta(speed, pressure)
        if self.kind == "blackbox":
            A, B, C, D = self._matrices(theta)
            model = LinearModel(A, B, C, D, self.Ts)
            return {"wn": model.wn, "zeta": model.zeta, "static_gain": model.static_gain, "delay": np.full(2, np.nan)}
        wn, zeta = modes(theta)
        gain, delay = static_gain(self.kind, theta), delays(self.kind, theta)
        return {"wn": wn, "zeta": zeta, "static_gain": gain, "delay": delay}

    def simulate(
        self, reference: Any, speed: Any, pressure: Any, Ts: float, x0: Any = None, tolerance: float = 1e-3
    ) -> np.ndarray:
        """Outputs (n, 2) [m] of held references (n, 2) [V] while speed and pressure move.

        Parameters
        ----------
        reference : (n, 2) [V]
        speed, pressure : number or (n,) [rad/s], [Pa, gauge]
        Ts : sampling time [s]
        x0 : state at the first sample, zero by default
        tolerance : the matrices are updated when q has moved by this share of its range

        Raises
        ------
        ModelError
            If shapes do not fit or a sampled model has another period.
        """
        u = np.ascontiguousarray(reference, float)
        if u.ndim != 2 or u.shape[1] != 2:
            raise ModelError(f"lpv.simulate.reference: shape {u.shape}, expected (n, 2); give both axes")
        try:
            q = np.column_stack([np.broadcast_to(np.asarray(v, float), len(u)) for v in (speed, pressure)])
        except ValueError as error:
            raise ModelError(f"lpv.simulate: speed or pressure is neither a number nor {len(u)} samples") from error
        y = np.empty((len(u), 2))
        x = None if x0 is None else np.asarray(x0, float)
        for first, last in stretches((q - self.basis.middle) / self.basis.half, tolerance):
            model = self.at(*q[(first + last) // 2]).discrete(Ts)
            x = np.zeros(model.order) if x is None else x
            states = respond(model.A, model.B, np.eye(model.order), np.zeros(model.B.shape), x, u[first:last])
            y[first:last] = states @ model.C.T
            x = model.A @ states[-1] + model.B @ u[last - 1]
        return y

    def to_control(self, speed: float, pressure: float) -> Any:
        """Frozen model at `speed` [rad/s] and gauge `pressure` [Pa] as control.StateSpace.

        Examples
        --------
        >>> import rotorsim as rs
        >>> rs.load_model("model.json").to_control(300.0, 0.5e6).nstates
        6
        """
        return self.at(speed, pressure).to_control()

    @classmethod
    def from_control(cls, systems: Mapping[tuple[float, float], Any], order: int = 1) -> LpvModel:
        """Surfaces through the matrices of systems at several operating points.

        Parameters
        ----------
        systems : mapping
            By (speed [rad/s], gauge pressure [Pa]) a control.StateSpace, sampled alike, two references in and two
            displacements out, no feedthrough, all in the same coordinates of the state.
        order : int
            Degree of the polynomials over the operating point.

        Raises
        ------
        ModelError
            If the systems differ in order or sampling time, or are continuous.
        UnfitError
            If the points are too few for the order.

        Examples
        --------
        >>> import control, rotorsim as rs
        >>> at = lambda a: control.ss([[a, 0], [0, a]], [[1, 0], [0, 1]], [[1, 0], [0, 1]], 0, 2e-4)
        >>> points = {(w, p): at(0.5 + w / 2e3) for w in (0.0, 300.0) for p in (3e5, 5e5)}
        >>> float(rs.LpvModel.from_control(points).at(150.0, 4e5).A[0, 0].round(6))
        0.575
        """
        if not systems:
            raise ModelError(
                "lpv: no systems; give a control.StateSpace by (speed, pressure) of several points", argument="systems"
            )
        models = {point: LinearModel.from_control(system, *point) for point, system in systems.items()}
        first = next(iter(models.values()))
        for (speed, pressure), one in models.items():
            where = f"lpv: system at {speed:g} rad/s, {pressure:g} Pa"
            if not one.Ts:
                raise ModelError(
                    f"{where}: is continuous; sample it: {sampling_call(systems[speed, pressure], RIG_SAMPLE, 'zoh')}"
                )
            if (one.order, one.Ts) != (first.order, first.Ts):
                raise ModelError(
                    f"{where}: {one.order} states, {one.Ts:g} s; the first has {first.order}, {first.Ts:g} s"
                )
            if (*one.D.shape, np.any(one.D)) != (2, 2, False):
                raise ModelError(f"{where}: needs two inputs, two outputs and D = 0; it has D of {one.D.shape}")
        points, n = np.array(list(models), float), first.order
        space, basis = FullStateSpace(n, 2, 2), make_basis(points, order)
        values = np.array([space.pack(one.A, one.B, one.C) for one in models.values()])
        coefficients = fit_surfaces(basis, points, values)
        error = rms(basis.at(points) @ coefficients.T - values)
        names = tuple(
            f"{letter}{i}" for letter, size in (("A", n * n), ("B", 2 * n), ("C", 2 * n)) for i in range(size)
        )
        return cls("blackbox", names, coefficients, basis, order, points, error, np.full(len(names), np.nan),
                   Ts=first.Ts, states=n)  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for JSON."""
        names = ("kind", "parameters", "order", "refined", "Ts", "states")
        arrays = ("coefficients", "points", "rms_identification", "rms_hold_out")
        data = {"kind": "lpv", "structure": self.kind, **{name: getattr(self, name) for name in names[1:]}}
        data |= {name: getattr(self, name) for name in arrays}
        data |= {f"basis_{name}": getattr(self.basis, name) for name in ("exponents", "middle", "half")}
        data["scheduling"] = ["speed [rad/s]", "gauge pressure [Pa]"]
        data |= {"machine": self.machine} if self.machine else {}
        return {key: plain(value) for key, value in data.items()}

    def save(self, path: str | Path) -> None:
        """Write the model as JSON, or as .mat by the ending.

        The .mat file also has A, B, C, D of the frozen models along a third dimension, for ``ss(A, B, C, D, Ts)``, at
        the operating points in `points` [rad/s, Pa].
        """
        if not is_mat(path):
            write_json(path, self.to_dict())
            return
        data = {key: _mat_value(value) for key, value in self.to_dict().items()}
        frozen = [self._matrices(self.theta(*point)) for point in self.points]
        stacked = {name: np.stack([one[i] for one in frozen], axis=-1) for i, name in enumerate("ABCD")}
        write_mat(path, data | stacked)

    @classmethod
    def from_mat(cls, content: dict[str, Any]) -> LpvModel:
        """The model of the variables of a .mat file that `save` wrote; raises KeyError, ValueError."""
        scalars = {name: content[name].item() for name in ("order", "Ts", "states")}
        flat = {name: content[name].ravel() for name in MAT_ROWS}
        exponents = content["basis_exponents"].astype(int)
        return cls.from_dict(content | flat | scalars | {"basis_exponents": exponents})

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> LpvModel:
        """The model of `to_dict`."""
        name_rest(set(data) - {*LPV_READ, *(key for key in data if key.startswith("basis_"))})
        basis = Basis(*(np.array(data[f"basis_{name}"]) for name in ("exponents", "middle", "half")))

        def array(name: str) -> np.ndarray:
            return np.array(data[name], float)

        return cls(
            data["structure"], tuple(data["parameters"]), array("coefficients"), basis, int(data["order"]),
            array("points"), array("rms_identification"), array("rms_hold_out"), data["refined"], float(data["Ts"]),
            int(data["states"]), str(data.get("machine", "")),
        )  # fmt: skip


LPV_READ = ("kind", "structure", "parameters", "coefficients", "order", "points", "rms_identification", "rms_hold_out",
            "refined", "Ts", "states", "machine", "scheduling", *"ABCD")  # fmt: skip
"""Entries of a stored model, in a .mat file with the frozen matrices."""
MAT_ROWS = ("rms_identification", "rms_hold_out", "basis_middle", "basis_half")
"""Arrays of one dimension, which a .mat file keeps as rows."""


def _mat_value(value: Any) -> Any:
    """A value of `to_dict` for a .mat file; None is NaN there."""
    if isinstance(value, list) and value and all(isinstance(one, str) for one in value):
        return cells(value)
    return np.array(value, float) if isinstance(value, list) else value


def stretches(scaled: np.ndarray, tolerance: float) -> list[tuple[int, int]]:
    """Stretches (first, last) through which q (n, 2), scaled to [-1, 1], stays within the tolerance of its start."""
    n, first, found = len(scaled), 0, []
    steps = np.flatnonzero(np.any(np.diff(scaled, axis=0) != 0, axis=1)) + 1
    for k in steps:
        if np.abs(scaled[k] - scaled[first]).max() > 2 * tolerance:
            found.append((first, int(k)))
            first = int(k)
    return [*found, (first, n)]


def load_model(path: str | Path) -> LinearModel | LpvModel:
    """Model of a JSON file that `save` or `rotorsim identify` wrote, or of a .mat file with A, B, C, D, Ts.

    Raises
    ------
    ModelError
        For any other file.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_model("model.json").order
    2
    """
    path = Path(path)
    if is_mat(path) and path.is_file():
        return _of_mat(path)
    try:
        data = parse_json(path.read_text(encoding="utf-8-sig"))
        kind = data["kind"]
        return LpvModel.from_dict(data) if kind == "lpv" else LinearModel.from_dict(data)
    except FileNotFoundError as error:
        raise ModelError(f"{path}: is not there; give a file that 'rotorsim identify' wrote") from error
    except (UnicodeDecodeError, json.JSONDecodeError, IsADirectoryError, KeyError, ValueError, TypeError) as error:
        plain = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        reason = instead(path, "a model", "a model of 'rotorsim identify'") or f"is not a model ({plain})"
        raise ModelError(f"{path}: {reason}; give a JSON file that 'rotorsim identify' wrote") from error


def _of_mat(path: Path) -> LinearModel | LpvModel:
    try:
        content = read_mat(path)
        return LpvModel.from_mat(content) if content.get("kind") == "lpv" else LinearModel.from_mat(content)
    except (DataError, ModelError) as error:
        raise ModelError(f"{path}: {error}") from error
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ModelError(f"{path}: is not a model ({error}); save one by 'model.save' or A, B, C, D, Ts") from error
