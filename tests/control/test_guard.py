"""Law with NaN and infinite samples: hold, fade-out, alarm, and bumpless return."""

import numpy as np
import pytest

from rotorsim.control import Law
from rotorsim.control.guard import ALARM, BEGIN, FADE, HOLD, LEAST, RANGE, SENSOR, SENTENCES, SIZE, STEP, guard
from rotorsim.control.law_kernel import steps

BAD = (np.nan, np.inf, -np.inf)
POINT = (150.0, 4e5)
GONE = int(HOLD + FADE)


def law_of(s=3, p=2, n=4, **settings):
    """A stable law of random matrices over s speeds and p pressures."""
    rng = np.random.default_rng(0)
    shapes = {"A": (n, n), "B": (n, 2), "C": (2, n), "D": (2, 2), "W": (n, 2)}
    matrices = {name: 0.2 * rng.normal(size=(s, p, *shape)) for name, shape in shapes.items()}
    return Law("test", **matrices, speeds=np.linspace(0, 600, s), pressures=np.linspace(3e5, 7e5, p), **settings)


def wave(n, phase=0.0):
    """Displacement (n, 2) [m] that turns once in 40 samples."""
    t = 2 * np.pi * np.arange(n) / 40 + phase
    return 1e-2 * np.column_stack([np.cos(t), np.sin(t)])


def run(law, measured, speed=POINT[0], pressure=POINT[1]):
    """Outputs (n, 2) and alarm codes (n,) of a law for measured (n, 2)."""
    law.reset()
    speeds, pressures = np.broadcast_to(speed, len(measured)), np.broadcast_to(pressure, len(measured))
    found = [(law.step(y, s, p), law.alarm_code) for y, s, p in zip(measured, speeds, pressures, strict=True)]
    return np.array([u for u, _ in found]), np.array([code for _, code in found])


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("axis", [0, 1])
def test_one_bad_sample_is_held_out_of_the_states(bad, axis):
    """The law goes on as if that sample had not been, after one sample of transition."""
    measured = wave(200)
    measured[100, axis] = bad
    u, codes = run(law_of(), measured)
    without, _ = run(law_of(), np.delete(measured, 100, axis=0))
    np.testing.assert_array_equal(u[:100], without[:100])
    np.testing.assert_array_equal(u[100], u[99])
    np.testing.assert_allclose(u[101], (u[99] + without[100]) / 2, rtol=1e-12)
    np.testing.assert_array_equal(u[102:], without[101:])
    assert codes.nonzero()[0].tolist() == [100, 101] and set(codes) == {0, 1}


def test_a_lost_sensor_fades_the_output_out_in_a_straight_line_within_105_samples():
    measured = wave(400)
    measured[200:] = np.nan
    u, codes = run(law_of(), measured)
    last = u[199]
    assert np.abs(last).min() > 1e-4
    np.testing.assert_array_equal(u[200:205], [last] * 5)
    np.testing.assert_allclose(u[204 : 200 + GONE], last * (1 - np.arange(GONE - 4) / FADE)[:, None], atol=1e-15)
    assert not u[200 + GONE - 1 :].any() and np.all(codes[200:] == 1)


@pytest.mark.parametrize("lost", [1, 2, 5, 6, 50, 104, 150, 1000])
def test_the_return_is_without_a_jump_and_ends_in_what_the_law_would_give(lost):
    """No step of the output is larger than the law's own and a share of the way back."""
    measured = np.vstack([wave(200), np.full((lost, 2), np.nan), wave(400)])
    u, codes = run(law_of(), measured)
    without, _ = run(law_of(), np.vstack([wave(200), wave(400)]))
    back = min(lost, int(FADE)) + 1
    settled = 40 if lost > HOLD else 0  # what is left of the states after a fade settles
    np.testing.assert_allclose(u[200 + lost + back + settled :], without[200 + back + settled :], rtol=0, atol=1e-12)
    own = np.abs(np.diff(without, axis=0)).max()
    away = np.abs(without).max() * 2
    assert np.abs(np.diff(u[199:], axis=0)).max() <= own + away / (back if lost > 1 else 2)
    assert codes.nonzero()[0].tolist() == list(range(200, 200 + lost + back - 1))


def proportional(gain):
    """A law without states: gain [V/m]."""
    parts = {"A": (0, 0), "B": (0, 2), "C": (2, 0), "W": (0, 2)}
    matrices = {name: np.zeros((1, 1, *shape)) for name, shape in parts.items()}
    return Law("test", **matrices, D=gain * np.eye(2)[None, None], speeds=[0.0], pressures=[0.0])


