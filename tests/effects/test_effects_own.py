"""User-defined effects: registration, allocation-free compilation, examples of the docs."""

import importlib
import re
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from numba import typeof

from rotorsim.base.errors import DataError
from rotorsim.effects import REGISTRY, Effect, register
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.calls import load_module

SOURCE = '''
from dataclasses import dataclass

import numpy as np

from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register


@inlined
def own_push(t, angle, speed, acceleration, p):
    BODY


@register
@dataclass(frozen=True)
class OwnPush(Effect):
    """A constant push."""

    name = "own_push"
    port = "force"
    kernel = own_push
    force: float = param("N", bounds=(-1e3, 1e3), doc="Force along x.")
'''

LOOP = """
from reynolds.jit import kernel

@kernel
def run(w):
    total = 0.0
    start = 1
    for k in range(3):
        for at in range(1, 2):
            LINE
    return total
"""


@pytest.fixture
def own_machine(tmp_path, monkeypatch):
    """Return the builder of a plain rotor with an effect whose kernel has the body given."""
    monkeypatch.syspath_prepend(tmp_path)

    def build(body):
        (tmp_path / "own_push_effect.py").write_text(SOURCE.replace("BODY", body))
        sys.modules.pop("own_push_effect", None)
        importlib.invalidate_caches()
        importlib.import_module("own_push_effect")
        return load_machine("plain_rotor").replace("effects.own_push.force", "5 N")

    yield build
    REGISTRY.pop("own_push", None)
    sys.modules.pop("own_push_effect", None)


def test_a_users_own_effect_acts_like_the_force_it_describes(own_machine, held):
    """5 N of the effect against 5 N of disc force: same node, same instant, so the same motion but for round-off."""
    inputs = held(300, 150.0, 0.0)
    own = Plant(own_machine("return p.force, 0.0")).start(150.0).advance(inputs)
    inputs[:, 4] = 5.0
    pushed = Plant("plain_rotor").start(150.0).advance(inputs)
    assert np.ptp(pushed[:, 0]) > 1e-6
    assert own[:, :2] == pytest.approx(pushed[:, :2], abs=1e-15)


def test_values_do_not_change_the_kernels_but_source_does(own_machine):
    machine = own_machine("return p.force, 0.0")
    first = Plant(machine).assembly.module.__name__
    assert Plant(machine.replace("effects.own_push.force", "7 N")).assembly.module.__name__ == first
    assert Plant(own_machine("return 2.0 * p.force, 0.0")).assembly.module.__name__ != first


@pytest.mark.parametrize("body", ["return p.mass, 0.0", "return unknown(p.force), 0.0", "return 'x', 0.0"])
def test_a_kernel_that_does_not_compile_is_refused_with_its_effect(own_machine, body):
    with pytest.raises(DataError) as caught:
        Plant(own_machine(body)).start(150.0)
    assert (caught.value.argument, caught.value.value) == ("effects", "own_push") and "\n" not in str(caught.value)


@pytest.mark.parametrize("body", [
    "if p.force > 0.0:\n        raise ValueError\n    return p.force, 0.0",
    "if p.force > 0.0:\n        raise ValueError('too large')\n    return p.force, 0.0",
    "assert p.force < 0.0\n    return p.force, 0.0",
    "a, b = range(int(p.force))\n    return a, b",
])  # fmt: skip
def test_a_kernel_that_can_raise_is_refused(own_machine, held, body):
    """The step reads no status of what it calls by address: an error would be a force of zero."""
    with pytest.raises(DataError, match="own_push"):
        Plant(own_machine(body)).start(150.0).advance(held(5, 150.0, 0.0))


@pytest.mark.parametrize("read", ["w[-1]", "w[k - 1]", "w[2 + k - 4]", "w[k + -1]", "w[start - 2]"])
def test_an_index_below_the_start_of_an_array_is_refused(read):
    """Plain Python counts it from the end; machine code would read other memory, and write to it."""
    for line in (f"total += {read}", f"{read} = 1.0"):
        with pytest.raises(DataError, match="index"):
            loop(line).compile((typeof(np.zeros(9)),))


@pytest.mark.parametrize("read", ["w[k]", "w[k - 1 + 1]", "w[at - 1]", "w[k + start - 1]"])
def test_an_index_that_is_not_known_to_be_below_the_start_is_none_to_refuse(read):
    assert loop(f"total += {read}")(np.ones(9)) == 3.0


def loop(line):
    """A kernel that runs a line three times."""
    name = f"loop_{sha256(line.encode()).hexdigest()[:12]}"
    source = LOOP.replace("LINE", line)
    return load_module(name, lambda: source).run


@pytest.mark.parametrize("body", ["return np.full(2, p.force).sum(), 0.0", "return sum([p.force, 0.0]), 0.0"])
def test_a_kernel_that_allocates_does_not_compile(own_machine, held, body):
    """The whole step is compiled without numba's runtime: an array or a list is an error that names the kernel."""
    plant = Plant(own_machine(body))
    with pytest.raises(DataError, match="own_push"):
        plant.start(150.0).advance(held(2, 150.0, 0.0))


def test_the_refusal_of_a_call_that_numba_does_not_know_has_the_call(own_machine):
    """The compiler's first line ends before it; no line of it is cut off there."""
    with pytest.raises(DataError) as caught:
        Plant(own_machine("return np.full(2, p.force).sum(), 0.0")).start(150.0)
    assert "full(Literal[int](2), float64)" in str(caught.value) and ":;" not in str(caught.value)


