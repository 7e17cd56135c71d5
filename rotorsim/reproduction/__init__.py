"""Reproduction of the thesis: campaigns on the virtual rig, identification, control and verdicts on its claims."""
