"""`rotorsim study`: studies that reproduce the thesis."""
