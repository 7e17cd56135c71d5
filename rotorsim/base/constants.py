"""Conversion factors between SI and engineering units: RPM is 1 rpm in rad/s, TO_RPM converts rad/s to rpm."""

from math import pi

RPM, KRPM, HZ, MPA = pi / 30, 1000 * pi / 30, 2 * pi, 1e6
"""One rpm, 1000 rpm and one Hz in rad/s, one MPa in Pa."""
TO_RPM, TO_HZ, TO_MPA, TO_UM = 30 / pi, 1 / (2 * pi), 1e-6, 1e6
"""Factors from rad/s to rpm and Hz, from Pa to MPa, from m to um."""
RIG_SAMPLE = 2e-4
"""Sampling time of the thesis' rig, 5 kHz [s]: of a machine that states neither rate nor highest speed, and of what is
made without a machine."""
MINUTE = 60.0
"""Seconds of a minute."""
