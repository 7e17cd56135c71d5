"""A user's own effect: registered in a module of its own, compiled without allocation, part of the module's name."""

import importlib
import sys

import numpy as np
import pytest
from numba.core.errors import NumbaError

from rotorsim.effects import REGISTRY
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

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


@pytest.mark.parametrize("body", ["return np.full(2, p.force).sum(), 0.0", "return sum([p.force, 0.0]), 0.0"])
def test_a_kernel_that_allocates_does_not_compile(own_machine, held, body):
    """The whole step is compiled without numba's runtime: an array or a list is an error that names the kernel."""
    run = Plant(own_machine(body)).start(150.0)
    with pytest.raises(NumbaError, match="own_push"):
        run.advance(held(2, 150.0, 0.0))


def test_the_shipped_step_is_compiled_without_numbas_runtime(rig):
    module = rig().assembly.module
    for name in ("run", "step", "try_step", "solve_stage", "solve_film", "factorise", "pseudo_step"):
        options = getattr(module, name).targetoptions
        assert options["_nrt"] is False and options["nopython"] is True
