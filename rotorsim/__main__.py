"""Entry point of `python -m rotorsim` and of the installed command `rotorsim`.

Ctrl-C ends the process silently until the command handles it: nothing is written yet, and Python would print a
traceback.
"""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from rotorsim.cli import main

if __name__ == "__main__":
    main()
