"""Export of the plant as a native functional mock-up unit. Nothing is exported yet: the package holds its place."""
