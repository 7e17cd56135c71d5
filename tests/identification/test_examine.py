"""Examination of records: faults, suspicious values, possible uses."""

import numpy as np
import pytest

import identification as idn
from identification.local.identify import refusal
from identification.records.checks import check_record

N = 1000
T = np.arange(N) / 5000


def made(**change):
    rng = np.random.default_rng(0)
    values = {
        "time": T,
        "reference": rng.normal(size=(N, 2)),
        "disc_measured": rng.normal(size=(N, 2)) * 1e-6,
        "angle": 100 * T,
        "speed": np.full(N, 100.0),
        "pressure": np.full(N, 3e5),
    } | change
    return idn.make_record(values.pop("time"), {name: value for name, value in values.items() if value is not None})


RISING = {"speed": np.linspace(100.0, 110.0, N), "angle": 100 * T + 0.5 * 50 * T**2}


def test_a_good_record_is_fit_for_everything():
    found = idn.examine(made(**RISING))
    assert found.usable and not found.problems and not found.warnings
    assert found.sample_rate == pytest.approx(5000) and found.duration == pytest.approx(0.2)
    assert found.uses == dict.fromkeys(found.uses, "")
    assert [c.name for c in found.channels[:2]] == ["reference x", "reference y"]


@pytest.mark.parametrize("without", ["speed", "angle"])
def test_a_record_at_constant_speed_is_no_run_up(without):
    noisy = {"speed": 100.0 + np.random.default_rng(3).normal(size=N)}
    for changed, lacks in (({}, "a speed that rises or falls"), (noisy, "a speed that rises or falls"), (RISING, "")):
        found = idn.examine(made(**changed | {without: None}))
        assert found.uses["run-up analysis"] == lacks and found.fit("identification")


LACKS = {
    "reference": ("identification", "reference"),
    "angle": ("runout filter", "angle_measured or angle"),
    "disc_measured": ("run-up analysis", "disc_measured or disc"),
    "pressure": ("scheduled models", "pressure_measured or pressure"),
}


@pytest.mark.parametrize("missing", LACKS)
def test_each_use_names_what_it_lacks(missing):
    use, lacks = LACKS[missing]
    found = idn.examine(made(**{missing: None}))
    assert found.uses[use] == lacks and not found.problems
    assert found.usable is (missing != "disc_measured")


def test_a_record_of_commands_alone_is_fit_for_nothing():
    assert not idn.examine(made(disc_measured=None, angle=None)).usable


def with_values(at, value, name="angle"):
    record = made()
    record[name].values[at] = value
    return record


@pytest.mark.parametrize(
    ("record", "problem"),
    [
        (made(time=np.where(T > 0.1, T + 0.5, T)), "time: 1 gaps in samples 0.0002 s apart"),
        (made(time=np.where(np.arange(N) == 7, T[6], T)), "time: time stands still at 1 places"),
        (made(time=T[::-1]), "time: time falls at 999 places"),
        (with_values(5, np.nan), "angle: 1 NaN or infinite, the first at sample 6; cut the record there"),
        (with_values(5, np.inf, "speed"), "speed: 1 NaN or infinite"),
        (with_values(slice(None), np.nan), "angle: all NaN or infinite"),
        (made().rename(time="t"), "record: no coordinate 'time'"),
    ],
)
def test_a_fault_is_a_problem_and_unfits_the_record(record, problem):
    found = idn.examine(record)
    assert not found.usable and any(problem in text for text in found.problems)


def test_identification_is_fit_with_gaps_that_it_leaves_out():
    time = np.arange(10000) / 5000
    leap = np.where(time > 1, time + 0.5, time)
    rng = np.random.default_rng(0)
    plain = {"reference": rng.normal(size=(10000, 2)), "disc_measured": rng.normal(size=(10000, 2)) * 1e-6}
    record = made(time=leap, angle=100 * leap, speed=None, pressure=None, **plain)
    found = idn.examine(record)
    assert found.problems and not found.doubts and found.usable and found.left_out.startswith("2500 of 12500 samples")
    assert found.fit("identification") and not found.fit("runout filter")
    record["disc_measured"][3] = np.nan
    assert idn.examine(record).fit("identification")
    for spoilt in (record.assign_attrs(clipped="x: rests at 1 um"), record.isel(time=slice(3000, 7000))):
        found = idn.examine(spoilt)
        assert not found.fit("identification") and not found.usable and not found.left_out


def clipped(values):
    return np.clip(values, -1e-6, 1e-6)


