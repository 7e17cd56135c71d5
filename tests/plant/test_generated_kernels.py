"""Kernels with their sizes written as numbers: the same arithmetic, decided branches left out."""

import inspect
import sys
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from numba import typeof
from numba.core.errors import NumbaError

import reynolds
from reynolds import kernels
from reynolds.jit import inlined
from rotorsim.plant import compose
from rotorsim.plant.calls import CALLS, load_module
from rotorsim.plant.compose import ENTRIES
from rotorsim.plant.kernels.effect_calls import PortFunction, film_shape

Sizes = namedtuple("Sizes", "n first wide")
FACTOR = 3.0
CALL = """
from reynolds.addressed_calls import answer_1
from reynolds.jit import kernel

@kernel
def run(w, P):
    return answer_1(P, 0, {sample}, {given})
"""


@inlined
def scaled(w, L, k):
    """Scaled value."""
    if L.wide == 1 and w[k] > 0.0:
        return FACTOR * w[L.first + L.n // 2 + k]
    return w[L.first - L.n + k] if L.n > 4 else 0.0


@inlined
def total(w, L):
    """Sum of the scaled values."""
    result = 0.0
    for k in range(L.n):
        if L.wide == 0:
            result += 1.0
        result += scaled(w, L, k)
    return result


def source(**values):
    """Text of a module of the functions above, without its import lines."""
    functions = [f for g in (scaled, total) for f in compose.kernel_functions(inspect.getsource(g.py_func))]
    module = inspect.getmodule(scaled.py_func)
    return compose.write_module(functions, {"L": Sizes(**values)}, [module], {"total": "kernel"})


def test_fields_are_numbers_and_known_branches_are_gone():
    text = source(n=4, first=10, wide=0)
    assert "L" not in text.replace("NLL", "") and "if" not in text.split("def total")[0].split("def scaled")[1]
    assert "return 0.0" in text and "range(4)" in text and "FACTOR" not in text
    wide = source(n=6, first=10, wide=1)
    assert "if w[k] > 0.0" in wide and "w[13 + k]" in wide and "w[4 + k]" in wide and "+= 1.0" not in wide
    assert f"from {__name__} import FACTOR" in wide


def test_entries_are_kernels_and_the_rest_are_parts():
    text = source(n=4, first=10, wide=1)
    assert "@part(True)\ndef scaled(w, k):" in text and "@kernel\ndef total(w):" in text


def test_a_name_without_a_meaning_is_an_error():
    functions = compose.kernel_functions("@inlined\ndef f(w):\n    return w[0] * NOWHERE\n")
    with pytest.raises(NameError, match="'NOWHERE' has no meaning"):
        compose.write_module(functions, {}, [reynolds], {})


def test_the_film_of_a_plant_gives_the_bits_of_the_film_alone(rig):
    """Factorisation and Newton's method on one state: sizes as arguments against sizes as numbers."""
    plant = rig()
    a = plant.assembly
    one = plant.start(600.0, 0.5e6).w.copy()
    other = one.copy()
    film = a.module.newton
    U, iadt = 600.0 * a.P.film_0.radius, 1.0 / 2e-5
    one[a.film.journal] = other[a.film.journal] = 5e-6
    kernels.factorise(one, a.ix, a.P.film_0, a.film, U, iadt)
    assert kernels.iterate(one, a.ix, a.P.film_0, a.film, U, iadt, 1e-6, 20, False) > 0
    a.module.refresh(other, a.ix, a.P.film_0, U, iadt)
    assert film(other, a.ix, a.P.film_0, U, iadt, 1e-6, 20, False) > 0
    assert np.array_equal(one, other) and not np.array_equal(one[: a.film.size], a.w[: a.film.size])


@pytest.mark.parametrize("path, value", [
    ("effects.crack.loss", "1 kN/m"), ("effects.supply_droop.droop", "50 MPa*s/kg"),
    ("effects.internal_damping.time", "1 us"), ("effects.broadband_force.density", "1 N^2/Hz"),
    ("effects.out_of_round.sleeve", "0.1 um"), ("effects.heat_balance.friction_share", 0.1),
    ("effects.weak_injector.0.blocked", 0.1), ("effects.dead_zone.half_width", "0.1 um"),
    ("effects.sensor_ring", {}), ("effects.speed_wander", {}), ("effects.torque_ripple", {}),
])  # fmt: skip
def test_one_more_effect_needs_no_other_kernels(rig, path, value):
    """Machine code of film and step stays the same for a port that the rig does not use, and for one that it uses."""
    first, second = rig().assembly, rig({path: value}).assembly
    assert len(second.calls) == len(first.calls) + 1 and first.module.__name__ != second.module.__name__
    for name in (*ENTRIES, "newton", "refresh", "step"):
        assert getattr(first.module, name) is getattr(second.module, name)
    assert typeof(first.parameters) == typeof(second.parameters)


def test_the_step_calls_effects_by_address_and_has_them_where_it_leaves_the_process(rig, monkeypatch):
    """That both give the same bits is tested with the units."""
    a, texts = rig().assembly, {}
    looped = Path(sys.modules[a.module.run.__module__].__file__).read_text(encoding="utf-8")
    monkeypatch.setattr(compose, "calls_addresses", lambda: False)
    monkeypatch.setattr(compose, "load_module", lambda name, write: texts.update({name: write()}))
    compose.compose(a.film, a.rotor, a.rig, a.calls)
    [merged] = (text for name, text in texts.items() if "machine" in name)
    assert "answer_" not in merged and "unbalance_0_kernel(t, angle, speed, acceleration, P.unbalance_0)" in merged
    assert (
        "answer_2(P, call, (0.0, 0.0, 0.0, 0.0), (t, angle, speed, acceleration))" in looped
        and "unbalance" not in looped
    )


@pytest.mark.parametrize("given", ["(1.0, 1.0)", "(1, 1)", "(w, 1.0)", "(1,)", "(1, 1.0, 1.0)"])
def test_a_call_by_address_of_other_types_than_the_functions_does_not_compile(tmp_path, monkeypatch, given):
    """The function is compiled for an integer and a float; its address alone would take anything."""
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    name = f"wrong_call_{abs(hash(given))}"
    source = CALL.format(sample="(0, 0.0)", given=given)
    module = load_module(name, lambda: source)
    with pytest.raises(NumbaError, match="the function takes"):
        module.run.compile((typeof(np.zeros(1)), typeof(np.zeros(1, [("one", "f8")]).view(np.recarray)[0])))


def test_a_line_whose_argument_is_not_of_the_kind_that_its_name_says_is_compared():
    """In the source of the loop the kinds of the compiled function stand next to what the line gives it."""
    line = "a, b = {kernel}(w, k, k + 1, RIG.heat, x, {p})"
    function = PortFunction(film_shape.py_func, "film", (line,))
    assert function.kinds == "wiiid" and "answer_2(P, call, (w, 0, 0, 0, 0.0), (w, k, k + 1, RIG.heat, x))" in (
        function.write_loop(0)
    )


def test_numbers_without_the_addresses_of_kernels_are_none_to_run_with(rig):
    a = rig().assembly
    assert a.parameters is not None and a.with_numbers(a.record.copy(), a.w)
    bare = a.record.copy()
    bare[CALLS] = 0
    with pytest.raises(AssertionError):
        a.with_numbers(bare, a.w)


def test_a_generated_module_that_was_damaged_is_written_again(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    path = tmp_path / "plants" / "made_twice.py"
    for damage in (b"number = ", b""):
        assert load_module("made_twice", lambda: "number = 1\n").number == 1
        path.write_bytes(path.read_bytes()[:4] + damage)
        del sys.modules["made_twice"]
