r"""Sampled loop of a law and a model with one sample of delay: stability, margins, sensitivities, impact response.

.. math:: S_o = (I - G K)^{-1}, \quad S_i = (I - K G)^{-1}, \quad T_i = K G S_i

The law's output adds to the reference, hence the minus: thesis Papers C and E; A, B, D and F write u = -K y. The disk
margin is the balanced one of Seiler, Packard and Gahinet (2020), alpha = 1 / max sigma(S - I/2), over both ends of the
loop and all frequencies up to Nyquist.

Every design is checked with the model at its operating points, and looked over in the model's whole range. A hit is a
jump of the rotor's velocity: the first states of every grey-box structure are positions and velocities. Ratios of
closed to open loop need no mass. Weights can so be chosen without seeing the plant they are verified on.

Bode's integral holds for these loops (Sung and Hara 1988).

Cites: seiler_2020, sung_1988, thesis.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification import LinearModel
from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import DECAYS, decays
from rotorsim.control.law import Law
from rotorsim.control.plants import MICRO, Model, point_text, sampled_plant
from rotorsim.control.systems import System, feedback, largest, response

FREQUENCIES = 1200
"""Points of a frequency axis up to Nyquist."""


def law_system(law: Law, speed: float, pressure: float) -> System:
    """The law at an operating point, in um and V."""
    A, B, C, D = law.at(speed, pressure)
    return System(A, B / MICRO, C, D / MICRO)


def closed_poles(plant: System, controller: System) -> np.ndarray:
    """Poles z of the sampled loop."""
    return np.asarray(np.linalg.eigvals(feedback(plant, controller).A))


@dataclass(frozen=True, eq=False)
class Loop:
    """Frequencies (f,) [Hz] and responses (f, 2, 2): plant G, controller K, sensitivities at disc and reference."""

    frequency: np.ndarray
    G: np.ndarray
    K: np.ndarray
    So: np.ndarray
    Si: np.ndarray

    @property
    def KS(self) -> np.ndarray:
        """Response of the references to disturbances of the disc [V/um]."""
        return self.K @ self.So

    @property
    def GS(self) -> np.ndarray:
        """Disc per disturbance at the reference [um/V]."""
        return self.So @ self.G

    @property
    def peak(self) -> float:
        """Largest singular value of the output sensitivity."""
        return float(largest(self.So).max())

    @property
    def disk_margin(self) -> float:
        """Diameter alpha of the largest balanced disk of simultaneous gain and phase changes, at the worse end."""
        eye = np.eye(2)
        return float(min(1 / largest(s - eye / 2).max() for s in (self.So, self.Si)))

    @property
    def gain_margin(self) -> float:
        """Gain factor that every loop at once takes, up or down, from the disk margin."""
        alpha = min(self.disk_margin, 2.0)
        return (2 + alpha) / (2 - alpha) if alpha < 2 else float("inf")

    @property
    def phase_margin(self) -> float:
        """Phase [deg] that every loop at once takes, from the disk margin."""
        return float(np.degrees(2 * np.arctan(min(self.disk_margin, 2.0) / 2)))


def frequency_axis(Ts: float, lowest: float = 0.5) -> np.ndarray:
    """Frequencies [Hz] from `lowest` to Nyquist, even on a logarithmic axis."""
    return np.geomspace(lowest, 0.4999 / Ts, FREQUENCIES)


def loop_of(plant: System, controller: System, Ts: float, frequency: np.ndarray | None = None) -> Loop:
    """Frequency responses of a sampled loop.

    Examples
    --------
    >>> import rotorsim as rs
    >>> from rotorsim.control.systems import System
    >>> lag = System(0.5 * np.eye(2), np.eye(2), 0.5 * np.eye(2), np.zeros((2, 2)))
    >>> damper = System(0.5 * np.eye(2), np.eye(2), -0.1 * np.eye(2), np.zeros((2, 2)))
    >>> rs.control.loop_of(lag, damper, 2e-4).disk_margin > 0.5
    True
    """
    f = frequency_axis(Ts) if frequency is None else np.asarray(frequency, float)
    z = np.exp(2j * np.pi * f * Ts)
    G, K = response(plant, z), response(controller, z)
    eye = np.eye(2)
    return Loop(f, G, K, np.linalg.inv(eye - G @ K), np.linalg.inv(eye - K @ G))


def model_loop(law: Law, model: Model, speed: float, pressure: float, frequency: np.ndarray | None = None) -> Loop:
    """The loop of a law and a frozen model.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.model_loop(law, lpv, 300.0, 0.5e6).disk_margin > 0
    True
    """
    return loop_of(sampled_plant(model, speed, pressure, law.Ts), law_system(law, speed, pressure), law.Ts, frequency)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Loop over speeds (s,), pressures (p,): radius of the outermost pole, smallest damping ratio (s, p)."""

    speeds: np.ndarray
    pressures: np.ndarray
    radius: np.ndarray
    damping: np.ndarray

    @property
    def unstable(self) -> int:
        """Number of points with a pole on or outside the unit circle, or so near that rounding decides."""
        return int(np.count_nonzero(~(self.radius < DECAYS)))

    @property
    def worst(self) -> tuple[float, float]:
        """Speed [rad/s] and pressure [Pa] of the outermost pole."""
        i, j = np.unravel_index(self.radius.argmax(), self.radius.shape)
        return float(self.speeds[i]), float(self.pressures[j])