@pytest.mark.parametrize(
    ("record", "warning", "doubted"),
    [
        (made(disc_measured=np.zeros((N, 2))), "disc_measured x: flat; is the sensor connected?", False),
        (
            made(disc_measured=clipped(2e-6 * np.sin(300 * np.stack([T, T], 1)))),
            "disc_measured x: saturated at -1e-06 m?",
            False,
        ),
        (made(disc_measured=made()["disc_measured"].values * 1e6), "um or mm", True),
        (made(disc_measured=made()["disc_measured"].values * 1e-6), "is small for a displacement of a rotor", True),
        (made(pressure=np.full(N, 3.0)), "perhaps bar or MPa taken for Pa", True),
        (made(pressure=np.full(N, 3e8)), "large for a supply pressure; perhaps Pa or kPa taken for MPa or GPa", True),
        (made(reference=made()["reference"].values * 1e4), "perhaps mV taken for V", True),
        (made(speed=np.full(N, 100 * 30 / np.pi)), "the speed seems to be in rpm", True),
        (made(speed=np.full(N, 100 / 2 / np.pi)), "the speed seems to be in Hz", True),
        (made(angle=np.degrees(100 * T)), "the angle seems to be in deg", True),
        (made(angle=150 * T), "turns 1.5 times as fast as the speed signal; check both units", False),
        (made(angle=(100 * T) % (2 * np.pi)), "if it wraps, unwrap it", True),
        (made(time=T * 1000, angle=None), "5 samples a second; perhaps ms or us taken for s", True),
    ],
)
def test_odd_values_are_suspected_but_never_changed(record, warning, doubted):
    before, found = record.copy(deep=True), idn.examine(record)
    assert any(warning in text for text in found.warnings), found.warnings
    assert any(warning in text for text in found.doubts) is doubted and found.usable is not doubted
    assert record.identical(before)


@pytest.mark.parametrize(
    ("change", "size", "likely"),
    [
        ({"reference": 300.0}, "large for an actuator voltage", "perhaps mV taken for V"),
        ({"pressure": 4e6}, "large for a supply pressure", "perhaps bar or psi taken for MPa"),
        ({"speed": 90000 * np.pi / 30, "angle": None}, "large for a shaft speed", "perhaps rpm taken for Hz or rad/s"),
        ({"disc_measured": 4e-8}, "small for a displacement of a rotor", "perhaps um taken for nm"),
        ({"disc_measured": 4e-3}, "large for a displacement of a rotor", "perhaps um taken for mm or mil"),
    ],
)
def test_values_that_few_rigs_have_are_warned_of_and_still_fit(change, size, likely):
    name, largest = next(iter(change.items()))
    two = np.stack([np.sin(300 * T), np.cos(300 * T)], 1) if name in ("reference", "disc_measured") else np.ones(N)
    found = idn.examine(made(**{name: two * largest / np.abs(two).max()}, **dict(list(change.items())[1:])))
    assert len(found.warnings) == 1 and size in found.warnings[0] and likely in found.warnings[0]
    assert found.usable and not found.doubts


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e6])
def test_identification_refuses_what_the_examination_doubts_and_no_more(scale):
    record = made(disc_measured=made()["disc_measured"].values * scale)
    found = idn.examine(record)
    assert found.usable is (scale < 1e6)
    if found.usable:
        check_record(record, 2e-4)
    else:
        with pytest.raises(idn.UnfitError, match="um or mm"):
            check_record(record, 2e-4)


@pytest.mark.parametrize("name", ["disc_measured", "reference", "pressure", "speed"])
def test_usual_values_of_rigs_give_no_warning(name):
    usual = {"disc_measured": (2e-7, 5e-4), "reference": (0.05, 150.0), "pressure": (2e4, 1.6e6), "speed": (10.0, 6e3)}
    for largest in usual[name]:
        two = np.stack([np.sin(300 * T), np.cos(300 * T)], 1) if name in ("reference", "disc_measured") else np.ones(N)
        assert not idn.examine(made(**{name: two * largest}, angle=None)).warnings


def test_a_command_that_rests_at_its_limits_is_no_saturation():
    square = np.sign(np.sin(300 * np.stack([T, T], 1)) + 1e-9)
    assert not idn.examine(made(reference=square)).warnings


def test_vectors_are_examined_too(vectors):
    found = idn.examine(vectors)
    assert found.kind == "run-up vectors" and found.usable and found.uses["run-up analysis"] == ""
    assert [c.name for c in found.channels] == [f"{n} {k}X" for n in ("amplitude", "phase") for k in (1, 2, 3)]
    assert not idn.examine(vectors.isel(speed=[0, 0])).usable


@pytest.mark.parametrize("change", [{"reference": np.zeros((N, 2))}, {"speed": np.linspace(100.0, 300.0, N)}])
def test_what_identification_refuses_it_refuses_before_it_is_asked_for_a_model(change):
    record = made(**change)
    with pytest.raises(idn.UnfitError) as refused:
        idn.identify(record, model=1)
    assert refusal(record) == str(refused.value)


def test_channels_that_nothing_drives_are_no_faults():
    """Pins under a reference that rests, to rounding, and the angle of a shaft that does not turn."""
    pins = np.full((N, 4), 22.5e-6) * (1 + 1e-16 * np.arange(4))
    pins[N // 2 :, 2] = np.nextafter(pins[0, 2], 1)
    rest = {"speed": np.zeros(N), "angle": np.zeros(N), "reference": np.zeros((N, 2)), "pin": pins}
    assert not idn.examine(made(**rest)).warnings
    assert "turns 0 times" in idn.examine(made(**rest)).refused["runout filter"]
    driven = idn.examine(made(**rest | {"speed": np.full(N, 100.0), "reference": np.ones((N, 2)).cumsum(axis=0)}))
    assert sum("flat" in text for text in driven.warnings) == 5
