"""Kernels written from their syntax: the numbers of plain Python, to the last bit, and what is left to numba."""

import math
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import NumbaError

from reynolds.kernel_writer import UnwrittenError, definition
from rotorsim.plant.calls import load_module

HEAD = "import math\nimport numpy as np\nfrom reynolds.jit import kernel, part\nSIZES = (3, 5)\nLOW = -0.5\n"
PLAIN = {
    "sums": "x = 0.0\nfor k in range(len(w)):\n    x += w[k] * (k + 1) - w[k] / 3\nreturn x",
    "an integer that becomes a float": "x = 1\nfor k in range(3):\n    x = x + 0.5\nreturn x / 2",
    "tuples": "a, b = w[0], w[1]\na, b = b, a\nc = (a, (b, 2))\n(d, e), f = (c[1], 1.0)\n"
    "return a - b + c[0] + d + e + f",
    "powers": "return w[0] ** 3 + w[1] ** 2 - abs(w[2]) ** 0.5 + SIZES[1] ** 2",
    "choices": "return (w[0] if w[0] > w[1] else 2) + max(w[0], 1, w[2]) - min(w[1], LOW)",
    "conditions": "n = 0\nfor k in range(len(w)):\n    if 0.0 < w[k] < 1.0 or (not w[k] > 0.0 and k != 2):\n"
    "        n += 1\nreturn n",
    "steps": "n, step = 0, len(w) - 4\nfor k in range(4, -1, -2):\n    for i in range(0, 9, step):\n        n += i\n"
    "return n",
    "ends of loops": "k = 0\nwhile True:\n    k += 1\n    if k == 3:\n        continue\n    w[k] = k\n"
    "    if k > 4:\n        break\nreturn w[4] + k",
    "a loop over numbers": "x = 0.0\nfor k in (2, 0, SIZES[0]):\n    x = 2.0 * x + w[k]\nreturn x",
    "division of integers": "k = len(w)\nreturn (k - 9) // 4 + (k - 9) % 4 + k / 4 + (7.5 % 2.0) + -k",
    "functions": "return math.exp(w[0]) + math.atan2(w[1], w[2]) + math.pi + float(len(SIZES)) + int(w[0] * 9.0)",
    "nothing": "w[0] = w[1]\nif w[0] > 1e9:\n    return",
    "a slice": "v = w[2:]\nu = w[1:3]\nreturn v[0] + u[1] + len(u)",
    "an end that is not reached": "while True:\n    if w[0] < 1e9:\n        return 1\n    w[0] += 1.0",
}
_numbers = count()


def module(body: str, more: str = ""):
    """A module with a kernel of this body."""
    lines = "".join(f"    {line}\n" for line in body.split("\n"))
    text = f"{HEAD}{more}\n@kernel\ndef run(w):\n{lines}"
    return load_module(f"written_{next(_numbers)}_of_a_test", lambda: text)


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))


@pytest.fixture
def left(monkeypatch):
    """Kernels that are left to numba, with the reason."""
    from reynolds import compiler

    found, write = [], compiler.PlainLowering._write

    def noted(self, state):
        try:
            write(self, state)
        except Exception as error:
            found.append((state.func_id.func_name, str(error)))
            raise

    monkeypatch.setattr(compiler.PlainLowering, "_write", noted)
    return found


@pytest.mark.parametrize("body", PLAIN.values(), ids=PLAIN)
def test_plain_kernels_have_the_numbers_of_python(left, body):
    run = module(body).run
    one = np.array([0.7, -1.3, 0.2, 3.1, -0.4, 1e-3])
    other = one.copy()
    result, expected = run(one), run.py_func(other)
    assert left == [] and np.array_equal(one, other)
    assert result == expected and isinstance(expected, type(result))


def test_comparisons_with_what_is_no_number_are_those_of_python(left):
    run = module("return (w[0] < 1.0, w[0] != w[0], w[0] == w[0], not w[0] >= 0.0)").run
    assert run(np.array([math.nan])) == (False, True, False, True) and left == []


def test_other_kernels_are_compiled_by_numba(left):
    more = "@part(False)\ndef shifted(x, by=1.0):\n    return x + by\n"
    run = module("a = shifted(w[0])\nreturn a if w[1] and w[2] else 0.0", more).run
    assert run(np.ones(3)) == 2.0
    assert {name for name, _ in left} == {"run", "shifted"}


def test_a_file_that_changed_since_its_import_is_not_read(left):
    """Code is what the process has, and not what an editor wrote into the file since."""
    found = module("return w[0] + 1.0")
    assert definition(found.run.py_func).name == "run"
    changed = module("return w[0] + 2.0")
    path = Path(changed.__file__)
    path.write_text(path.read_text(encoding="utf-8").replace("2.0", "3.0"), encoding="utf-8")
    with pytest.raises(UnwrittenError, match="source"):
        definition(changed.run.py_func)
    assert changed.run(np.ones(1)) == 3.0 and left


