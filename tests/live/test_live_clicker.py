"""Random clicks on the live page: no exception, no log entry, no wrong reading.

A minute of it runs with the browser's tests; set ROTORSIM_CLICKER=40 for so many minutes.
"""

import os

import pytest

from clicker import click
from live_browser import IN_BROWSER

MINUTES = float(os.environ.get("ROTORSIM_CLICKER", "1"))
pytestmark = IN_BROWSER


@pytest.mark.parametrize(("machine", "share"), [("dtu_gas_bearing", 1.0), ("plain_rotor", 0.5)])
def test_clicking_at_random_raises_nothing_and_no_reading_is_wrong(machine, share):
    outcome = click(share * MINUTES, seed=7, machine=machine)
    assert outcome.wrong == []
    assert outcome.compared["speed"] and sum(outcome.actions.values()) > 5
    assert outcome.compared["last hit"] >= int(share * MINUTES / 4)
