r"""Design models: the identified model in micrometres, volts and milliseconds, with the loop delay if required.

A law acts one sample after what it has seen and its output is held for one: on average 1.5 samples late. A continuous
design that should know this adds the time to the model's own lag 1/p (Model 3), or gets a lag of its own in front.

Model 2, and Model 3 with dead times, are reduced to six states with lags and delays in one all-pass for each axis. Film
delay, actuators, or dead time and lag, and the loop's own delay become one delay for each axis, a first-order Pade
approximation:

.. math:: \frac{2/\tau - s}{2/\tau + s}, \qquad \tau = \frac2r + \frac{a_1}{a_0} + \tau_{loop}
          \quad\text{or}\quad \frac2r + \frac1p + \tau_{loop}

which keeps the gain at every frequency and the phase where it matters, below 200 Hz. One lag (Model 3 without dead
time) cannot: with the phase of a millisecond at the modes it takes a quarter of the gain away there, so that fitting
the modes raises the gain at rest by as much. Laws are checked against the whole model.

Cites: skogestad_2005.
"""

import warnings

import numpy as np

from identification import LinearModel
from identification.lpv_model import SAME, LpvModel
from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import first_of_largest
from rotorsim.base.units import MPA, RIG_SAMPLE, TO_RPM
from rotorsim.control.systems import System, held, late, normal, series, transformed

MICRO, MILLI = 1e6, 1e3
Model = LinearModel | LpvModel


def frozen(model: Model, speed: float, pressure: float, extrapolate: bool = False) -> LinearModel:
    """The continuous linear model at an operating point.

    Raises DesignError if the point lies outside the model's range and `extrapolate` is not given, or the model is not a
    map from references x, y to disc x, y.
    """
    if not extrapolate and outside(model, speed, pressure):
        raise DesignError(
            f"model: {point_text(speed, pressure)} lies outside the {range_text(model)} it was identified at; "
            "design within, or identify records there"
        )
    if isinstance(model, LpvModel):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = model.at(speed, pressure)
    else:
        found = model
    if found.B.shape[1] != 2 or found.C.shape[0] != 2:
        raise DesignError(
            f"model: {found.B.shape[1]} inputs and {found.C.shape[0]} outputs; a law needs a model from reference x, y "
            "to disc x, y"
        )
    if any(name.startswith("pin") for name in found.outputs):
        raise DesignError(
            f"model: its outputs are {', '.join(found.outputs)}, what the actuators do, and a law holds the disc; "
            "identify a model of the disc (model 3, 2 or 1)",
            argument="model",
            value=found.outputs,
        )
    if np.abs(found.D).max() > 0:
        raise DesignError("model: answers a reference at once (D is not zero); identify model 1, 2 or 3")
    return found


def outside(model: Model, speed: float, pressure: float) -> bool:
    """Whether an operating point is not one of the model's, up to 1 %; never for a model of an unknown point."""
    if isinstance(model, LpvModel):
        return model.outside(speed, pressure)
    own, slack = np.array([model.speed, model.pressure]), np.array(SAME)
    return bool(np.any(np.abs([speed, pressure] - own) > 0.01 * np.abs(own) + slack))


def only_point(model: Model) -> dict[str, float] | None:
    """Speed [rad/s] and supply pressure [Pa] of a model that holds at one point alone; None for any other."""
    if isinstance(model, LinearModel):
        return {"speed": model.speed, "pressure": model.pressure}
    point = dict(zip(("speed", "pressure"), map(float, model.low), strict=True))
    return point if np.array_equal(model.low, model.high) else None


def point_text(speed: float, pressure: float) -> str:
    """An operating point in readable form."""
    return f"{speed * TO_RPM:.0f} rpm, {pressure / MPA:.3g} MPa"


def range_text(model: Model) -> str:
    """Range of a model's operating points, or its one point."""
    if isinstance(model, LinearModel):
        return point_text(model.speed, model.pressure)
    (w0, p0), (w1, p1) = model.low, model.high
    return f"{w0 * TO_RPM:.0f} to {w1 * TO_RPM:.0f} rpm, {p0 / MPA:.3g} to {p1 / MPA:.3g} MPa"


def design_plant(model: Model, speed: float, pressure: float, delay: float = 0.0, extrapolate: bool = False) -> System:
    """Continuous plant in um, V and ms with `delay` [s] added to its lags; at most six states of grey-box models."""
    whole = scaled_model(model, speed, pressure, extrapolate)
    short = is_model_2(whole) or is_delayed_model_3(whole)
    return merged(whole, delay * MILLI) if short else with_delay(whole, delay * MILLI)


