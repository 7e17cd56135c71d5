r"""Start of a run on the synchronous orbit, the motion that repeats with the turn of the shaft.

The map x -> g(x) of whole turns, each run by the plant's own step, is brought from the equilibrium to its fixed point
by Anderson's mixing (Walker & Ni 2011): of the last answers the affine combination whose changes cancel best. For the
linear map near the orbit that is GMRES, so that only as many turns are run as there are motions which last. Films
follow their journals within a turn: the changes are read off the rotor, and films are combined with the same weights.

From one state to the next, dg = G dx; the eigenvalues of G in the space of these steps are those of the motions that
last, mu = exp(s T). Where one grows, as in a machine that whirls by itself, the orbit is none that a machine keeps.

What is random rests meanwhile. What does not repeat with the turn, as a base that vibrates or a blade that is lost,
begins with the run.

Cites: walker_2011.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from reynolds.grid import CONVERGENCE
from rotorsim.effects.base import WHERE
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.simulation import Simulation

LONGEST_TURN = 0.2
"""Longest turn [s] that is run: a slower shaft starts at the equilibrium, its unbalance hardly moves it."""
LONGEST_SHOT = 0.1
"""Longest time [s] of several turns that are run at once."""
FEWEST_SAMPLES = 8
"""Fewest samples of the turns that are run at once."""
NEXT_TO = 0.02
"""Relative difference of a sample of the turns from one of the machine that is looked for."""
FINE = 1e-4
"""Change over the turns, in orbits, at which the search ends."""
ENOUGH = 1e-2
"""Largest change over the turns, in orbits, of an orbit that is taken."""
MOST = 40
"""Largest number of times that the turns are run."""
MEMORY = 24
"""Answers that are combined."""
APART = 1e-2
"""Share of the largest step from which a direction counts in the space of the steps."""


@dataclass(frozen=True)
class Orbit:
    """State `w` on the orbit; `growth` [1/s] of the motion about it that decays least; None if it was not found."""

    w: np.ndarray | None
    growth: float


def start_on_orbit(a: Assembly, speed: float, pressure: float, seed: int = 0) -> Simulation:
    """A simulation on the synchronous orbit at a speed [rad/s] and gauge pressure [Pa].

    It stands at the equilibrium where the machine keeps no orbit, and where the shaft is slower than `LONGEST_TURN`.
    """
    simulation = Simulation.at_equilibrium(a, speed, pressure, seed)
    if abs(speed) * LONGEST_TURN < 2 * np.pi:
        return simulation
    orbit = find_orbit(a, simulation.w.copy(), speed, pressure)
    if orbit.w is not None and orbit.growth <= 0.0:
        simulation.restore(orbit.w)
        simulation.on_orbit = True
    return simulation


def find_orbit(a: Assembly, rest: np.ndarray, speed: float, pressure: float) -> Orbit:
    """The synchronous orbit that the search finds from the equilibrium in the workspace `rest`."""
    turns = Turns(a, rest, speed, pressure)
    part = np.r_[: a.rotor.size, turns._remembered]  # a spring's stretch belongs to the displacement
    state, best, least = rest, None, ENOUGH
    answers: list[np.ndarray] = []
    moved: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(MOST):
        after = turns.run(state)
        if after is None:
            break
        answers, moved = [*answers, after][-MEMORY:], [*moved, (turns.motion(state), turns.motion(after))][-MEMORY:]
        change = float(np.linalg.norm(moved[-1][1] - moved[-1][0]))
        size = change / max(float(np.linalg.norm(moved[-1][1] - turns.motion(rest))), a.P.motion_tolerance)
        if size <= least:
            best, least = after, size
        if size <= FINE:
            break
        state = after.copy()
        state[part] = weights(moved) @ np.array([answer[part] for answer in answers])
    return Orbit(best, growth(moved, turns.time))


def weights(moved: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Weights (k,), of sum 1, of states and answers with which the changes between them cancel best."""
    changes = np.array([after - before for before, after in moved])
    if len(changes) == 1:
        return np.ones(1)
    steps = (changes[-1] - changes[:-1]).T
    scale = np.linalg.norm(steps, axis=0)
    found = np.linalg.lstsq(steps / scale, changes[-1], rcond=1e-8)[0] / scale
    return np.append(found, 1.0 - found.sum())


