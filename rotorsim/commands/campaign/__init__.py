"""`rotorsim campaign`: campaigns of virtual experiments."""
