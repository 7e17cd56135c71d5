"""Records as laboratories make them: keyphasors, probes at any angle, faults of sensors, cuts, slow roll."""
