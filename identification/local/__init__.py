"""Local models at one operating point: structures, fit, residual tests, confidence."""
