r"""Gain errors and cross-axis sensitivity of the displacement sensors.

.. math:: \begin{pmatrix} x \\ y \end{pmatrix} \to
          \begin{pmatrix} 1 + g_x & c_x \\ c_y & 1 + g_y \end{pmatrix} \begin{pmatrix} x \\ y \end{pmatrix}

Source: API 670 for sizes: +-5 % of incremental scale factor, mounting within a degree.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def sensor_gain(w, reading, state, seed, sample, p):
    """Change the displacements read."""
    x, y = w[reading], w[reading + 1]
    w[reading] = x + (p.x * x + p.cross_x * y)
    w[reading + 1] = y + (p.y * y + p.cross_y * x)


@register
class SensorGain(Effect):
    """Gain and cross-axis errors of the displacement sensors."""

    port = "sensor"
    kernel = sensor_gain
    cites = ("api_670",)
    forms = (
        CandidateForm("x", 0.03, signature="ratio of the sensors' gains", resembles="the gain of actuator x against y",
                      axes_only=True),
        CandidateForm("y", 0.03, signature="ratio of the sensors' gains", resembles="the gain of actuator y against x",
                      axes_only=True),
        CandidateForm("cross_x", 0.02, axes_only=True),
        CandidateForm("cross_y", 0.02, axes_only=True),
    )  # fmt: skip
    x: float = param("1", bounds=(-0.9, 9.0), doc="Relative gain error of sensor x.")
    y: float = param("1", bounds=(-0.9, 9.0), doc="Relative gain error of sensor y.")
    cross_x: float = param("1", bounds=(-1.0, 1.0), doc="Share of y that sensor x sees.")
    cross_y: float = param("1", bounds=(-1.0, 1.0), doc="Share of x that sensor y sees.")
