r"""Rotor: a row of shaft elements with discs, point masses and bearings on its nodes.

.. math:: M \ddot q + (C + \Omega G) \dot q + K q = f, \qquad M = M' > 0, \quad G = -G'

q holds x, y, alpha, beta of node 0, then of node 1, and so on (frame and signs: elements.py); then the four internal
coordinates of every element that has them; then x, y of every pedestal, whose nodes are numbered after the shaft's.
K and C take the bearings' own matrices, which need not be symmetric, and with material damping the circulatory terms.

Source: Friswell et al. (2010), chapter 5.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import ArrayLike

from fe_shaft import campbell, critical, modal, response, ross, stability, static, transient, ucs
from fe_shaft.assembly import AssembledRotor


class Rotor(AssembledRotor):
    """Rotor with four degrees of freedom a node: x, y [m], alpha, beta [rad].

    Parameters
    ----------
    shaft_elements : sequence of ShaftElement
        From left to right, or numbered by their `n`.
    disk_elements : sequence of DiskElement
    bearing_elements : sequence of BearingElement
    point_mass_elements : sequence of PointMass
        On the shaft, or on a pedestal that a bearing names as its `n_link`.
    clamped : sequence of int
        Nodes that neither move nor tilt.
    pinned : sequence of int
        Nodes that tilt but do not move.

    Raises
    ------
    ShaftError
        If elements are missing or numbered twice, if something lies outside the shaft, if two bearings share a node
        or a pedestal has no mass.

    Examples
    --------
    >>> import fe_shaft
    >>> shaft = [fe_shaft.ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    >>> rotor = fe_shaft.Rotor(shaft, bearing_elements=[fe_shaft.BearingElement(n, 1e6, 100.0) for n in (0, 6)])
    >>> rotor.ndof
    28
    """

    def run_static(self, gravity: float | None = None, force: ArrayLike | None = None) -> static.StaticResult:
        """Sag under gravity and given forces and the bearings' reactions; see static.run_static.

        Examples
        --------
        >>> rotor.run_static().bearing_forces[:, 1].round(1).tolist()
        [112.8, 112.8]
        """
        return static.run_static(self, static.GRAVITY if gravity is None else gravity, force)

    def run_modal(self, speed: float) -> modal.ModalResult:
        """Natural frequencies, damping and whirl at `speed` [rad/s]; see modal.run_modal.

        Examples
        --------
        >>> rotor.run_modal(100.0).wn[:2].round().tolist()
        [210.0, 210.0]
        """
        return modal.run_modal(self, speed)

    def run_campbell(self, speeds: ArrayLike, frequencies: int | None = 6) -> campbell.CampbellResult:
        """The lowest natural frequencies over `speeds` [rad/s]; see campbell.run_campbell.

        Examples
        --------
        >>> rotor.run_campbell([0.0, 100.0, 200.0], frequencies=4).wn.shape
        (3, 4)
        """
        return campbell.run_campbell(self, speeds, frequencies)

    def run_critical_speed(self, limit: float | None = None, count: int = 6) -> critical.CriticalSpeedResult:
        """Speeds that equal a natural frequency; see critical.run_critical_speed.

        Examples
        --------
        >>> rotor.run_critical_speed(count=2).wn.round().tolist()
        [210.0, 210.0]
        """
        return critical.run_critical_speed(self, limit, count)

    def run_ucs(
        self, stiffness_range: tuple[float, float] = (1e6, 1e11), num: int = 30, num_modes: int = 4, **more: Any
    ) -> ucs.UcsResult:
        """Undamped critical speeds over the bearings' stiffness [N/m]; see ucs.run_ucs.

        Examples
        --------
        >>> rotor.run_ucs((1e6, 1e8), num=5, num_modes=2).wn.shape
        (2, 5)
        """
        return ucs.run_ucs(self, stiffness_range, num, num_modes, **more)

    def run_stability(self, speeds: ArrayLike) -> stability.StabilityResult:
        """Least logarithmic decrement over `speeds` [rad/s] and the onset of instability; see stability.py.

        Examples
        --------
        >>> rotor.run_stability([0.0, 100.0, 200.0]).onset  # stable at all of them
        nan
        """
        return stability.run_stability(self, speeds)

    def run_unbalance_response(
        self, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike, frequency: ArrayLike
    ) -> response.ForcedResult:
        """Whirl forced by unbalance; see response.run_unbalance_response.

        Examples
        --------
        >>> rotor.run_unbalance_response(3, 1e-5, 0.0, [50.0, 100.0]).response.shape
        (28, 2)
        """
        return response.run_unbalance_response(self, node, magnitude, phase, frequency)

    def run_freq_response(
        self,
        frequency: ArrayLike,
        speed: float | None = None,
        inputs: Sequence[int] | None = None,
        outputs: Sequence[int] | None = None,
    ) -> response.FrequencyResponse:
        """Receptance over `frequency` [rad/s]; see response.run_freq_response.

        Examples
        --------
        >>> rotor.run_freq_response([50.0, 100.0], speed=0.0, inputs=[12], outputs=[12, 13]).response.shape
        (2, 1, 2)
        """
        return response.run_freq_response(self, frequency, speed, inputs, outputs)

    def run_time_response(
        self,
        speed: float,
        F: ArrayLike | None,
        t: ArrayLike,
        initial: ArrayLike | None = None,
        unbalance: Sequence[transient.Unbalance] = (),
        gravity: float = 0.0,
    ) -> transient.TimeResult:
        """Motion under forces `F` (n_t, ndof) [N, N m] at times `t` [s]; see transient.run_time_response.

        Examples
        --------
        >>> import fe_shaft
        >>> t = np.linspace(0.0, 0.1, 101)
        >>> rotor.run_time_response(100.0, None, t, unbalance=[fe_shaft.Unbalance(3, 1e-5)]).yout.shape
        (101, 28)
        """
        return transient.run_time_response(self, speed, F, t, initial, unbalance, gravity)

    @classmethod
    def from_ross(cls, rotor: Any) -> Rotor:
        """The same rotor from an object of the open code ROSS, by reading its attributes; see ross.py."""
        return cls(*ross.from_ross(rotor))

    def to_ross(self, module: Any) -> Any:
        """This rotor as an object of the open code ROSS; `module` is `import ross`; see ross.py."""
        return ross.to_ross(self, module)
