"""`rotorsim map`: maps over operating points."""
