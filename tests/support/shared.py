"""Builders as fixtures."""

import pytest


def shared(builder):
    """Fixture of the whole session that is the builder itself."""
    return pytest.fixture(scope="session")(lambda: builder)
