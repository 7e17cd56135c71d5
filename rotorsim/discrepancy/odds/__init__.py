"""Probabilities of what a diagnosis found: evidence of every explanation, model-form error of inferred size, odds."""