@pytest.mark.parametrize("phase", np.arange(0, 3, 0.5))
@pytest.mark.parametrize("lost", [1, 2, 4, 8, 15, 30])
def test_no_step_of_a_return_is_larger_than_the_largest_of_the_law(lost, phase):
    """The output turns once in 40 samples and has gone on while samples were missing."""
    measured = wave(600, phase)
    measured[200 : 200 + lost] = np.nan
    u, codes = run(proportional(200.0), measured)
    own = np.abs(np.diff(u[1:200], axis=0)).max()
    assert own > 4 * LEAST
    assert np.abs(np.diff(u[199:], axis=0)).max() <= own * (1 + 1e-9)
    assert not codes[200 + lost + 101 :].any()
    np.testing.assert_array_equal(u[400:], 200.0 * measured[400:])


def test_a_law_that_must_act_more_than_ever_before_comes_back_to_all_of_its_output():
    """It was quiet before; afterwards its output moves by up to 0.47 V a sample."""
    measured = np.vstack([1e-3 * wave(200), np.full((200, 2), np.nan), wave(600)])
    u, codes = run(proportional(300.0), measured)
    steps_ = np.abs(np.diff(u, axis=0)).max(axis=1)
    back = np.flatnonzero(codes == 0)
    assert steps_[399 : 399 + int(FADE) + 1].max() <= LEAST * (1 + 1e-9)
    first = int(back[back > 400][0])
    assert first < 400 + 2.5 * FADE and not codes[first:].any()
    np.testing.assert_array_equal(u[first:], 300.0 * measured[first:])


@pytest.mark.parametrize(("last", "own", "samples"), [(3.0, 0.1, 30), (5.0, 0.01, 40), (5.0, 1.0, 10), (0.2, 0.0, 10)])
def test_an_output_that_may_be_wrong_fades_out_in_steps_of_the_law_or_within_40_samples(last, own, samples):
    memory, out, given = np.zeros(SIZE), np.zeros(2), []
    memory[:2], memory[STEP] = (last, -last / 2), own
    for _ in range(50):
        guard(memory, RANGE, out)
        given.append(out.copy())
    steps_ = np.abs(np.diff(np.vstack([[last, -last / 2], given]), axis=0)).max(axis=1)
    np.testing.assert_allclose(steps_[: samples - 1], last / samples, rtol=1e-9)
    assert np.abs(given[samples]).max() == 0.0 and memory[ALARM] == RANGE and memory[BEGIN] == last


def test_a_law_that_has_faded_out_comes_back_from_rest():
    """Its states were old: the outputs are those of a law that begins, times the part that has come back."""
    measured = np.vstack([wave(200), np.full((300, 2), np.nan), wave(400, 1.0)])
    slow = law_of().with_(A=0.98 * np.eye(4) * np.ones((3, 2, 1, 1)))
    u, _ = run(slow, measured)
    fresh, _ = run(slow, wave(400, 1.0))
    part = np.minimum(np.arange(1, 401) / (FADE + 1), 1.0)
    np.testing.assert_allclose(u[500:], part[:, None] * fresh, rtol=1e-9, atol=1e-15)


def test_the_guard_alone_holds_and_returns_without_a_jump():
    memory, out, given = np.zeros(SIZE), np.zeros(2), []
    for k in range(300):
        out[:] = np.sin(0.15 * k), np.cos(0.15 * k)
        guard(memory, SENSOR if 100 <= k < 110 else 0.0, out)
        given.append(out.copy())
    assert np.abs(np.diff(given[1:], axis=0)).max() <= 0.15 and memory[ALARM] == 0.0


@pytest.mark.parametrize("gap", [1, 3, 20])
def test_samples_lost_on_the_way_back_do_not_shorten_it(gap):
    """200 samples are lost, then every second, fourth or 21st: the output jumped half of the way after the next one."""
    lost = np.zeros(800, bool)
    lost[200:400] = lost[400 + gap : 700 : gap + 1] = True
    measured = np.full((800, 2), 1e-2)
    measured[lost] = np.nan
    u, codes = run(law_of(), measured)
    end = np.abs(u[199]).max()
    assert end > 1e-4 and not u[399].any()
    assert np.abs(np.diff(u[399:], axis=0)).max() <= 1.5 * end / FADE
    np.testing.assert_allclose(u[-1], u[199], rtol=1e-9)
    assert np.count_nonzero(codes[400:][~lost[400:]]) >= FADE and codes[-1] == 0


