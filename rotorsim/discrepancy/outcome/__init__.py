"""Results of a diagnosis: estimates, the gap, the machine file, files to store them."""
