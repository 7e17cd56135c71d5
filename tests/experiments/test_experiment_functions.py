"""The functions made of the experiments' dataclasses: signature and documentation of every declared parameter."""

import ast
from inspect import getdoc, isfunction, signature
from pathlib import Path

import pytest

from rotorsim import experiments as ex
from rotorsim.experiments import calls
from rotorsim.experiments.parameters import parameters

MADE = [name for name in ex.EXPERIMENTS if name not in ("runup", "controlled")]
"""The others are written by hand."""


@pytest.mark.parametrize("name", MADE)
def test_a_function_has_the_parameters_types_and_defaults_of_its_dataclass(name):
    made, kind = signature(getattr(ex, name)), signature(ex.EXPERIMENTS[name])
    own = list(made.parameters.values())
    assert [p.name for p in (own[0], *own[-2:])] == ["plant", "seed", "progress"]
    given = [one for one in kind.parameters.values() if one.name != "Ts"]  # the plant's
    assert own[1:-2] == given and made.return_annotation == "xr.Dataset"


@pytest.mark.parametrize("name", MADE)
def test_its_documentation_states_type_default_unit_and_meaning_of_each_parameter(name):
    text = getdoc(getattr(ex, name))
    for entry, known in parameters(ex.EXPERIMENTS[name]):
        line, meaning = text.partition(f"\n{entry.name} : ")[2].splitlines()[:2]
        assert ("optional" in line) if entry.default is None else line.partition("default ")[2]
        assert known.doc.removesuffix(".") in meaning and (known.unit == "1" or f"[{known.unit}]" in meaning)


def test_its_example_is_that_of_the_dataclass_run_on_a_plant():
    assert 'rs.experiments.impact(plant, pressure=0.5e6, peak=20.0, hits=2, spacing=0.1).sizes["time"]' in getdoc(
        ex.impact
    )


def test_the_stub_for_type_checkers_states_the_signatures():
    stub = ast.parse(Path(calls.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    stated = {one.name: one.args for one in stub.body if isinstance(one, ast.FunctionDef)}
    made = {name: one for name, one in vars(calls).items() if isfunction(one) and name != "as_function"}
    assert stated.keys() == made.keys()
    for name, function in made.items():
        first, *others = signature(function).parameters.values()
        types = {one.arg: ast.unparse(one.annotation) for one in stated[name].args}
        assert types == {first.name: "Rig"} | {one.name: one.annotation for one in others}, name
        assert [ast.literal_eval(one) for one in stated[name].defaults] == [one.default for one in others], name
