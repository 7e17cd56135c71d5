"""Run-time law against its equation in plain numpy; JSON file, limits, refusals."""

import numpy as np
import pytest

from refusals import refused
from rotorsim.control import Law, LawError, load_law
from rotorsim.machine import load_machine
from rotorsim.plant.controller import prepare


def law_of(seed=0, s=3, p=2, n=4, **settings):
    rng = np.random.default_rng(seed)
    shapes = {"A": (n, n), "B": (n, 2), "C": (2, n), "D": (2, 2), "W": (n, 2)}
    matrices = {name: 0.2 * rng.normal(size=(s, p, *shape)) for name, shape in shapes.items()}
    return Law("test", **matrices, speeds=np.linspace(0, 600, s), pressures=np.linspace(3e5, 7e5, p), **settings)


def test_a_sample_is_the_equation_of_the_interpolated_matrices():
    law, rng = law_of(), np.random.default_rng(1)
    law.reset()
    x = np.zeros(4)
    for _ in range(50):
        y, speed, pressure = rng.normal(size=2), rng.uniform(0, 600), rng.uniform(3e5, 7e5)
        A, B, C, D = law.at(speed, pressure)
        np.testing.assert_allclose(law.step(y, speed, pressure), C @ x + D @ y, rtol=1e-12, atol=1e-14)
        x = A @ x + B @ y


def test_interpolation_is_bilinear_and_holds_beyond_the_table():
    law = law_of()
    for name, value in zip("ABCD", law.at(150.0, 5e5), strict=True):
        table = getattr(law, name)
        np.testing.assert_allclose(value, table[:2].mean(axis=(0, 1)), rtol=1e-12)
    for name, value in zip("ABCD", law.at(9e9, -1.0), strict=True):
        np.testing.assert_array_equal(value, getattr(law, name)[-1, 0])


def test_a_saved_law_comes_back_bit_for_bit(tmp_path):
    law = law_of(bias=(0.25, -0.1), centre=(1e-6, -2e-6), refresh=7, gamma=1.5, about={"design": "test"})
    law.save(tmp_path / "law.json")
    again = load_law(tmp_path / "law.json")
    assert again.to_dict() == law.to_dict()
    assert again.hash == law.hash


def test_the_output_stays_within_the_limit_and_anti_windup_shortens_the_way_back():
    eye = np.eye(2)
    integrator = {"A": eye, "B": 0.5 * eye, "C": eye, "D": 0 * eye}
    back = {}
    for name, W in (("with", 0.5 * eye), ("without", 0 * eye)):
        parts = {key: value[None, None] for key, value in (integrator | {"W": W}).items()}
        law = Law(name, **parts, speeds=[0.0], pressures=[0.0])
        law.reset()
        outputs = [law.step([1.0, -1.0], 0, 0) for _ in range(200)]
        assert np.abs(outputs).max() == law.limit
        after = [law.step([-1.0, 1.0], 0, 0) for _ in range(400)]
        back[name] = int(np.argmax(np.abs(after)[:, 0] < law.limit))
    assert back["with"] < 5 < 100 < back["without"]


def test_switching_on_gives_no_jump_whatever_the_position():
    law = law_of(average=0.02, fade=0.02, start=0.01)
    law.reset()
    position = np.array([8e-6, -13e-6])
    outputs = np.array([law.step(position, 100.0, 4e5) for _ in range(400)])
    np.testing.assert_allclose(outputs, 0.0, atol=1e-15)
    biased = law.with_(bias=(1.0, 0.5))
    biased.reset()
    outputs = np.array([biased.step(position, 100.0, 4e5) for _ in range(400)])
    assert np.abs(np.diff(outputs, axis=0)).max() < 1.5 / 100
    np.testing.assert_allclose(outputs[-1], (1.0, 0.5), rtol=1e-12)


def test_the_memory_saves_and_restores_a_running_law():
    law, rng = law_of(average=0.001), np.random.default_rng(2)
    law.reset()
    ys = rng.normal(size=(40, 2)) * 1e-6
    for y in ys[:20]:
        law.step(y, 100.0, 4e5)
    saved = law.memory.copy()
    first = [law.step(y, 100.0, 4e5) for y in ys[20:]]
    law.memory[:] = saved
    np.testing.assert_array_equal([law.step(y, 100.0, 4e5) for y in ys[20:]], first)


def test_a_law_for_another_sampling_time_is_refused_when_it_is_to_run():
    with refused(LawError, "Ts", 1e-3):
        prepare(law_of(Ts=1e-3), load_machine("dtu_gas_bearing"))
    slower = load_machine("dtu_gas_bearing").replace("solver.sampling_rate", "1 kHz")
    prepare(law_of(Ts=1e-3), slower)


def test_a_law_for_other_channels_is_refused():
    with refused(LawError, "channels", (3, 2)):
        Law("three", np.zeros((1, 1, 1, 1)), np.zeros((1, 1, 1, 3)), np.zeros((1, 1, 2, 1)), np.zeros((1, 1, 2, 3)),
            np.zeros((1, 1, 1, 2)), [0.0], [0.0])  # fmt: skip
    with pytest.raises(LawError, match="measured has 3 channels"):
        law_of().step([0.0, 0.0, 0.0], 0.0, 3e5)


@pytest.mark.parametrize("text", ["", "{}", '{"kind": "lpv"}', '{"kind": "law", "name": "x"}', "[1]"])
def test_a_file_that_is_no_law_is_refused_in_one_sentence(text, tmp_path):
    path = tmp_path / "law.json"
    path.write_text(text)
    with pytest.raises(LawError, match=r"not a law"):
        load_law(path)


def test_a_law_keeps_the_machine_of_its_model_however_it_is_designed(model):
    from dataclasses import replace

    from rotorsim.control import design, lqr

    named = replace(model, machine="rig 1234")
    assert lqr.design(named).about["machine"] == design("lqr", named).about["machine"] == "rig 1234"
    assert "machine" not in lqr.design(model).about
