r"""Laws of designed controllers, single or on a grid of operating points, and variants of a law.

Variants (thesis section 3.2.5) have zero DC gain, or a constant reference of their own:

.. math:: K_0(z) = K(z)\, \frac{1 + a}{2} \frac{z - 1}{z - a}

Cites: thesis.
"""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from identification import LinearModel
from rotorsim.base.errors import DesignError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.law import LIMIT, Law
from rotorsim.control.law_exchange import DEFAULTS
from rotorsim.control.plants import MICRO, MILLI, Model
from rotorsim.control.plausibility import plausibility_of
from rotorsim.control.sampled_loop import check_loop
from rotorsim.control.systems import System, sampled_riccati, tustin


def discrete(system: System, Ts: float = RIG_SAMPLE) -> System:
    """Tustin's controller of one in um, V and ms, for Ts [s]; raises DesignError if it is too fast for Ts."""
    fastest = float(np.abs(np.linalg.eigvals(system.A)).max(initial=0.0)) * MILLI
    check_sampling_time(Ts)
    if fastest > 10 / Ts:
        raise DesignError(
            f"Ts = {Ts * 1e3:g} ms: the controller's fastest pole, {fastest:.3g} rad/s, exceeds 10/Ts = {10 / Ts:.3g}; "
            "sample faster or ask less of it"
        )
    return tustin(system, Ts * MILLI)


def check_sampling_time(Ts: float) -> None:
    """Raise DesignError if Ts [s] is not a sampling time."""
    if not 0 < Ts < 1:
        raise DesignError(f"Ts = {Ts} s: is not a sampling time; give e.g. {RIG_SAMPLE:g}")


def antiwindup(system: System, weight: float = 1e-2) -> np.ndarray:
    """Gain W (n, 2) that makes A - W C, which acts while the output is limited, decay (a Kalman gain)."""
    n = system.order
    if not n:
        return np.zeros((0, 2))
    A, C = system.A, system.C
    if np.abs(np.linalg.eigvals(A)).max() < 1 - 1e-6:
        return np.zeros((n, 2))  # nothing winds up
    level = max(float(np.linalg.norm(C @ system.B)), 1e-12)
    fault = "anti-windup: no gain holds the controller's states while it is limited"
    P = sampled_riccati(A.T, C.T, system.B @ system.B.T + 1e-12 * level**2 * np.eye(n), weight * np.eye(2), fault)
    return np.asarray(np.linalg.solve(weight * np.eye(2) + C @ P @ C.T, C @ P @ A.T).T)


def no_antiwindup(system: System) -> np.ndarray:
    """The state evolves as if nothing limited the output."""
    return np.zeros((system.order, 2))


def make_law(
    name: str, model: Model | None, grid: list[list[System]], speeds: Any, pressures: Any, spec: Any,
    gamma: float | None = None, **settings: Any,
) -> Law:  # fmt: skip
    """Law from discrete controllers in um and V over a grid of operating points; checks by the model they are for."""
    stacked: dict[str, Any] = {
        letter: np.array([[getattr(one, letter) for one in row] for row in grid]) for letter in "ABCD"
    }
    hold = settings.pop("antiwindup", antiwindup)
    stacked["W"] = np.array([[hold(one) for one in row] for row in grid])
    stacked["B"], stacked["D"] = stacked["B"] * MICRO, stacked["D"] * MICRO
    settings = DEFAULTS | settings
    about = {"design": name, "spec": plain_spec(spec)}
    about |= settings.pop("about", {})
    if machine := getattr(model, "machine", ""):
        about |= {"machine": machine}
    if model is not None:
        scheduled = np.size(speeds) * np.size(pressures) > 1
        settings["plausibility"] = plausibility_of(model, spec.Ts, settings.get("limit", LIMIT), scheduled)
    return Law(name, **stacked, speeds=np.atleast_1d(speeds), pressures=np.atleast_1d(pressures), gamma=gamma,
               Ts=spec.Ts, about=about, **settings)  # fmt: skip


def constant_law(
    name: str, model: Model | None, system: System, spec: Any, gamma: float | None = None, **settings: Any
) -> Law:
    """Law of one discrete controller in um and V."""
    return make_law(name, model, [[system]], 0.0, 0.0, spec, gamma, **settings)


def proved_law(name: str, model: Model, system: System, spec: Any, gamma: float | None = None, **settings: Any) -> Law:
    """The same, whose loop with the model decays at the specification's point; raises DesignError if it does not."""
    law = constant_law(name, model, system, spec, gamma, **settings)
    check_loop(law, model, [(spec.speed, spec.pressure)])
    return law


def plain_spec(spec: Any) -> dict[str, Any]:
    """A specification as plain values for JSON."""
    return {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(spec).items()}


def table_axes(model: Model, size: tuple[int, int], slowest: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and pressures of a table over the range of an LPV model; raises DesignError for a model without one."""
    if isinstance(model, LinearModel):
        raise DesignError(
            "model: holds for one operating point and the design is scheduled; give an LPV model of several points"
        )
    (w0, p0), (w1, p1) = model.low, model.high
    return _axis(max(w0, slowest), w1, size[0]), _axis(p0, p1, size[1])


def _axis(low: float, high: float, count: int) -> np.ndarray:
    return np.linspace(low, high, count) if high > low and count > 1 else np.array([(low + high) / 2])


def over_grid(speeds: np.ndarray, pressures: np.ndarray, at: Callable[[float, float], System]) -> list[list[System]]:
    """`at(speed, pressure)` for every point."""
    return [[at(float(speed), float(pressure)) for pressure in pressures] for speed in speeds]


def without_dc(law: Law, corner: float = 5.0) -> Law:
    """The law behind a high-pass of `corner` [Hz]: it leaves the equilibrium where it is, and slow disturbances too.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.without_dc(law, 5.0).order > law.order
    True
    """
    if not 0 < corner < 0.25 / law.Ts:
        raise DesignError(f"zero-dc: corner = {corner} Hz; give more than 0 and less than {0.25 / law.Ts:g} Hz")
    a = float(np.exp(-2 * np.pi * corner * law.Ts))
    level = (1 + a) / 2
    s, p, n = law.A.shape[:3]
    eye = np.broadcast_to(np.eye(2), (s, p, 2, 2))
    # the filter: f+ = a f + (1 - a) y, y' = level (y - f)
    zero = np.zeros((s, p, 2, n))
    A = np.block([[law.A, -level * law.B], [zero, a * eye]])
    B = np.concatenate([level * law.B, (1 - a) * eye], axis=2)
    C = np.concatenate([law.C, -level * law.D], axis=3)
    W = np.concatenate([law.W, np.zeros((s, p, 2, 2))], axis=2)
    about = law.about | {"zero_dc": corner}
    return law.with_(name=f"{law.name}_zero_dc", A=A, B=B, C=C, D=level * law.D, W=W, about=about)


def biased(law: Law, volts: tuple[float, float]) -> Law:
    """The law with a constant reference [V], which comes in with it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.biased(law, (0.5, 0.0)).bias
    (0.5, 0.0)
    """
    return law.with_(name=f"{law.name}_biased", bias=(float(volts[0]), float(volts[1])))
