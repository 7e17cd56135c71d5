"""Controls of the live rig: limits, slider positions, hammer, file names."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.live.folder import Scene, load_scene
from rotorsim.live.rig import Hammer, History, hit, ramp
from rotorsim.live.settings import Control
from rotorsim.machine import machine_text

GAP = Control("clearance_growth.growth", "growth", "um", 1e-6, -20e-6, 20e-6, 0.0)
COUNT = Control("encoder.counts", "counts", "", 1.0, 0.0, 1e6, 0.0, whole=True)


def test_a_value_within_the_limits_is_taken_without_a_word():
    assert GAP.clamp(3e-6) == (3e-6, "")


def test_a_value_beyond_the_limits_is_clamped_and_reported_in_the_units_people_read():
    value, message = GAP.clamp(1.0)
    assert value == 20e-6
    assert message == "growth: 1e+06 um is beyond -20 um to 20 um, set to 20 um"


def test_a_number_that_must_be_whole_is_rounded_with_a_message():
    assert COUNT.clamp(2.4) == (2.0, "counts: 2.4 is not whole, set to 2")


@pytest.mark.parametrize("wrong", [math.nan, math.inf, "5", None, True, [1.0]])
def test_what_is_no_number_is_refused(wrong):
    with pytest.raises(DataError, match="is not a number"):
        GAP.clamp(wrong)


@given(st.floats(-1, 1))
def test_a_slider_gives_values_within_the_limits_and_stands_where_its_value_is(place):
    value = GAP.value(place)
    assert GAP.low <= value <= GAP.high
    assert GAP.value(GAP.place(value)) == pytest.approx(value, rel=1e-9, abs=1e-12)


def test_the_middle_of_a_slider_is_neutral_to_the_last_bit():
    assert GAP.value(0.0) == GAP.neutral and GAP.place(GAP.neutral) == 0.0


def test_the_impulse_of_a_hit_is_exact():
    assert hit(0.02, 1, RIG_SAMPLE).sum(axis=0) * RIG_SAMPLE == pytest.approx([0.0, 0.02], rel=1e-12)


def test_hits_that_fall_together_add_up_whatever_the_blocks():
    hammer = Hammer(RIG_SAMPLE)
    hammer.strike(0.01, 0)
    first = hammer.take(2)
    hammer.strike(0.03, 0)
    rest = np.concatenate([hammer.take(1), hammer.take(20)])
    assert (first.sum(axis=0) + rest.sum(axis=0)) * RIG_SAMPLE == pytest.approx([0.04, 0.0], rel=1e-12)


def test_a_speed_ramps_to_its_target_and_stays():
    speeds = ramp(10.0, 10.1, 100.0, 10, RIG_SAMPLE)
    assert speeds[0] == pytest.approx(10.02) and speeds[-1] == 10.1
    assert np.diff(speeds).max() <= 100.0 * RIG_SAMPLE * (1 + 1e-9)


def test_a_history_keeps_the_last_rows_in_order():
    history, count = History(1, 100), 0
    for size in (30, 70, 1, 150, 99, 250):
        history.add(np.arange(count, count + size, dtype=float)[:, None])
        count += size
        kept = history.last(100)[:, 0]
        assert kept[-1] == count - 1 and np.all(np.diff(kept) == 1.0)
    assert len(history.last(100)) == 100


def test_a_scene_comes_back_as_it_was_saved(tmp_path):
    scene = Scene(machine_text("plain_rotor"), {"speed": 314.1592653589793, "pace": "0.1x"})
    scene.save(tmp_path / "a.scene.json")
    assert load_scene(tmp_path / "a.scene.json") == scene


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("nonsense", "is not JSON"),
        ("[1, 2]", "is not a scene"),
        (json.dumps({"kind": "rotorsim scene", "version": 99}), "is a scene of version 99, this is version 1"),
        (json.dumps({"kind": "rotorsim scene", "version": 1, "machine": "", "values": 3}), "lacks its machine"),
        ("[" * 100_000, "is not JSON"),
    ],
)
def test_a_file_that_is_no_scene_of_this_version_is_refused_with_a_sentence(tmp_path, content, sentence):
    path = tmp_path / "a.scene.json"
    path.write_text(content)
    with pytest.raises(DataError, match=sentence):
        load_scene(path)
