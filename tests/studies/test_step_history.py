"""History of the step's speed: what a line holds, when a case counts as slower, and a reference that never changes."""

import pytest

from studies.benchmarks import step_history
from studies.benchmarks.reference_work import work, workspace

PROCESSOR = "a processor"
SENTENCE = "step: 1.20 of the reference, 1.20 times the fastest lately"


@pytest.fixture
def history(monkeypatch):
    """The script as a module, with little to measure."""
    module = step_history
    for name in ("SAMPLES", "PASSES", "ROUNDS"):
        monkeypatch.setattr(module, name, 2)
    return module


def a_line(ratio, commit, machine=PROCESSOR):
    """A line with one case."""
    return {"machine": machine, "commit": commit, "cases": {"step": {"us": 7.0, "ratio": ratio}}}


def test_every_line_has_the_fields_of_a_new_one(history, monkeypatch):
    monkeypatch.setattr(history, "cases", lambda: [("step", lambda: sum(range(1000)))])
    monkeypatch.setattr(history, "_commit", lambda: ("2020-01-01", "abc1234"))
    new, lines = history.line(), history.read()
    assert len(lines) >= 3 and new["machine"]
    for line in (*lines, new):
        assert set(line) == {"date", "commit", "machine", "numba", "cases"}
        assert all(set(case) == {"us", "ratio"} and min(case.values()) > 0 for case in line["cases"].values())


def test_a_case_is_compared_with_the_fastest_of_its_processors_last_lines(history):
    before = [a_line(1.0, f"c{k}") for k in range(5)]
    assert history.slower(a_line(1.1, "new"), before) == {}
    assert history.slower(a_line(1.2, "new"), before) == {"step": SENTENCE}
    assert history.slower(a_line(1.2, "new", "another"), before) == {}
    assert history.slower(a_line(1.2, "new"), before + [a_line(1.2, f"d{k}") for k in range(3)]) == {}


def test_a_line_names_the_vectors_that_its_code_fills(history, monkeypatch):
    """A kind of processor that is named without its features keeps those of the computer."""
    own = history.vector_bits()
    monkeypatch.setattr(history.numba.config, "CPU_NAME", "x86-64-v3")
    assert history.processor().endswith(f"(x86-64-v3, {own} bits)")


@pytest.mark.parametrize(("machine", "ratio", "code"), [(PROCESSOR, 1.0, 0), (PROCESSOR, 1.2, 1), ("another", 1.0, 3)])
def test_the_check_ends_with_a_code_of_its_own_where_it_has_nothing_to_compare_with(
    history, monkeypatch, machine, ratio, code
):
    monkeypatch.setattr(history, "line", lambda: a_line(ratio, "new", machine))
    monkeypatch.setattr(history, "read", lambda: [a_line(1.0, "old")])
    monkeypatch.setattr("sys.argv", ["step_history.py", "--check"])
    assert history.main() == code


def test_the_references_arithmetic_never_changes():
    """Values of its first day; another reference needs another history."""
    w = workspace()
    assert w.size == 21680
    assert work(w, 1) == pytest.approx(264.1133118281633, rel=1e-12)
    assert work(w, 9) == pytest.approx(263.73438262825175, rel=1e-12)
