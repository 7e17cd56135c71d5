"""Sampled loop of law and model: margins, sensitivities, impact response, stability check."""
