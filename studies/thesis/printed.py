r"""Models and laws that the thesis prints, made from `data/printed.toml`, and what they give for the claims.

The rotor of Papers C and D is taken axis by axis, its cross gains being ten times smaller (C.5):

.. math:: p_j'' + 2 \zeta_j \omega_j p_j' + \omega_j^2 p_j = \frac{g_j}{\kappa_j} \omega_j^2 u_j(t - \tau_j)

Static gains g are printed nowhere. That of x follows from the lowest stable gain, g_x = 1/0.47 V/um, as the loop then
has a gain of one at rest; that of y is the one which puts the y pair under proportional control to 99.9 Hz.

A claim that the thesis' own model does not give contradicts itself, whatever a plant does.

Cites: thesis.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from identification import LinearModel
from identification.local.greybox import cascade, model_1
from rotorsim.base.units import KRPM, MPA, RIG_SAMPLE, TO_HZ
from rotorsim.control import Law
from rotorsim.control.designs import lead
from rotorsim.control.designs.p import ProportionalSpec, low_pass
from rotorsim.control.law_from_system import constant_law
from rotorsim.control.plants import MICRO, MILLI, scaled_model
from rotorsim.control.sampled_loop import law_system, model_loop
from rotorsim.control.systems import System, feedback, gain, held, largest, observer_law, response, series, side_by_side
from studies.thesis.control_cases import RING_TIME, decrement

VOLT = 4.5e-6
"""Metres of pin for a volt of its transducer (thesis, eq. C.1)."""
FREQUENCIES = np.geomspace(0.5, 2000.0, 4000)
"""Frequencies [Hz] at which a continuous loop's sensitivity is looked at."""
GAINS = np.round(np.arange(-1.0, 1.0, 0.001), 3)
"""Gains [V/um] of the root locus of Fig. D.6."""
HIGHEST = 600.0
"""Frequency [Hz] up to which poles belong to the rotor."""


@lru_cache
def printed() -> dict[str, Any]:
    """The printed numbers by table, as in the file."""
    path = Path(__file__).resolve().parent / "data" / "printed.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class PrintedSpec:
    """Table and lines that a law is printed in, and its sampling time [s]."""

    table: str
    lines: str
    Ts: float = RIG_SAMPLE


def model_a(speed: float) -> LinearModel:
    """Paper A's model at 8 bar and a speed [rad/s], from differences of pins [V] to the disc [m]: Table A.3.

    Raises
    ------
    ValueError
        For a speed outside 2.9 to 6 krpm, which the table was fitted over.
    """
    table = printed()["A3"]
    n = speed / KRPM
    if not table["lowest"] <= n <= table["highest"]:
        raise ValueError(f"speed = {n:g} krpm: Table A.3 holds from {table['lowest']} to {table['highest']} krpm")
    powers = np.array([(1000 * n) ** 2, 1000 * n, 1.0])
    K, D, B = ([float(np.dot(table[f"{letter}_{pair}"], powers)) for pair in ("xx", "xy", "yx", "yy")]
               for letter in "KDB")  # fmt: skip
    theta = np.array([*(-np.array(K)), *(-np.array(D)), *(np.array(B) / MICRO)])
    return LinearModel(*model_1(theta), inputs=("pins_x", "pins_y"), speed=speed, pressure=table["pressure"] * MPA)


def sampled_model_a() -> LinearModel:
    """Paper A's sampled model of 6 krpm and 8 bar, from differences of pins [V] to the disc [m] (Table A.2)."""
    table = printed()["A2"]
    F, G = np.array(table["F"]), np.array(table["G"])
    return LinearModel(F, G / MICRO, np.eye(2, 4), np.zeros((2, 2)), table["sampling_time"], ("pins_x", "pins_y"),
                       speed=table["speed"] * KRPM, pressure=table["pressure"] * MPA)  # fmt: skip


def law_a(pins: bool = False) -> Law:
    """Paper A's observer and state feedback, Table A.2, from the disc to the references of the pins.

    The observer is a current one, as the estimate of eq. A.13 is that of the sample whose measurement it has. The
    thesis' u is the difference of opposite pins; a reference makes 1.863 and 1.865 times itself of that (Table C.2).
    With `pins` the output is the difference [V] itself, as it acts on `model_a`.
    """
    table = printed()["A2"]
    F, G, L, K = (np.array(table[name]) for name in "FGLK")
    law = observer_law(System(F, G, np.eye(2, 4), np.zeros((2, 2))), K, L)
    share = np.eye(2) if pins else np.diag(1 / np.array(printed()["C2"]["gain"]))
    return constant_law("printed A", None, series(law, gain(share)), PrintedSpec(table["table"], table["lines"]))


