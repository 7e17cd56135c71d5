"""Fixtures shared by the tests of the live rig."""

import pytest

from coarse_rig import RPM, make_rig
from rotorsim.live.runner import Runner


@pytest.fixture
def runner():
    found = Runner(make_rig(speed=3000 * RPM))
    yield found
    found.close()
