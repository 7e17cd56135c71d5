"""Three-dimensional pictures and films with pyvista, drawn without a window."""