def growth(moved: list[tuple[np.ndarray, np.ndarray]], time: float) -> float:
    """Growth [1/s] of the motion that decays least, from states and answers after `time` [s]; NaN of one."""
    if len(moved) < 2:
        return np.nan
    before, after = (np.diff(np.array(one), axis=0).T for one in zip(*moved, strict=True))
    scale = np.linalg.norm(before, axis=0)
    U, sizes, V = np.linalg.svd(before / scale, full_matrices=False)
    taken = sizes > APART * sizes[0]
    map_of_steps = U[:, taken].T @ (after / scale) @ V[taken].T / sizes[taken]
    return float(np.log(np.abs(np.linalg.eigvals(map_of_steps)).max()) / time)


@dataclass(frozen=True, eq=False)
class Turns:
    """Whole turns at constant speed [rad/s] and gauge pressure [Pa], run by the plant's step from angle 0 to angle 0.

    All but rotor and films begins as in the workspace `rest`. The turns take whole samples, next to the machine's.
    """

    a: Assembly
    rest: np.ndarray
    speed: float
    pressure: float

    @cached_property
    def time(self) -> float:
        """Time [s] of the turns: of the fewest whose samples are next to the machine's."""
        period, Ts = 2 * np.pi / abs(self.speed), self.a.sampling_time
        fewest = int(np.ceil(FEWEST_SAMPLES * Ts / period))
        times = period * np.arange(fewest, max(int(LONGEST_SHOT / period), fewest) + 1)
        off = np.abs(np.round(times / Ts) * Ts / times - 1)
        return float(times[int(np.argmax(off <= max(NEXT_TO, off.min())))])

    @cached_property
    def _inputs(self) -> np.ndarray:
        inputs = np.zeros((round(self.time / self.a.sampling_time), 6))
        inputs[:, 0], inputs[:, 1] = self.speed, self.a.machine.gas.absolute(self.pressure)
        return inputs

    @cached_property
    def _plant(self) -> Assembly:
        """The plant with the turns' samples, and with nothing random or that does not repeat with the turn."""
        record = self.a.record.copy()
        for call in self.a.calls:
            kind = type(call.effect)
            if kind.random_part:
                record[call.record][kind.random_part] = 0.0
            if kind.onset is not None or kind.foundation is not None:
                for entry in (one for one in fields(kind) if one.name not in WHERE):
                    record[call.record][entry.name] = entry.default
        record["sample"] = self.time / len(self._inputs)
        record["dt"] = record["sample"] / self.a.steps_per_sample
        return self.a.with_numbers(record.view(np.recarray), self.a.w)

    @cached_property
    def _kept(self) -> list[int]:
        """Places of rotor and films that every run of the turns begins with, and leaves, as in `rest`: clock, switches,
        memory of the solver. A combination of whole numbers is not one.
        """
        R, film = self.a.rotor, self.a.film
        clock = [R.time, R.angle, R.turns, R.speed, R.acceleration]
        solver = [R.order, R.matrix_step, R.touched, R.substeps, R.largest, R.error]
        touching = [R.contact + f for f in range(len(self.a.films))]
        counters = [film.size * f + film.convergence + k for f in range(len(self.a.films)) for k in range(CONVERGENCE)]
        return clock + solver + touching + counters

    @cached_property
    def _remembered(self) -> np.ndarray:
        """Places of the states of forces that remember the motion, which go on from turn to turn."""
        begin = [(self.a.rig.states + c.state, c.effect.states) for c in self.a.calls if c.effect.port == "motion"]
        return np.array([at + k for at, count in begin for k in range(count)], int)

    def run(self, state: np.ndarray) -> np.ndarray | None:
        """Workspace after the turns; None if a step has no solution."""
        a, size = self.a, self.a.rotor.size
        w, after, out = self.rest.copy(), self.rest.copy(), np.zeros((len(self._inputs), self.a.columns))
        w[:size] = state[:size]
        w[self._remembered] = state[self._remembered]
        w[self._kept] = self.rest[self._kept]
        if a.module.run(w, a.ix, self._plant.parameters, self._inputs, out, a.steps_per_sample) < len(out):
            return None
        after[:size] = w[:size]
        after[self._remembered] = w[self._remembered]
        after[self._kept] = self.rest[self._kept]
        return after

    def motion(self, w: np.ndarray) -> np.ndarray:
        """Displacement of the rotor and its velocity over the speed, in modal coordinates."""
        R = self.a.rotor
        return np.concatenate([w[R.q_old : R.q_old + R.n], w[R.v_old : R.v_old + R.n] / self.speed])
