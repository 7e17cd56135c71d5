"""Figures this software is held to, measured here and now: speed, accuracy, the rig against its references."""