def sweep(law: Law, model: Model, speeds: np.ndarray, pressures: np.ndarray) -> Sweep:
    """Poles of the loop over operating points, for the law as it runs there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.sweep(law, lpv, np.array([300.0]), np.array([0.5e6])).unstable
    0
    """
    radius = np.zeros((len(speeds), len(pressures)))
    damping = np.zeros_like(radius)
    for i, speed in enumerate(speeds):
        for j, pressure in enumerate(pressures):
            plant = sampled_plant(model, float(speed), float(pressure), law.Ts)
            z = closed_poles(plant, law_system(law, float(speed), float(pressure)))
            radius[i, j], damping[i, j] = np.abs(z).max(), smallest_damping(z, law.Ts)
    return Sweep(np.asarray(speeds), np.asarray(pressures), radius, damping)


def oscillating(z: np.ndarray, Ts: float, highest: float = 600.0) -> np.ndarray:
    """Poles s [rad/s] of z with an oscillation below `highest` [Hz], one of each conjugate pair, by frequency."""
    s = np.log(z[np.abs(z) > 1e-9].astype(complex)) / Ts
    s = s[(s.imag > 1.0) & (s.imag < 2 * np.pi * highest)]
    return np.asarray(s[np.argsort(np.abs(s))])


def smallest_damping(z: np.ndarray, Ts: float, highest: float = 600.0) -> float:
    """Smallest damping ratio of oscillating poles below `highest` [Hz]; 1 where nothing oscillates."""
    s = oscillating(z, Ts, highest)
    return float((-s.real / np.abs(s)).min(initial=1.0))


def root_locus(plant: System, controller: System, gains: np.ndarray) -> np.ndarray:
    """Poles z (g, n) of the loop with `controller` times each gain, each branch followed from gain to gain."""
    rows: list[np.ndarray] = []
    for factor in gains:
        scaled = System(controller.A, controller.B, factor * controller.C, factor * controller.D)
        poles = closed_poles(plant, scaled)
        rows.append(poles if not rows else _in_order(rows[-1], poles))
    return np.array(rows)


