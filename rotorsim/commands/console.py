"""Console of tables: text of other people is shown as it is, neither obeyed by the terminal nor taken for markup."""

from __future__ import annotations

from typing import Any

from rich import console
from rich.errors import MarkupError
from rich.text import Text

from rotorsim.base.sentences import visible


class Console(console.Console):
    """Rich's console without highlighting of numbers, for text that may hold anything."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"highlight": False} | options)

    def render_str(self, text: str, **options: Any) -> Text:
        """A text, with its markup if it is one."""
        try:
            return super().render_str(visible(text), **options)
        except MarkupError:
            return super().render_str(visible(text), **options | {"markup": False})
