"""Diagnosis in a loop with experiments, until one explanation is settled."""
