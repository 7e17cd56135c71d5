"""`rotorsim diagnose` and `rotorsim hide`."""
