"""Which records the study of identification against physics needs (thesis, section 2.5; CLAIMS I6)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from math import pi

RPM = pi / 30
ROLES = ("identification", "validation", "centre", "steady")


@dataclass(frozen=True)
class Job:
    """One record: its role, speed [rad/s], pressure [Pa], number of its sequence and seed, duration [s]."""

    role: str
    speed: float
    pressure: float
    number: int
    duration: float

    @property
    def name(self) -> str:
        """File name."""
        return f"{self.role}_{self.speed / RPM:.0f}rpm_{self.pressure * 1e-6:.3f}MPa.nc"


@dataclass(frozen=True)
class Plan:
    """A grid of operating points; a second record at each but the last to validate, one in every cell's centre."""

    speeds: tuple[float, ...] = tuple(1000 * RPM * k for k in range(7))
    pressures: tuple[float, ...] = (0.3e6, 0.4e6, 0.5e6, 0.6e6, 0.7e6)
    duration: float = 10.0
    steady: float = 5.0

    def jobs(self) -> list[Job]:
        """All records; every turning point has a steady run for the runout filter."""
        grid = list(product(self.speeds, self.pressures))
        jobs = [Job("identification", w, p, 1 + i, self.duration) for i, (w, p) in enumerate(grid)]
        jobs += [Job("validation", w, p, 1001 + i, self.duration) for i, (w, p) in enumerate(grid[:-1])]
        centres = list(product(_middles(self.speeds), _middles(self.pressures)))
        jobs += [Job("centre", w, p, 5001 + i, self.duration) for i, (w, p) in enumerate(centres)]
        turning = [(w, p) for w, p in (*grid, *centres) if w]
        return jobs + [Job("steady", w, p, 2001 + i, self.steady) for i, (w, p) in enumerate(turning)]


def _middles(values: tuple[float, ...]) -> list[float]:
    return [(a + b) / 2 for a, b in pairwise(values)]