def test_the_shipped_step_is_compiled_without_numbas_runtime(rig):
    module = rig().assembly.module
    for name in ("run", "step", "try_step", "solve_stage", "solve_film", "factorise", "settle", "serve"):
        options = getattr(module, name).targetoptions
        assert options["_nrt"] is False and options["nopython"] is True


DOCS = Path(__file__).parents[2] / "docs" / "machine_files.md"
KEPT = '''
from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register


@inlined
def own_mean(w, reading, state, seed, sample, p):
    for axis in range(2):
        w[state + axis] += p.share * (w[reading + axis] - w[state + axis])
        if p.share > 0.0:
            w[reading + axis] = w[state + axis]


@register
class OwnMean(Effect):
    """A running mean."""

    port, kernel, states = "sensor", own_mean, 2
    share: float = param("1", bounds=(0.0, 1.0), doc="Weight of the newest sample.")
'''


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """Return what imports a source as a module; its effects are forgotten afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = dict(REGISTRY)

    def load(name, source):
        (tmp_path / f"{name}.py").write_text(source)
        importlib.invalidate_caches()
        sys.modules.pop(name, None)
        importlib.import_module(name)

    yield load
    REGISTRY.clear()
    REGISTRY.update(before)


def test_the_name_of_another_effect_is_refused(own_module):
    """A subclass inherits its kernel, and with it the name of the effect that it would have replaced."""
    own_module("own_one", KEPT)
    mine = REGISTRY["own_mean"]
    own_module("own_one", KEPT)
    assert REGISTRY["own_mean"] is not mine
    with pytest.raises(ValueError, match=r"^effect own_mean: is the name of own_one\.OwnMean; give OwnMean another"):
        own_module("own_two", KEPT)
    unbalance = REGISTRY["unbalance"]
    with pytest.raises(ValueError, match=r"^effect unbalance: is the name of .*\.RotorUnbalance; give Heavier another"):
        register(type("Heavier", (unbalance,), {}))
    assert REGISTRY["unbalance"] is unbalance and REGISTRY["own_mean"].__module__ == "own_one"


@pytest.mark.parametrize(("field", "value"), [("port", "pull"), ("influence", "houzing")])
def test_a_port_or_an_influence_that_does_not_exist_is_refused(field, value):
    with pytest.raises(ValueError, match=f"^effect Bare: {field} '{value}' is none of "):
        register(type("Bare", (Effect,), {"name": "Bare", "port": "force", "kernel": print, field: value}))


@pytest.mark.parametrize(("part", "left"), [("kernel", {"port": "force"}), ("port", {"kernel": print})])
def test_a_class_without_kernel_or_port_is_refused(part, left):
    with pytest.raises(ValueError, match=f"^effect Bare: has no {part}; set it in the class, {part} = "):
        register(type("Bare", (Effect,), left))


@pytest.fixture
def documented(own_module):
    """The effects of the page on machine files, exactly as they stand there."""
    blocks = re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    (block,) = (text for text in blocks if "@register" in text)
    own_module("documented_effects", block)
    return block


def test_changes_of_a_machine_run_as_the_docs_have_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    (block,) = (text for text in blocks if "with_" in text)
    exec(block, {})
    assert load_machine(tmp_path / "wider.toml").film.clearance == 26e-6


def test_an_effect_of_the_docs_takes_under_forty_lines(documented):
    for kernel in documented.split("@inlined")[1:]:
        assert len(kernel.splitlines()) < 40


def test_the_seal_of_the_docs_drives_whirl_beyond_twice_the_critical_speed(documented, changed, held):
    """The force of half the shaft's swirl is c (Omega/2 - omega) forward, so it drives from 2 omega on.

    The rotor's own damping, some 5 N s/m next to 50, moves the threshold to 2.2: growth at 2.4, decay without swirl.
    """
    base = changed(load_machine("plain_rotor"), {"effects.unbalance.me": "0 g*mm"})
    omega = Plant(base).linearise().wn[0]
    decay = {}
    for swirl in (0.5, 0.0):
        plant = Plant(changed(base, {"effects.seal.damping": "50 N*s/m", "effects.seal.swirl": swirl}))
        rows = held(10000, 2.4 * omega, 0.0)
        rows[:5, 4] = 20.0
        table = plant.start(2.4 * omega).advance(rows)
        swing = [np.hypot(*np.ptp(part, axis=0)) for part in (table[1000:2000, :2], table[-1000:, :2])]
        decay[swirl] = swing[1] / swing[0]
    assert decay[0.0] < 0.6
    assert decay[0.5] > 1.0


@pytest.mark.slow
def test_a_groove_of_the_docs_lets_the_journal_sink(documented, rig):
    """2 um of wear under the journal and no more clearance elsewhere: it rests lower, by less than the wear."""
    places = [
        rig({"effects.groove.depth": depth}, n_theta=16).equilibrium(300.0, 0.5e6).journal[1]
        for depth in ("0 um", "2 um")
    ]
    assert -2e-6 < places[1] - places[0] < -2e-7


def test_states_of_an_own_sensor_are_its_own_and_begin_at_zero(own_module, held):
    """A running mean of a fifth next to the delay of a shipped effect, against the recursion in Python."""
    own_module("own_mean_effect", KEPT)
    machine = load_machine("plain_rotor").replace("effects.sensor_delay.delay", "1 ms")
    table = Plant(machine.replace("effects.own_mean.share", 0.2)).start(150.0).advance(held(300, 150.0, 0.0))
    true = table[:, 0]
    late = np.concatenate([np.full(5, true[0]), true[:-5]])
    mean = 0.0
    for value, read in zip(late, table[:, 12], strict=True):
        mean += 0.2 * (value - mean)
        assert read == pytest.approx(mean, abs=1e-15)
