"""Kernels that other modules call as machine code, and inlined functions that numbers do not multiply."""

import subprocess
import sys

import numpy as np
import pytest

FILM = """
from reynolds.jit import part, shared

@part(True)
def raised(w, k, by):
    w[k] += by

@shared
def flow(w):
    raised(w, 0, 1.0)
    raised(w, 1, 2.0)
    return w[0] * w[1]
"""
PLANT = """
from reynolds.jit import kernel, part
from film_of_a_test import flow

@part(False)
def step(w):
    return flow(w) + 0.5

@kernel
def run(w):
    return step(w)
"""
RUN = f"""
import numpy as np
from rotorsim.plant.calls import load_module
film = load_module("film_of_a_test", lambda: {FILM!r})
plant = load_module("plant_of_a_test", lambda: {PLANT!r})
print(plant.run(np.zeros(2)), sum(plant.run.stats.cache_hits.values()), sum(film.flow.stats.cache_hits.values()))
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Lines that a process prints: the plant's result, and how much of plant and film it found on disk."""
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    return lambda: subprocess.run([sys.executable, "-c", RUN], check=True, capture_output=True, text=True).stdout


def test_machine_code_on_disk_finds_what_it_calls(run, tmp_path):
    assert [run(), run()] == ["2.5 0 0\n", "2.5 1 1\n"]
    for file in tmp_path.rglob("film_of_a_test.*.nb?"):
        file.unlink()
    assert run() == "2.5 1 0\n"


def test_an_inlined_function_is_compiled_once_for_all_numbers(tmp_path, monkeypatch):
    from rotorsim.plant.calls import load_module

    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    film = load_module("film_of_another_test", lambda: FILM)
    assert film.flow(np.zeros(2)) == 2.0 and len(film.raised.overloads) == 1


@pytest.mark.slow
def test_a_plant_does_not_compile_the_films_solver_again(rig, tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))
    plant = rig(n_theta=20, n_z=6)  # of no other test: what is compiled already shows no code
    plant.start(600.0, 0.5e6)
    module = plant.assembly.module
    (code,) = module.settle.inspect_llvm().values()
    heads = [line.split("(")[0] for line in code.splitlines() if line.startswith(("declare ", "define "))]
    solver = [head.split()[0] for head in heads if "newton" in head]
    assert solver == ["declare"]
