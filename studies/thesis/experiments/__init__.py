"""Experiments on the claims: figures of the thesis as functions of one number of the machine."""
