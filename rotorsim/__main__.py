"""`python -m rotorsim` is the command `rotorsim`."""

from rotorsim.cli import main

main()
