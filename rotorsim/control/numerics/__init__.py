"""Riccati equations, linear matrix inequalities, state-space arithmetic."""
