"""Progress display of a campaign: rate and times."""

import pytest

from rotorsim.campaign import run as show
from rotorsim.campaign.run import RECENT, CaseRate, spell


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands where it is set."""
    time = [0.0]
    monkeypatch.setattr(show.time, "monotonic", lambda: time[0])
    return time


def noted(clock, *marks):
    rate = CaseRate()
    for clock[0], done in marks:
        rate.note(done)
    return rate.value


def test_the_rate_begins_at_the_first_case_because_machine_code_is_made_before_it(clock):
    assert noted(clock, (0, 0), (90, 0)) == 0.0
    assert noted(clock, (0, 0), (90, 1)) == 0.0
    assert noted(clock, (0, 0), (90, 1), (92, 5)) == pytest.approx(2.0)


def test_the_rate_is_that_of_the_last_minute(clock):
    marks = [(t, t) for t in range(1, 101)] + [(100 + t, 100 + 4 * t) for t in range(1, int(2 * RECENT))]
    assert noted(clock, *marks) == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize(("seconds", "text"), [(12.4, "12 s"), (600, "10 min"), (7200, "2.0 h")])
def test_times_are_shown_as_people_read_them(seconds, text):
    assert spell(seconds) == text
