"""Live rig: the plant runs in real time, with controls and views on a page in the browser.

`rig` has the running machine, its settings and records, the thread that paces it and the frames that are drawn of it;
`page` is what a browser shows, `server` what it asks, `serving` the one call. Each imports those before it.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
