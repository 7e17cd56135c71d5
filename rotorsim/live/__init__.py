"""Live rig: the plant runs in real time, with controls and views on a page in the browser.

`rig` is the running machine without any clock, `runner` paces it in a thread, `frame` makes what a page draws of it;
`server` and `page` are the only ones that know the web.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
