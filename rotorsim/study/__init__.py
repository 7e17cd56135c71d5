"""Studies: a campaign on the virtual rig, what follows from its records alone, and what the physics says."""