def scaled_model(model: Model, speed: float, pressure: float, extrapolate: bool = False) -> System:
    """The identified continuous model in um, V and ms, all its states."""
    found = frozen(model, speed, pressure, extrapolate)
    if found.Ts:
        raise DesignError(
            f"model: is sampled at {found.Ts:g} s and this design is made in continuous time; identify model 3"
        )
    system = System(found.A / MILLI, found.B / MILLI, found.C * MICRO, found.D * MICRO)
    scale = np.ones(system.order)
    if second_order(found.A):
        scale[:2], scale[2:4] = MICRO, MICRO / MILLI  # positions in um, velocities in um/ms
    if is_model_2(system):
        scale[4:] = np.array([MILLI, MILLI, 1, 1 / MILLI, 1, 1 / MILLI]) * MICRO  # pins likewise, and their integrals
    return transformed(system, scale)


def second_order(A: np.ndarray) -> bool:
    """Whether states 0, 1 of A (n, n) [1/s] are positions and 2, 3 their velocities, as in every grey-box structure."""
    return len(A) >= 4 and np.allclose(A[:2, 2:4], np.eye(2), rtol=1e-12, atol=0) and not A[:2, :2].any()


def lags(system: System) -> np.ndarray | None:
    """1/p (2,) of Model 3's input lags, or None for another structure."""
    A, B = system.A, system.B
    if system.order != 6 or A[4:, :4].any() or A[4, 5] or A[5, 4] or B[:4].any():
        return None
    P = -np.diag(A)[4:]
    return 1 / P if np.allclose(B[4:], np.diag(P)) and np.all(P > 0) else None


def with_delay(system: System, delay: float) -> System:
    """The plant with its input later by `delay`, as a lag."""
    if delay <= 0:
        return system
    own = lags(system)
    if own is None:
        lag = System(-np.eye(2) / delay, np.eye(2) / delay, np.eye(2), np.zeros((2, 2)))
        return series(lag, system)
    A, B = system.A.copy(), system.B.copy()
    P = np.diag(1 / (own + delay))
    A[4:, 4:], B[4:] = -P, P
    return System(A, B, system.C, system.D)


def sampled_plant(
    model: Model, speed: float, pressure: float, Ts: float = RIG_SAMPLE, extrapolate: bool = False
) -> System:
    """Discrete plant in um and V as the law meets it: held inputs that arrive one sample late."""
    found = frozen(model, speed, pressure, extrapolate)
    if found.Ts:
        found = found.discrete(Ts)
        return late(System(found.A, found.B, found.C * MICRO, found.D))
    return late(held(scaled_model(model, speed, pressure, extrapolate), Ts * MILLI))


def short_sampled_plant(model: Model, speed: float, pressure: float, Ts: float = RIG_SAMPLE) -> System:
    """The same, made of the model that continuous designs take, of at most six states."""
    return late(short_held_plant(model, speed, pressure, Ts))


def short_held_plant(model: Model, speed: float, pressure: float, Ts: float = RIG_SAMPLE) -> System:
    """The same without the sample of delay: behind the reference that acts."""
    found = frozen(model, speed, pressure)
    if found.Ts:
        found = found.discrete(Ts)
        return System(found.A, found.B, found.C * MICRO, found.D)
    return held(design_plant(model, speed, pressure), Ts * MILLI)


