"""Export of the plant as a native functional mock-up unit: the same step function, without Python."""
