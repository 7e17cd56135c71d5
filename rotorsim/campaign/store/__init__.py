"""Campaign store: index, records, tables."""
