"""Figures of probe signals: orbits at the planes of the probes, filtered orbits, runout."""