def _in_order(before: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Poles in the order of those before."""
    from scipy.optimize import linear_sum_assignment

    return poles[linear_sum_assignment(np.abs(before[:, None] - poles[None]))[1]]


def check_loop(law: Law, model: Model, points: Sequence[tuple[float, float]]) -> None:
    """Raise DesignError with the first operating point (rad/s, Pa) where the loop with the model is unstable.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.check_loop(law, lpv, [(300.0, 0.5e6)])
    """
    for speed, pressure in points:
        plant = sampled_plant(model, speed, pressure, law.Ts)
        poles = closed_poles(plant, law_system(law, speed, pressure))
        worst = poles[np.abs(poles).argmax()]
        if not decays(poles):
            hertz = abs(np.angle(worst)) / (2 * np.pi * law.Ts)
            raise DesignError(
                f"{law.name}: the loop with the model is unstable at {point_text(speed, pressure)} "
                f"(pole radius {abs(worst):.4f} at {hertz:.4g} Hz); lower the gains or soften the specification",
                speed=speed,
                pressure=pressure,
            )


FINE = (40, 15)
COARSE = (5, 4)


def fine_axes(law: Law, model: Model, size: tuple[int, int] = FINE) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and pressures of the range in which a law is to work: the model's, from the law's slowest speed up."""
    if isinstance(model, LinearModel):
        return np.array([np.nan_to_num(model.speed)]), np.array([np.nan_to_num(model.pressure)])
    (w0, p0), (w1, p1) = model.low, model.high
    first = max(float(w0), float(law.speeds[0])) if law.scheduled else float(w0)
    return np.linspace(first, w1, size[0] if w1 > w0 else 1), np.linspace(p0, p1, size[1] if p1 > p0 else 1)


def overview(law: Law, model: Model) -> dict[str, Any]:
    """Plain numbers; what holds at the law's own operating point holds at the middle of the range otherwise.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "disk_margin" in rs.control.overview(law, lpv)
    True
    """
    speeds, pressures = fine_axes(law, model)
    found = sweep(law, model, speeds, pressures)
    w, p = law.about.get("spec", {}).get("speed"), law.about.get("spec", {}).get("pressure")
    w = float(np.mean(speeds)) if w is None else float(w)
    p = float(np.mean(pressures)) if p is None else float(p)
    plant = sampled_plant(model, w, p, law.Ts)
    loop = loop_of(plant, law_system(law, w, p), law.Ts)
    overview: dict[str, Any] = {"design": law.name, "order": law.order, "scheduled": law.scheduled}
    if law.gamma is not None:
        overview["gamma"] = law.gamma
    overview |= {key: value for key, value in law.about.items() if isinstance(value, (int, float)) and key != "spec"}
    own = smallest_damping(np.linalg.eigvals(plant.A), law.Ts)
    overview |= {
        "operating_point": point_text(w, p),
        "smallest_damping_open": own,
        "smallest_damping_closed": float(found.damping.min()),
        "unstable_points": f"{found.unstable} of {found.radius.size}",
        "largest_pole_radius": float(found.radius.max()),
        "peak_sensitivity": loop.peak,
        "disk_margin": loop.disk_margin,
        "gain_margin": loop.gain_margin,
        "phase_margin_deg": loop.phase_margin,
    }
    return overview if law.runout is None else overview | {"runout_table": law.runout.text}


SAMPLES = 500


def hit_responses(plant: System, controller: System | None, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """Norms (2,) of the disc [um] and of the reference [V] after a jump of 1 um/ms along x and along y."""
    n = plant.order
    m = 0 if controller is None else controller.order
    x, c = np.zeros((n, 2)), np.zeros((m, 2))
    x[2:4] = np.eye(2)
    disc, reference = np.zeros(2), np.zeros(2)
    for _ in range(samples):
        y = plant.C @ x
        u = np.zeros((2, 2))
        if controller is not None:
            u = controller.C @ c + controller.D @ y
            c = controller.A @ c + controller.B @ y
        x = plant.A @ x + plant.B @ u
        disc, reference = disc + (y**2).sum(axis=0), reference + (u**2).sum(axis=0)
    return np.sqrt(disc), np.sqrt(reference)


def hit_ratios(law: Law, model: Model, points: Iterable[tuple[float, float]]) -> np.ndarray:
    """Closed over open norms of the impact response (points, 2) at operating points [rad/s, Pa], on the model.

    Examples
    --------
    >>> import rotorsim as rs
    >>> bool((rs.control.hit_ratios(law, lpv, [(300.0, 0.5e6)]) > 0).all())
    True
    """
    rows = []
    for speed, pressure in points:
        plant = sampled_plant(model, speed, pressure, law.Ts)
        closed, _ = hit_responses(plant, law_system(law, speed, pressure))
        rows.append(closed / hit_responses(plant, None)[0])
    return np.array(rows)
