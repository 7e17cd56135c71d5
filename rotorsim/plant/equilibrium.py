r"""Static equilibrium of rotor, film and plena.

With K_s = K + k_n Phi_b' Phi_b (k_n the nominal spring, which makes K_s regular), H = Phi_b K_s^-1 Phi_b' and
X_f = Phi_b K_s^-1 f, the journal's equation is  (H^-1 - k_n) X - F(X) = H^-1 X_f:  exact, whatever k_n.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reynolds.steady import settle_film
from rotorsim.errors import NoLiftOffError
from rotorsim.plant.assemble import Assembly, influence

DAMPING = 2e3
"""Damper [N s/m] on the journal while it settles."""


@dataclass(frozen=True)
class Equilibrium:
    """Where the machine rests: disc, journal (2,) [m], film force (2,) [N], flows (n_inj,) [kg/s], h_min [m]."""

    disc: np.ndarray
    journal: np.ndarray
    eccentricity_ratio: float
    force: np.ndarray
    mass_flow: np.ndarray
    h_min: float


def modal_force(a: Assembly, steady: bool, speed: float) -> np.ndarray:
    """Modal force (2n,) at angle 0 of the effects that are `steady`, like gravity, or of those that are not."""
    total = np.zeros(a.rotor.n)
    for call in a.calls:
        effect = type(call.effect)
        if effect.port == "force" and effect.steady == steady:
            kernel = getattr(effect.kernel, "py_func", effect.kernel)
            force = kernel(0.0, 0.0, speed, 0.0, getattr(a.P, call.record))
            total += np.asarray(force) @ influence(a.mesh, call.effect)
    return total


def settle(a: Assembly, speed: float, pressure: float) -> np.ndarray:
    """Workspace with the machine at rest in equilibrium at `speed` [rad/s] and gauge pressure [Pa].

    Raises NoLiftOffError where the film does not carry the rotor.
    """
    w = a.w.copy()
    f = modal_force(a, True, speed)
    K = a.mesh.reduced.K
    if a.film_model is None:
        _put_rotor(w, a, np.linalg.solve(K, f))
        return _clock(w, a, speed)
    L, film = a.film, a.machine.film
    assert film is not None
    B = a.mesh.shape(film.position)
    nominal = film.nominal_stiffness
    Ks = K + nominal * B.T @ B
    H = np.linalg.inv(B @ np.linalg.solve(Ks, B.T))
    load = H @ B @ np.linalg.solve(Ks, f)
    supply = pressure + a.film_model.gas.ambient_pressure
    w[L.supply : L.supply + L.n_inj] = supply
    w[L.static_a : L.static_a + 4] = (H - nominal * np.eye(2)).ravel()
    w[L.journal_b : L.journal_b + 4] = np.eye(2).ravel()
    w[L.static_rhs : L.static_rhs + 2] = load
    converged = settle_film(
        w, L, lambda iadt, tolerance: a.module.pseudo_step(w, a.ix, a.P, speed, iadt, tolerance, DAMPING)
    )
    X, F = w[L.journal : L.journal + 2], w[L.force : L.force + 2]
    if not converged or not np.hypot(*X) < film.clearance - 2 * a.machine.solver.minimum_film:
        remedy = "raise the injection pressure" if L.n_inj else "start at a higher speed"
        raise NoLiftOffError(
            f"no lift-off: at {pressure / 1e6:.3g} MPa gauge and {speed * 30 / np.pi:.0f} rpm the film does not carry "
            f"the {np.hypot(*load):.1f} N on it; {remedy}"
        )
    _put_rotor(w, a, np.linalg.solve(Ks, f + B.T @ (F + nominal * X)))
    _put_film(w, a, supply)
    return _clock(w, a, speed)


def _put_rotor(w: np.ndarray, a: Assembly, q: np.ndarray) -> None:
    R = a.rotor
    for offset in (R.q, R.q_old):
        w[offset : offset + R.n] = q


def _put_film(w: np.ndarray, a: Assembly, supply: float) -> None:
    """Give the film a past at rest and no rates."""
    L, R = a.film, a.rotor
    for offset in (L.p_1, L.p_2, L.p_3):
        w[offset : offset + L.length] = w[L.p : L.p + L.length]
    for offset in (L.plenum_1, L.plenum_2, L.plenum_3, L.plenum_old):
        w[offset : offset + L.n_inj] = w[L.plenum : L.plenum + L.n_inj]
    w[L.m_old : L.m_old + L.length] = w[L.m : L.m + L.length]
    w[L.rate : L.rate + L.length] = 0.0
    w[L.convergence : L.convergence + 8] = 0.0
    w[R.pin : R.pin + L.n_inj] = a.P.pin_bias[: L.n_inj]
    w[R.supply] = supply


def _clock(w: np.ndarray, a: Assembly, speed: float) -> np.ndarray:
    """Set the speed, and the acceleration with which what turns with the shaft starts to act."""
    R = a.rotor
    w[R.speed] = speed
    w[R.a_old : R.a_old + R.n] = modal_force(a, False, speed)
    return w


def describe(a: Assembly, w: np.ndarray) -> Equilibrium:
    """Read an equilibrium out of a workspace that `settle` returned."""
    L, R = a.film, a.rotor
    q = w[R.q : R.q + R.n]
    disc = a.mesh.shape(a.mesh.probe) @ q
    film = a.machine.film
    if film is None:
        nothing = np.full(2, np.nan)
        return Equilibrium(disc, nothing, np.nan, nothing, np.zeros(0), np.nan)
    X = w[L.journal : L.journal + 2].copy()
    e = float(np.hypot(*X))
    flow = w[L.film_flow : L.film_flow + L.n_inj].copy()
    return Equilibrium(disc, X, e / film.clearance, w[L.force : L.force + 2].copy(), flow, film.clearance - e)