def model_c(static: Iterable[float] | None = None) -> LinearModel:
    """Papers C and D at 6 bar and 0 rpm, from references [V] to the disc [m], with the states of Model 2.

    static: gains (2,) [um/V] at rest in place of the derived ones.
    """
    table, pins = printed()["CD"], printed()["C2"]
    g = np.array(static_gains() if static is None else list(static)) / MICRO
    w, zeta = 2 * np.pi * np.array(table["frequency"]), np.array(table["damping"])
    B = w**2 * g / (np.array(pins["gain"]) * VOLT)
    rotor = [*np.diag(-(w**2)).ravel(), *np.diag(-2 * zeta * w).ravel(), *np.diag(B).ravel()]
    theta = np.array([*rotor, *(2e3 / np.array(table["delay"])), *actuator_lags(VOLT)])
    return LinearModel(*cascade(theta), speed=table["speed"] * KRPM, pressure=table["pressure"] * MPA)


def actuator_lags(unit: float) -> list[float]:
    """Parameters (6,) of the pins by axis behind their references, as `greybox.actuator` takes them, by Table C.2.

    unit: what a volt of the pins' transducer stands for in the output.
    """
    pins, found = printed()["C2"], list[float]()
    for axis, k in zip("xy", pins["gain"], strict=True):
        first, second = pins[f"poles_{axis}"]
        found += [first * second, first + second, unit * k * first * second]
    return found


@lru_cache
def static_gains() -> tuple[float, float]:
    """Static gains (2,) [um/V] of the model of Papers C and D, which follow from what is printed."""
    from scipy.optimize import brentq

    table = printed()["CD"]
    x = -1 / table["lowest_gain"]

    def off(y: float) -> float:
        return float(axis_pairs((x, y))[1][0] * TO_HZ - table["derived"]["closed_y"])

    return x, float(brentq(off, 1.5, 3.5, xtol=1e-6))


def axis_pairs(static: Iterable[float] | None = None) -> list[tuple[float, float]]:
    """Natural frequency [rad/s] and damping ratio of the x pair and of the y pair under proportional control."""
    values, vectors = np.linalg.eig(feedback(continuous(model_c(static)), _proportional()).A)
    s = values * MILLI
    rotor = (s.imag > 1.0) & (np.abs(s) < 2 * np.pi * HIGHEST)
    moved = np.abs(vectors[:2]).argmax(axis=0)
    pairs = [s[rotor & (moved == axis)][0] for axis in range(2)]
    return [(float(abs(one)), float(-one.real / abs(one))) for one in pairs]


def continuous(model: LinearModel) -> System:
    """A printed model in um, V and ms."""
    return scaled_model(model, model.speed, model.pressure)


def _pairs(system: System, highest: float) -> np.ndarray:
    """Oscillating poles [rad/s] up to a frequency [rad/s], slowest first."""
    s = np.linalg.eigvals(system.A) * MILLI
    s = s[(s.imag > 1.0) & (np.abs(s) < highest)]
    return np.asarray(s[np.argsort(np.abs(s))])


def _proportional() -> System:
    """Paper C's proportional law in um, V and ms, before it is sampled."""
    spec = ProportionalSpec()
    filters = side_by_side(*(low_pass(spec.low_pass, spec.order),) * 2)
    return series(filters, gain(np.diag([spec.kappa_x, spec.kappa_y]) / spec.transducer))


def _lead(spec: lead.LeadSpec) -> System:
    """Paper D's law in um, V and ms, before it is sampled, with the poles of Table D.1."""
    leads = side_by_side(*(lead.lead(-k, t, a, 0.0) for k, t, a in zip(spec.kappa, spec.tau, spec.alpha, strict=True)))
    return series(leads, side_by_side(*(low_pass(spec.low_pass, spec.order),) * 2))


