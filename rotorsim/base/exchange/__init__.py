"""Exchange with other programs: objects of the package `control`, MATLAB files, archives, plain data."""
