r"""Out-of-round journal and sleeve: lobes on the sleeve are fixed, lobes on the journal rotate.

.. math:: h \mathrel{+}= a_s \cos n_s(\theta - \theta_s) - a_j \cos n_j(\theta - \varphi - \theta_j)

A positive a_s is a wider sleeve at theta_s, a positive a_j a thicker journal at theta_j from the mark. Two lobes are
ovality; a turning lobe pumps at n_j times the shaft speed. Source: Rentzepis & Sternlicht (1962); Yu & Adams (1989).
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, FilmEffect, param, register
from rotorsim.effects.film import closed_gap


@inlined
def out_of_round(t, angle, speed, theta, p):
    """Change of the gap [m] and its slope along z [1]."""
    sleeve = p.sleeve * math.cos(p.sleeve_lobes * (theta - p.sleeve_phase))
    journal = p.journal * math.cos(p.journal_lobes * (theta - angle - p.journal_phase))
    return sleeve - journal, 0.0


@register
class OutOfRound(FilmEffect):
    """Lobes on sleeve and journal; several tables for several orders."""

    port = "film"
    kernel = out_of_round
    cites = ("rentzepis_1962", "yu_1989")
    forms = (
        CandidateForm("sleeve", 3e-7, "sleeve_phase", options=(("sleeve_lobes", (2.0,)),)),
        CandidateForm("journal", 3e-7, "journal_phase", options=(("journal_lobes", (2.0,)),)),
    )
    sleeve: float = param("m", bounds=(0.0, 2e-5), doc="Height of the sleeve's lobes, 0-pk.")
    sleeve_lobes: float = param("1", default=2.0, bounds=(1.0, 12.0), whole=True, doc="How many, a whole number.")
    sleeve_phase: float = param("rad", bounds=(-TURN, TURN), doc="Where the sleeve is widest.")
    journal: float = param("m", bounds=(0.0, 2e-5), doc="Height of the journal's lobes, 0-pk.")
    journal_lobes: float = param("1", default=2.0, bounds=(1.0, 12.0), whole=True, doc="How many, a whole number.")
    journal_phase: float = param("rad", bounds=(-TURN, TURN), doc="Where the journal is thickest, from the mark.")

    def problems(self, machine: Any) -> dict[str, str]:
        """Lobes leave a gap."""
        return closed_gap(self, machine)

    def narrowing(self, machine: Any) -> float:
        """Largest reduction of the gap [m]."""
        return self.sleeve + self.journal