def modes(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [rad per time unit] and damping ratios of the lightly damped poles of a continuous plant."""
    poles = np.linalg.eigvals(system.A)
    poles = poles[(poles.imag > 0) & (-poles.real < 0.6 * np.abs(poles))]
    poles = poles[np.argsort(np.abs(poles))]
    return np.abs(poles), -poles.real / np.abs(poles)


def axis_modes(system: System) -> np.ndarray:
    """Natural frequency (2,) of the mode that moves x most, and of the other."""
    values, vectors = np.linalg.eig(system.A)
    keep = (values.imag > 0) & (-values.real < 0.6 * np.abs(values))
    if np.count_nonzero(keep) < 2:
        raise DesignError("model: has fewer than two oscillating modes; a notch weight needs one for each axis")
    values, shapes = values[keep], np.abs(system.C @ vectors[:, keep])
    first = np.argsort(np.abs(values))[:2]
    values, shapes = values[first], shapes[:, first] / shapes[:, first].sum(axis=0)
    x = first_of_largest(shapes[0])
    return np.abs(values[[x, 1 - x]])


def check_modes(system: System, name: str, tolerance: float = 1e-9) -> None:
    """Raise DesignError if a mode cannot be moved by the references or seen at the disc (Hautus' test).

    Whatever the units of states, references and disc: less than `tolerance` of what the strongest does counts as none.
    """
    system = normal(system)
    values, scale = np.linalg.eigvals(system.A), float(np.linalg.norm(system.A, 2))
    for value in values[values.imag >= 0]:
        shifted = value * np.eye(system.order) - system.A
        for word, block in (("uncontrollable", np.hstack([shifted, system.B])),
                            ("unobservable", np.vstack([shifted, system.C]))):  # fmt: skip
            if np.linalg.svd(block, compute_uv=False)[-1] < tolerance * scale:
                raise DesignError(
                    f"{name}: the model's mode at {abs(value) * MILLI / (2 * np.pi):.4g} Hz is {word}; "
                    "leave it out of the model or move actuators or sensors"
                )


ORDER, DELAYED = 10, 8
"""States of Model 2 and of Model 3 with dead times."""


def is_model_2(system: System) -> bool:
    """Whether a continuous system has the states of Model 2: rotor (4), delays (2), actuators (4)."""
    A, B = system.A, system.B
    if system.order != ORDER or B[:7].any() or B[8].any() or A[4:6, :4].any() or A[6:, :6].any():
        return False
    chains = not (A[4, 5] or A[5, 4] or A[6:8, 8:].any() or A[8:, 6:8].any() or A[2:6, [7, 9]].any())
    return bool(chains and np.all(np.diag(A)[4:6] < 0) and np.all(A[[7, 9], [6, 8]] < 0) and _pade(A))


def _pade(A: np.ndarray) -> bool:
    """Whether rotor and delays of Model 2 are driven as a Pade approximation drives them, not as a lag behind pins.

    Through the delays the pins' force is twice that past them, with the other sign; not quite where rates drive too.
    """
    through, past = np.diag(A[2:4, 4:6]) * A[[4, 5], [6, 8]], np.diag(A[2:4][:, [6, 8]])
    twice = -2 * past * -np.diag(A)[4:6]
    return bool(np.all(np.abs(through - twice) < 0.5 * np.abs(twice)))


def is_delayed_model_3(system: System) -> bool:
    """Whether a continuous system has the states of Model 3 with dead times: rotor (4), lags (2), dead times (2)."""
    A, B = system.A, system.B
    if system.order != DELAYED or B[:4].any() or A[4:, :4].any() or A[6:, 4:6].any() or A[2:4, 6:].any():
        return False
    own = A[4:6, 4:6], A[4:6, 6:], A[6:, 6:], B[4:6], B[6:]
    diagonal = not any((M - np.diag(np.diag(M))).any() for M in own)
    passing = np.allclose(B[4:6], A[4:6, 4:6])  # of an all-pass, past the dead times; two lags in a row have none
    return bool(diagonal and passing and np.all(np.diag(A)[4:] < 0) and np.all(np.diag(B[6:]) != 0))


def merged(system: System, delay: float = 0.0) -> System:
    """Model 2, or Model 3 with dead times, in six states, later by `delay` in the system's unit of time."""
    A, B = system.A, system.B
    own = 2 / -np.diag(A)[4:6]
    if system.order == DELAYED:
        return _all_pass(system, A[2:4, 4:6], own / 2 + 2 / -np.diag(A)[6:] + delay)
    slow, fast = -A[[7, 9], [6, 8]], -A[[7, 9], [7, 9]]
    drive = -A[2:4][:, [6, 8]] @ np.diag(B[[7, 9], [0, 1]] / slow)
    return _all_pass(system, drive, own + fast / slow + delay)


def _all_pass(system: System, drive: np.ndarray, tau: np.ndarray) -> System:
    """The rotor driven by `drive` (2, 2) behind delays tau (2,)."""
    T = np.diag(2 / tau)
    whole = np.zeros((6, 6))
    whole[:4, :4] = system.A[:4, :4]
    whole[2:4, 4:6], whole[4:6, 4:6] = 2 * drive @ T, -T
    into = np.vstack([np.zeros((2, 2)), -drive, np.eye(2)])
    return System(whole, into, system.C[:, :6] * np.array([1, 1, 0, 0, 0, 0]), system.D)
