"""Linear parameter-varying models: surfaces over speed and pressure, their fit and refinement."""
