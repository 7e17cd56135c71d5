"""Sliding window over the last seconds of samples."""

from __future__ import annotations

import numpy as np

LENGTH = 10_000
"""Samples that are kept: 2 s."""


class History:
    """Sliding window of at least the last `length` rows."""

    def __init__(self, columns: int, length: int = LENGTH) -> None:
        self._rows = np.zeros((2 * length, columns))
        self._length, self._end = length, 0
        self.total = 0

    def add(self, rows: np.ndarray) -> None:
        """Append rows (n, columns); more than `length` at a time keep their end."""
        self.total += len(rows)
        rows = rows[-self._length :]
        if self._end + len(rows) > len(self._rows):
            kept = self._rows[max(self._end - self._length, 0) : self._end].copy()
            self._rows[: len(kept)], self._end = kept, len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def last(self, count: int) -> np.ndarray:
        """The last rows, at most `count` of them (and of `length`)."""
        return self._rows[max(self._end - min(count, self._length), 0) : self._end]

    def clear(self) -> None:
        """Forget everything."""
        self._end = self.total = 0
