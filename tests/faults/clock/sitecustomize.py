"""Wall clock that jumps an hour forward and back while a command runs, in all its processes.

ROTORSIM_CLOCK_JUMPS holds the moments on the monotonic clock, which does not jump, in seconds.
"""

import os
import time

HOUR = 3600 * 10**9
_true, _moments = time.time_ns, [float(text) for text in os.environ.get("ROTORSIM_CLOCK_JUMPS", "").split()]


def _time_ns() -> int:
    now = time.monotonic()
    return _true() + HOUR * (sum(moment <= now for moment in _moments) % 2)


time.time_ns = _time_ns
time.time = lambda: _time_ns() * 1e-9
