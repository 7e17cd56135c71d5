"""Figures with plotly and pyvista in one common style."""
