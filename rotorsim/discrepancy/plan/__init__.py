"""Plan of the next experiment: the run after which the odds of a diagnosis should be most certain."""
