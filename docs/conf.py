"""Sphinx configuration: `sphinx-build -W --keep-going -b html docs site`, or `.ci/docs`."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))


from site_pages import write_pages  # noqa: E402

from rotorsim.base.cache import installed  # noqa: E402

project = "rotorsim"
author = copyright = "The rotorsim authors"
version = release = installed("rotorsim")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "mathml",
]
source_suffix = {".md": "markdown"}
html_math_renderer = "mathml"  # equations without a script from another server
html_theme = "furo"
html_title = f"rotorsim {version}"
html_static_path: list[str] = []
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = r"\$ "
copybutton_prompt_is_regexp = True

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
default_role = "literal"  # docstrings write code in single backticks
nitpicky = False
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Signal")}  # their names instead of all they stand for
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "imported-members": True, "undoc-members": False}

napoleon_google_docstring = False
napoleon_use_ivar = True
suppress_warnings = ["ref.python"]  # types in docstrings are words, not links
linkcheck_ignore = [r"http://127\.0\.0\.1.*", r"http://localhost.*"]
linkcheck_anchors = False

write_pages()


def setup(app: Any) -> None:
    """Signatures with the plain names of types."""
    app.connect("autodoc-process-signature", plain_types)


def plain_types(
    app: Any, what: str, name: str, one: Any, options: Any, signature: str | None, returned: str | None
) -> Any:
    """Signature and returned type without the class that Sphinx shows around an alias in a union."""
    return tuple(text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in (signature, returned))
