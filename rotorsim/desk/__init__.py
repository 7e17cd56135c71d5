"""The desk: a rotor designed in the browser and answered while one types.

`design` is the text of the machine with its edits, `parts` what a page lists of it, `panels` the answers, `starts` what
an empty page begins with, `server` what a browser asks, `page` what it shows. Each imports those before it.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
