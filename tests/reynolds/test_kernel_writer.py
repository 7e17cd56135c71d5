"""Kernels written from their syntax: the numbers of plain Python, to the last bit, and what is left to numba."""

import math
from itertools import count
from pathlib import Path

import numpy as np
import pytest

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


@pytest.mark.slow
def test_all_kernels_of_the_rig_are_plain(rig, held, left):
    """A kernel that is left to numba takes ten times as long to compile, without a word."""
    plant = rig(n_theta=20, n_z=4)  # of no other test
    plant.start(600.0, 0.5e6).advance(held(1, 600.0, 0.5e6))
    assert left == []
