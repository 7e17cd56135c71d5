"""`rotorsim experiment`: virtual experiments."""
