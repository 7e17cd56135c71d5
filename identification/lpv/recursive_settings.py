"""Settings of a recursive LPV estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.errors import UnfitError

Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class Recursion:
    """Settings of `RecursiveLpv`. Coefficients are normalised: 1 is the size of those of the start.

    order: total degree of the polynomials over speed and pressure; harmonics: of the shaft angle, for imbalance and
    runout; corner: of the filters, in units of the start's mean natural frequency; spread: standard deviation of each
    coefficient of displacements, references, constant and harmonics before any data; drift: how far each of these
    wanders in a second, as a share of its spread, which is what it forgets by, 0 for none; reach: bound of each
    coefficient about the start, in units of its spread; least_input: RMS of the filtered references [V] below which
    nothing is learned; gate: second differences of a displacement beyond so many usual ones are outliers; standing: so
    many equal displacements in a row are a drop-out; least_decay: of every pole, in units of the natural frequency;
    period: between updates [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.Recursion(drift=(0.05, 0.05, 0.05, 0.05)).order
    2
    """

    order: int = 2
    harmonics: int = 2
    corner: float = 1.5
    spread: Four = (0.5, 0.5, 10.0, 10.0)
    drift: Four = (0.005, 0.005, 0.02, 0.02)
    reach: float = 6.0
    least_input: float = 0.05
    gate: float = 12.0
    standing: int = 5
    least_decay: float = 1e-3
    period: float = 1e-3

    def __post_init__(self) -> None:
        """Refuse numbers that make no estimate."""
        if self.order not in (0, 1, 2, 3) or self.harmonics not in range(11):
            raise UnfitError(
                f"recursion: order {self.order}, {self.harmonics} harmonics; choose 0 to 3, and 0 to 10 harmonics"
            )
        for name in ("corner", "reach", "gate", "standing", "period"):
            if not 0 < getattr(self, name) < np.inf:
                raise UnfitError(f"recursion.{name}: {getattr(self, name)}; give a number above zero")
        for name, least in (("spread", 1e-12), ("drift", 0.0)):
            values = np.asarray(getattr(self, name), float)
            if values.shape != (4,) or not np.all((values >= least) & (values < np.inf)):
                raise UnfitError(
                    f"recursion.{name}: {getattr(self, name)}; give four numbers, of displacements, references, "
                    "constant, harmonics"
                )
        for name in ("least_input", "least_decay"):
            if not 0 <= getattr(self, name) < np.inf:
                raise UnfitError(f"recursion.{name}: {getattr(self, name)}; give zero or more")
