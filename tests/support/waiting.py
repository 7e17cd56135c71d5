"""Waiting for events: a test decides by what happens, never by how long that takes."""

import time

PATIENCE = 3600.0
"""Longest time [s] to wait for what must come: it bounds a hang and nothing less, however slow or busy the computer."""


def until(condition, process=None):
    """Value of a condition once it holds; fails if it does not come, or if the process that works on it ends before."""
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, "did not come"
        assert process is None or process.poll() is None, process.communicate()
        time.sleep(0.02)
    return found


def window(browser, **options):
    """New window of a browser whose operations wait for what must come."""
    page = browser.new_page(**options)
    page.set_default_timeout(PATIENCE * 1e3)
    return page
