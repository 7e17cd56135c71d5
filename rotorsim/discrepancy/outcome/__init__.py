"""Results of a diagnosis: estimates, the gap, the machine file, the next experiment."""
