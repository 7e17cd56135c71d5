"""Claims of the thesis: rules, numbers, verdicts."""
