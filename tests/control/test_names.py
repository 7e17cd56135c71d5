"""Public names of the control package: each design under its name, and the law."""

import pytest

import rotorsim.control as control
from rotorsim.control.catalogue import DESIGNS, module_of


@pytest.mark.parametrize("name", DESIGNS)
def test_every_design_of_the_catalogue_is_a_name_of_the_package(name):
    assert getattr(control, name) is module_of(name)
    assert name in dir(control) and callable(module_of(name).design)
