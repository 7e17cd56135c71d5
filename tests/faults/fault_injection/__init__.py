"""Fault injection: commands that write files, faults during their run, and checks afterwards."""
