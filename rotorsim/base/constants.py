"""Conversion factors between SI and engineering units, and the sampling time of the thesis' rig."""

from math import pi

RPM, KRPM, HZ, MPA = pi / 30, 1000 * pi / 30, 2 * pi, 1e6
"""Values of one rpm [rad/s], 1000 rpm [rad/s], one Hz [rad/s] and one MPa [Pa]."""
TO_RPM, TO_HZ, TO_MPA, TO_UM = 30 / pi, 1 / (2 * pi), 1e-6, 1e6
"""Factors from rad/s to rpm, from rad/s to Hz, from Pa to MPa and from m to um."""
RIG_SAMPLE = 2e-4
"""Sampling time [s] of the thesis' rig: the default of a machine that states neither rate nor highest speed."""
MINUTE = 60.0
"""Length [s] of a minute."""
