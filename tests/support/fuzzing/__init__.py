"""Random machine files, experiment calls and data files for the fuzz tests, and checks of the outcome."""