@pytest.mark.parametrize("more", [
    "@part(False)\ndef by(x):\n    return x + 1.0\none = by\n@part(False)\ndef by(x):\n    return x + 100.0\n",
    "if LOW < 0.0:\n    @part(False)\n    def one(x):\n        return x + 1.0\n"
    "else:\n    @part(False)\n    def one(x):\n        return x + 100.0\n",
    "if LOW < 0.0:\n    @part(False)\n    def one(x):\n        return x + 1.0\nif LOW > 0.0:\n"
    "    @part(\n        False\n    )\n    def one(x):\n        return x + 100.0\n",
], ids=["again", "else", "decorator of three lines"])  # fmt: skip
def test_a_name_that_is_defined_twice_is_the_function_that_python_has(left, more):
    run = module("return one(w[0])", more).run
    assert run(np.ones(1)) == 2.0 and left == []


@pytest.mark.parametrize("line", ["w[0] = 9.0", "w[0] += 9.0", "w[0], a = 9.0, 1.0"])
def test_an_array_that_is_not_writeable_is_not_written(line):
    run, fixed = module(f"{line}\nreturn w[0]").run, np.ones(2)
    assert run(np.ones(2)) in (9.0, 10.0)
    fixed.flags.writeable = False
    with pytest.raises(NumbaError):
        run(fixed)
    assert fixed[0] == 1.0


TO_NUMBA = "s = 1.0 if w[0] and w[1] else 0.0\n"
"""A statement that the writer leaves to numba."""


@pytest.mark.parametrize("before", ["", TO_NUMBA], ids=["written", "numba's"])
@pytest.mark.parametrize("body", [
    "k = int(w[0])\nreturn w[k]", "k = int(w[0])\nw[k] += 1.0\nreturn w[len(w) + k]",
    "x = 0.0\nfor k in range(-2, 3):\n    if w[0] < 9.0:\n        x = 2.0 * x + w[k]\nreturn x",
    "x = 0.0\nfor k in range(2, -3, -1):\n    x = 2.0 * x + w[k]\nreturn x",
])  # fmt: skip
def test_an_index_below_zero_counts_from_the_end_whoever_compiles(left, before, body):
    """Memory around the array has other numbers."""
    run, around = module(before + body).run, np.full(12, 1e9)
    one, other = around[4:8], np.array([-1.0, 2.0, 3.0, 5.0])
    one[:] = other
    assert run(one) == run.py_func(other) and np.array_equal(one, other)
    assert bool(left) == bool(before) and set(around[:4]) == set(around[8:]) == {1e9}


def test_each_axis_counts_from_its_own_end(left):
    run = module("k = int(w[0, 0])\nw[k, k - 1] = 9.0\nreturn w[1, k] + w[k - 1, 2]").run
    one = np.arange(6.0).reshape(2, 3) - 1.0
    other = one.copy()
    assert run(one) == run.py_func(other) and np.array_equal(one, other) and left == []


GUARDED = {
    "if": "for k in range(len(w)):\n    if k > 0:\n        x += w[k - 1]",
    "else": "for k in range(len(w)):\n    if k == 0:\n        x += 1.0\n    else:\n        x += w[k - 1]",
    "continue": "for k in range(len(w)):\n    if k == 0:\n        continue\n    x += w[k - 1]",
    "one of two": "for k in range(len(w)):\n    x += w[k - 1] if k > 0 else 0.5",
    "and": "for k in range(len(w)):\n    if k > 0 and w[k - 1] > 1.0:\n        x += 1.0",
    "an inner loop": "for k in range(len(w)):\n    for i in range(k):\n        x += w[k - 1] * w[i]",
    "while": "for k in range(3):\n    i = 0\n    while k > 0 and i < 1:\n        x += w[k - 1]\n        i += 1",
    "another variable": "for k in range(len(w)):\n    if k > 0:\n        j = k - 1\n        x += w[j]",
    "a constant": "if SIZES[0] > 3:\n    x += w[SIZES[0] - 4]",
}


@pytest.mark.parametrize("body", GUARDED.values(), ids=GUARDED)
def test_indices_that_a_condition_keeps_from_below_zero_are_taken(left, body):
    run = module(f"x = 0.0\n{body}\nreturn x").run
    w = np.array([0.7, 1.3, 0.2, 3.1])
    assert run(w) == run.py_func(w.copy()) and left == []


def test_an_argument_that_is_set_below_zero_is_not_always_that(left):
    more = "@part(False)\ndef at(w, k):\n    if k > 2:\n        k = -1\n    return w[k] if k >= 0 else 0.5\n"
    run = module("return at(w, 1) + at(w, 3)", more).run
    assert run(np.array([1.0, 2.0, 4.0, 8.0])) == 2.5 and left == []


def test_operators_that_numbers_do_not_have_are_left_to_numba(left):
    run = module("return w @ w").run
    assert run(np.array([1.0, 2.0])) == 5.0 and {name for name, _ in left} == {"run"}
    for body in ("w @= w", "a = -'a'", "a = len(w) @ 2"):
        with pytest.raises(NumbaError):
            module(f"{body}\nreturn w[0]").run(np.ones(2))


@pytest.mark.slow
def test_all_kernels_of_the_rig_are_plain(rig, held, left):
    """A kernel that is left to numba takes ten times as long to compile, without a word."""
    plant = rig(n_theta=20, n_z=4)  # of no other test
    plant.start(600.0, 0.5e6).advance(held(1, 600.0, 0.5e6))
    assert left == []