def sensitivity(plant: System, law: System, frequency: np.ndarray) -> np.ndarray:
    """Largest singular value (f,) of (I - G K)^-1 at frequencies (f,) [Hz] of a continuous loop in ms."""
    s = 2j * np.pi * frequency / MILLI
    return np.asarray(largest(np.linalg.inv(np.eye(2) - response(plant, s) @ response(law, s))))


def printed_numbers() -> dict[str, dict[str, float]]:
    """Figures, by claim and name, that the thesis' printed models give with the thesis' printed laws."""
    damping, plant = _claim_c1(), continuous(model_c())
    return {
        "C1": damping, "C3": proportional_figures(plant), "C4": lead_figures(plant), "I9": _claim_i9(),
        "N4": _claim_n4(), "N5": {name: damping[name] for name in ("closed", "lift")},
    }  # fmt: skip


def _claim_c1() -> dict[str, float]:
    """The law of Table A.2 on the model of Table A.3 at 4.1 krpm, sampled, without a sample of delay, after a hit along
    y: the damping ratio by the logarithmic decrement, as it is read of the plant."""
    model, law = model_a(printed()["A4"]["speed"] * KRPM), law_a(pins=True)
    plant = held(System(model.A / MILLI, model.B * MICRO / MILLI, model.C, model.D), law.Ts * MILLI)
    loop = feedback(plant, law_system(law, model.speed, model.pressure)).A
    states = [np.eye(len(loop))[3]]  # speed of y
    while len(states) < RING_TIME / law.Ts:
        states.append(loop @ states[-1])
    closed = decrement(law.Ts * np.arange(len(states)), np.array(states)[:, :2])
    return {"open": float(model.zeta[1]), "closed": closed, "lift": closed / float(model.zeta[1])}


def proportional_figures(plant: System) -> dict[str, float]:
    """C3 of a continuous model with Paper C's proportional law; pairs by frequency, as in Tables C.3 and C.4."""
    alone, under = (_pairs(one, 2 * np.pi * HIGHEST)[:2] for one in (plant, feedback(plant, _proportional())))
    (w0, zeta0), (w1, zeta1) = ((np.abs(s), -s.real / np.abs(s)) for s in (alone, under))
    figures: dict[str, Any] = {}
    for k in range(2):
        figures |= {f"w_{k + 1}": w1[k] / w0[k], f"zeta_{k + 1}": zeta1[k], f"lift_{k + 1}": zeta1[k] / zeta0[k]}
    return {"open_w_1": float(w0[0] * TO_HZ)} | {name: float(value) for name, value in figures.items()}


def lead_figures(plant: System) -> dict[str, float]:
    """C4 of a continuous model: sensitivities with the laws of Table D.1, and the stable gains of the x loop."""
    modes = np.abs(_pairs(plant, 2 * np.pi * HIGHEST)[:2]) * TO_HZ
    figures = {}
    for name, spec in (("softening", lead.SOFTENING), ("hardening", lead.HARDENING)):
        law = _lead(spec)
        figures[f"{name}_modes"] = sensitivity(plant, law, modes).max()
        figures[f"{name}_peak"] = sensitivity(plant, law, FREQUENCIES).max()
    one = np.diag([1.0, 0.0])
    stable = [k for k in GAINS if np.linalg.eigvals(feedback(plant, gain(-k * one)).A).real.max() < 0]
    return {name: float(value) for name, value in figures.items()} | {
        "gain_low": float(min(stable)), "gain_high": float(max(stable))}  # fmt: skip


def hardening_peak_sampled() -> float:
    """Peak of S of Paper D's hardening law on Paper D's model, with a sample and a hold of delay."""
    model = model_c()
    law = lead.design(model, replace(lead.HARDENING, speed=model.speed, pressure=model.pressure, check=False))
    return model_loop(law, model, model.speed, model.pressure).peak


def _claim_i9() -> dict[str, float]:
    table = printed()["C2"]
    poles = {f"p{k + 1}_{axis}": table[f"poles_{axis}"][k] for axis in "xy" for k in range(2)}
    return poles | {f"gain_{axis}": k for axis, k in zip("xy", table["gain"], strict=True)}


def _claim_n4() -> dict[str, float]:
    """Vertical over horizontal response energy of the open loop."""
    table = printed()["E3"]
    return {"ratio": table["vertical"][0] / table["horizontal"][0]}
