"""Simulated full disk without root: a limit on the file size (POSIX)."""

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager

UNLIMITED = resource.RLIM_INFINITY


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """No file of this process may grow beyond `size` [bytes]: a write fails with EFBIG as it does with a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
