"""`rotorsim machine`: machine files and the catalogue of effects."""
