"""Handling of malformed page messages (dropped) and of program errors (one log line each)."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from inspect import iscoroutinefunction
from typing import Any

LOGGERS = ("nicegui", "engineio", "socketio", "uvicorn", "asyncio")
MOST = 50
"""Lines that are written; a flood of faults shows nothing new."""
ENDED = "graceful shutdown"
"""In what the server writes when it ends with pages open."""
WITHOUT_MESSAGE = ("connect", "disconnect")
"""Events that carry nothing from the page; the server library tries their handlers with more and fewer arguments."""
MALFORMED = (KeyError, TypeError, ValueError, AttributeError, IndexError)


class OneLine(logging.Handler):
    """Log formatter with one line per entry."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.lines = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to stderr."""
        if ENDED in record.getMessage():
            return
        self.lines += 1
        if self.lines > MOST:
            return
        error = record.exc_info[1] if record.exc_info else None
        found = [" ".join(record.getMessage().split())] + ([f"{type(error).__name__}: {error}"] if error else [])
        print(f"rotorsim live: {'; '.join(found)}"[:400], file=sys.stderr)
        if self.lines == MOST:
            print(f"rotorsim live: these were {MOST} lines; no more are written", file=sys.stderr)


def quiet() -> None:
    """Set up the server's logging, and drop malformed messages before they reach the page library."""
    handler = OneLine()
    for name in [name for name in logging.root.manager.loggerDict if name.startswith(tuple(f"{n}." for n in LOGGERS))]:
        logging.getLogger(name).handlers = []  # engineio and socketio bring their own
    for name in LOGGERS:
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [handler], False
        logger.setLevel(logging.ERROR)
    from nicegui import core

    for handlers in core.sio.handlers.values():
        for event, handle in handlers.items():
            if event not in WITHOUT_MESSAGE:
                handlers[event] = dropping(handle)


def dropping(handle: Callable[..., Any]) -> Callable[..., Any]:
    """Message handler that drops unreadable messages; errors of controls are handled elsewhere."""
    if iscoroutinefunction(handle):

        async def waited(*arguments: Any) -> Any:
            try:
                return await handle(*arguments)
            except MALFORMED:
                return None

        return waited

    def called(*arguments: Any) -> Any:
        try:
            return handle(*arguments)
        except MALFORMED:
            return None

    return called
