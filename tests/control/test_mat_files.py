"""Models and laws as MATLAB files: round trips bit for bit, files of other programs, bad files."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat

import rotorsim as rs
from rotorsim.base.errors import LawError, ModelError
from rotorsim.control.designs import lqr

RIG = Path(__file__).parent / "rig_model.json"


@pytest.fixture(scope="module")
def lpv():
    return rs.load_model(RIG)


@pytest.fixture(scope="module")
def law(lpv):
    return lqr.design(lpv)


def test_a_parameter_varying_model_comes_back_bit_for_bit(lpv, tmp_path):
    lpv.save(tmp_path / "lpv.mat")
    back = rs.load_model(tmp_path / "lpv.mat")
    assert back.to_dict() == lpv.to_dict()


def test_a_linear_model_comes_back_bit_for_bit_and_names_its_signals(lpv, tmp_path):
    model = lpv.at(300.0, 5e5)
    model.save(tmp_path / "model.mat")
    raw = loadmat(tmp_path / "model.mat")
    assert [str(one[0]) for one in raw["InputName"][0]] == ["reference_x", "reference_y"]
    assert rs.load_model(tmp_path / "model.mat").to_dict() == model.to_dict()


def test_models_keep_the_machine_that_they_are_of(lpv, tmp_path):
    """The name of a linear one was lost, and with it the warning on another machine."""
    for model in (replace(lpv, machine="my_rig 0123"), replace(lpv.at(300.0, 5e5), machine="my_rig 0123")):
        model.save(tmp_path / "model.mat")
        back = rs.load_model(tmp_path / "model.mat")
        assert back.machine == "my_rig 0123" and back.to_dict() == model.to_dict()
        assert lqr.design(back, lqr.Spec(300.0, 5e5)).about["machine"] == "my_rig 0123"


def test_a_machine_that_is_no_text_is_refused(tmp_path):
    savemat(tmp_path / "mine.mat", GOOD | {"machine": 3.0})
    with pytest.raises(ModelError, match="machine is not a text"):
        rs.load_model(tmp_path / "mine.mat")


def test_the_frozen_models_lie_along_the_third_dimension(lpv, tmp_path):
    lpv.save(tmp_path / "lpv.mat")
    raw = loadmat(tmp_path / "lpv.mat")
    for k, point in enumerate(lpv.points):
        np.testing.assert_array_equal(raw["A"][..., k], lpv.at(*point).A)


def test_a_law_comes_back_bit_for_bit(law, tmp_path):
    law.save(tmp_path / "law.mat")
    back = rs.load_law(tmp_path / "law.mat")
    assert back.hash == law.hash and back.to_dict() == law.to_dict()


def test_a_scheduled_law_comes_back_bit_for_bit(law, tmp_path):
    rng = np.random.default_rng(0)
    tables = {name: rng.normal(size=(3, 2, *getattr(law, name).shape[2:])) for name in ("A", "B", "C", "D", "W")}
    scheduled = law.with_(
        **tables, speeds=np.array([0.0, 1.0, 2.0]), pressures=np.array([1.0, 2.0]), centre=(1e-6, 2e-6)
    )
    scheduled.save(tmp_path / "law.mat")
    assert rs.load_law(tmp_path / "law.mat").to_dict() == scheduled.to_dict()
    assert loadmat(tmp_path / "law.mat")["A"].shape == (law.order, law.order, 3, 2)


def test_matrices_and_a_sampling_time_are_enough(tmp_path):
    A, B, C, D = 0.5 * np.eye(3), np.ones((3, 2)), np.ones((2, 3)), np.zeros((2, 2))
    savemat(tmp_path / "mine.mat", {"A": A, "B": B, "C": C, "D": D, "Ts": 2e-4})
    law, model = rs.load_law(tmp_path / "mine.mat"), rs.load_model(tmp_path / "mine.mat")
    assert law.name == "mine" and law.order == 3 and law.Ts == 2e-4 and not law.scheduled
    assert (law.average, law.fade) == (0.2, 0.05), "as Law.from_control"
    assert model.outputs == ("disc_x", "disc_y") and np.isnan(model.speed)
    savemat(tmp_path / "gain.mat", {"A": np.zeros((0, 0)), "B": np.zeros((0, 2)), "C": np.zeros((2, 0)), "D": np.eye(2),
                                    "Ts": 2e-4})  # fmt: skip
    assert rs.load_law(tmp_path / "gain.mat").order == 0


GOOD = {"A": 0.5 * np.eye(2), "B": np.eye(2), "C": np.eye(2), "D": np.zeros((2, 2)), "Ts": 2e-4}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"A": None}, r"holds no matrix A; save it in MATLAB by \[A, B, C, D, Ts\] = ssdata\(sys\)"),
        ({"A": "text"}, "holds no matrix A"),
        ({"Ts": 0.0}, r"is continuous, Ts = 0; sample it in MATLAB: sys = c2d\(sys, 0\.0002, 'tustin'\)"),
        ({"Ts": None}, r"holds no Ts; save Ts too \(0 for continuous\)"),
        ({"Ts": np.ones(3)}, "Ts is not a number"),
        ({"B": np.ones((2, 1)), "D": np.ones((2, 1))}, "1 measured and 2 driven channels"),
        ({"C": np.ones((2, 5))}, "C has shape"),
        ({"D": np.full((2, 2), np.nan)}, "D holds NaN"),
        ({"kind": "linear"}, "is a linear model; give a control law"),
    ],
)
def test_a_file_that_is_no_law_is_refused_with_its_name(change, sentence, tmp_path):
    content = {name: value for name, value in (GOOD | change).items() if value is not None}
    savemat(tmp_path / "bad.mat", content)
    with pytest.raises(LawError, match=sentence) as found:
        rs.load_law(tmp_path / "bad.mat")
    assert str(found.value).startswith(str(tmp_path / "bad.mat")) and "\n" not in str(found.value)


def test_a_file_that_is_no_model_is_refused_with_its_name(tmp_path):
    savemat(tmp_path / "bad.mat", GOOD | {"C": np.ones((2, 5))})
    with pytest.raises(ModelError, match=r"bad\.mat: A .* do not fit together"):
        rs.load_model(tmp_path / "bad.mat")
    savemat(tmp_path / "bad.mat", {name: GOOD[name] for name in "ABCD"})
    with pytest.raises(ModelError, match=r"bad\.mat: holds no Ts; save Ts too \(0 for continuous\)"):
        rs.load_model(tmp_path / "bad.mat")
    (tmp_path / "empty.mat").write_bytes(b"")
    shutil.copy(RIG, tmp_path / "json.mat")
    for name in ("empty.mat", "json.mat"):
        with pytest.raises(ModelError, match=f"{name}: cannot be read as a MATLAB file"):
            rs.load_model(tmp_path / name)
    with pytest.raises(ModelError, match="is not there"):
        rs.load_model(tmp_path / "none.mat")
