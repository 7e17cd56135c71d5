"""Records in, figures and pages out; the only place that knows a plot library."""
