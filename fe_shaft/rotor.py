r"""Rotor: a row of shaft elements with discs, point masses and bearings on its nodes.

.. math:: M \ddot q + (C + \Omega G) \dot q + K q = f, \qquad M = M' > 0, \quad G = -G'

q holds x, y, alpha, beta of node 0, then of node 1, and so on (frame and signs: elements.py); then the four internal
coordinates of every element that has them; then x, y of every pedestal, whose nodes are numbered after the shaft's.
K and C take the bearings' own matrices, which need not be symmetric, and with material damping the circulatory terms.

Source: Friswell et al. (2010), chapter 5.

Cites: friswell_2010.
"""

from __future__ import annotations

from typing import Any

from fe_shaft import campbell, critical, modal, response, ross, transient
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

    run_static = response.run_static
    run_modal = modal.run_modal
    run_campbell = campbell.run_campbell
    run_critical_speed = critical.run_critical_speed
    run_ucs = critical.run_ucs
    run_stability = critical.run_stability
    run_unbalance_response = response.run_unbalance_response
    run_freq_response = response.run_freq_response
    run_time_response = transient.run_time_response
    to_ross = ross.to_ross

    @classmethod
    def from_ross(cls, rotor: Any) -> Rotor:
        """The same rotor from an object of the open code ROSS, by reading its attributes; see ross.py."""
        return cls(*ross.from_ross(rotor))