@pytest.mark.parametrize("bad", BAD)
def test_a_scheduled_law_survives_a_bad_speed_or_pressure(bad):
    for quantity in ("speed", "pressure"):
        values = {"speed": np.full(300, POINT[0]), "pressure": np.full(300, POINT[1])}
        values[quantity][100:110] = bad
        law = law_of(refresh=7)
        u, codes = run(law, wave(300), **values)
        assert np.isfinite(u).all() and np.all(codes[100:110] == 2) and codes[-1] == 0
        without, _ = run(law_of(refresh=7), np.delete(wave(300), slice(100, 110), axis=0))
        np.testing.assert_array_equal(u[150:], without[140:])


def test_a_law_that_is_not_scheduled_does_not_need_speed_and_pressure():
    u, codes = run(law_of(s=1, p=1), wave(50), np.nan, np.nan)
    without, _ = run(law_of(s=1, p=1), wave(50))
    np.testing.assert_array_equal(u, without)
    assert not codes.any()


def test_a_law_alarm_is_a_sentence_while_it_lasts_and_remembered_after():
    law = law_of()
    run(law, wave(50))
    assert (law.alarm, law.alarm_code, law.past_alarms) == (None, 0, "")
    law.step([np.nan, 0.0], *POINT)
    assert law.alarm == SENTENCES[1] and "displacement is not a number" in law.alarm
    for y in wave(10):
        law.step(y, *POINT)
    assert law.alarm is None and law.past_alarms.startswith("1 bad samples")
    law.reset()
    assert law.past_alarms == ""


def test_bad_samples_do_not_enter_the_mean_position_nor_the_fade_in():
    measured = np.vstack([np.full((3, 2), np.nan), np.full((10, 2), 2e-3), np.full((4, 2), np.inf), wave(300) + 2e-3])
    u, _ = run(law_of(average=0.004, fade=0.004), measured)
    good = np.isfinite(measured).all(axis=1)
    without, _ = run(law_of(average=0.004, fade=0.004), measured[good])
    np.testing.assert_array_equal(u[-250:], without[-250:])


@pytest.mark.parametrize("huge", [1e4, 1e300, -1.7e308])
def test_a_displacement_that_no_sensor_shows_is_not_a_sample(huge):
    measured = wave(60)
    measured[30, 0] = huge
    u, codes = run(law_of(), measured)
    assert codes[30] == 1
    np.testing.assert_array_equal(u[30], u[29])


def test_an_unstable_law_whose_states_overflow_is_never_nan_and_reports_it():
    """A pole at 10: the states pass 1e308 within 310 samples; without the guard the output is NaN from then on."""
    eye = np.eye(2)
    parts = {
        name: value[None, None] for name, value in zip("ABCDW", (10 * eye, eye, eye, 0 * eye, 0 * eye), strict=True)
    }
    law = Law("unstable", **parts, speeds=[0.0], pressures=[0.0])
    u, codes = run(law, np.ones((700, 2)))
    assert np.isfinite(u).all() and np.abs(u).max() <= law.limit
    assert 3 in codes and "overflowed" in law.past_alarms


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9])
def test_random_losses_leave_a_finite_output_within_the_limit(share):
    rng = np.random.default_rng(5)
    measured = wave(3000)
    measured[rng.uniform(size=measured.shape) < share] = np.nan
    u, _ = run(law_of(), measured)
    assert np.isfinite(u).all() and np.abs(u).max() <= 5.0


def test_many_samples_at_once_are_guarded_too():
    law = law_of()
    measured = wave(300)
    measured[100:130] = np.nan
    one_by_one, _ = run(law, measured)
    law.reset()
    out = np.zeros(600)
    steps(law.memory, law.table, law.axes, law.layout, law.settings, measured.ravel(), *POINT, out)
    np.testing.assert_array_equal(out.reshape(-1, 2), one_by_one)


def test_a_saved_memory_restores_a_law_in_the_midst_of_a_fade():
    law, measured = law_of(), wave(300)
    measured[100:140] = np.nan
    law.reset()
    for y in measured[:120]:
        law.step(y, *POINT)
    saved = law.memory.copy()
    first = [law.step(y, *POINT) for y in measured[120:]]
    law.memory[:] = saved
    np.testing.assert_array_equal([law.step(y, *POINT) for y in measured[120:]], first)
