"""Catalogue of experiments, one file each, which is imported when its experiment is asked for by its name."""
