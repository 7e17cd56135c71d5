"""Exchange of systems and matrices with other programs: the package `control`, MATLAB."""
