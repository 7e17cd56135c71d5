"""The functions made of the experiments' dataclasses: signature and documentation of every declared parameter."""

from inspect import getdoc, signature
from pathlib import Path

import pytest

from rotorsim import experiments as ex
from rotorsim.experiments import catalogue
from rotorsim.experiments.experiment import parameters

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


def test_every_file_of_the_catalogue_registers_its_experiment_with_example_and_figures():
    files = {one.stem for one in Path(catalogue.__file__).parent.glob("[a-z]*.py")}
    assert files == set(ex.EXPERIMENTS) and len(files) > 9
    for name, kind in ex.EXPERIMENTS.items():
        assert kind.example and kind.figures and callable(getattr(ex, name)), name
