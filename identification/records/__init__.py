"""Records and run-up vectors: schema, mapping, units, checks, prefilter."""
