"""A component is declared once: the part of a machine file and what the film takes are one thing."""

import dataclasses
import pickle

import pytest

import rotorsim as rs
from reynolds import sleeve
from reynolds.injector import Injector
from rotorsim.base.quantity import quantities, quantity_of
from rotorsim.machine.part import SI

FORMS = [one for one in vars(sleeve).values() if isinstance(one, type) and sleeve.SleeveForm in one.__bases__]
SIZE = {"diameter": "40 mm", "length": "40 mm", "clearance": "25 um"}


def example(form):
    """The recommended value of every number of a form, and its words."""
    words = {f.name: f.default for f in dataclasses.fields(form) if quantity_of(f) is None}
    return words | {name: known.parse(known.suggestion()) for name, known in quantities(form).items()}


@pytest.mark.parametrize("form", FORMS, ids=lambda one: one.__name__)
def test_a_form_of_a_sleeve_in_a_file_is_the_one_that_the_film_takes(form):
    part = getattr(rs.machine, form.__name__)
    assert issubclass(part, form) and list(part.model_fields) == [f.name for f in dataclasses.fields(form)]
    declared = {name: quantity_of(info) for name, info in part.model_fields.items()}
    assert {name: one for name, one in declared.items() if one is not None} == quantities(form)
    values = example(form)
    read = part.model_validate(values, context=SI)
    assert {name: getattr(read, name) for name in values} == values == vars(form(**values))
    assert pickle.loads(pickle.dumps(read)) == read
    field = form.__name__.lower()
    given = (read,) if field == "steps" else read
    film = rs.machine.GasFilm(kind="gas_film", position="0 mm", **SIZE, **{field: given})
    assert [type(one) for one in film.sleeve.forms.values()] == [part]


def test_every_form_is_seen():
    assert {one.__name__ for one in FORMS} == {type(one).__name__ for one in _forms_of_a_film()}


def _forms_of_a_film():
    """Forms that a gas film can have, by its fields."""
    fields = {name: getattr(rs.machine, name.capitalize(), None) for name in rs.machine.GasFilm.model_fields}
    kinds = [kind for kind in fields.values() if kind is not None and issubclass(kind, sleeve.SleeveForm)]
    return [kind.model_validate(example(kind.__bases__[1]), context=SI) for kind in kinds]


def test_orifices_and_injectors_hand_the_film_its_nozzles():
    machine = rs.load_machine("dtu_gas_bearing")
    nozzle = machine.injection.nozzle(machine.injectors[1])
    shared = {f.name for f in dataclasses.fields(Injector)} & set(rs.machine.Injection.model_fields)
    assert len(shared) >= 9
    assert all(getattr(nozzle, name) == (getattr(machine.injection, name) or 0.0) for name in shared)
    row = rs.machine.Orifices(count=8, diameter="0.2 mm", offset="10 mm")
    assert [one.angle for one in row.nozzles] == list(row.angles)
    assert all(one.open_area == pytest.approx(0.8 * 3.14159265e-8, rel=1e-8) for one in row.nozzles)


def test_every_kind_of_bearing_says_what_rotor_limits_and_drawings_ask():
    """A kind is its class: nothing else asks which one it is."""
    linear = rs.machine.LinearBearing(kind="linear", position="10 mm", kxx="1 MN/m", cxx="30 N*s/m", kxy="0.1 MN/m")
    points = [{"speed": "0 rpm", "kxx": "10 MN/m"}, {"speed": "3000 rpm", "kxx": "20 MN/m"}]
    table = rs.machine.TableBearing(kind="table", position="10 mm", points=points)
    film = rs.machine.GasFilm(kind="gas_film", position="10 mm", nominal_stiffness="3 MN/m", **SIZE)
    assert (linear.spring, table.spring, film.spring) == (None, 15e6, 3e6)
    assert [one.speeds.size for one in (linear, table, film)] == [0, 2, 0]
    assert linear.coefficients[0].tolist() == [[1e6, 1e5], [0.0, 1e6]] and film.coefficients is None
    assert table.coefficients[0].shape == table.coefficients[1].shape == (2, 2, 2)
    assert [one.ends for one in (linear, table)] == [(0.01, 0.01)] * 2
    assert film.ends == pytest.approx((-0.01, 0.03))


def test_arrays_that_a_table_keeps_are_not_written_to_and_a_copy_has_those_of_its_own_points():
    points = [{"speed": "0 rpm", "whirl_frequency": f"{w} rad/s", "kxx": f"{k} MN/m"} for w, k in ((0, 1), (9, 2))]
    bearing = rs.machine.TableBearing(kind="table", position="10 mm", points=points)
    assert not any(one.flags.writeable for one in (*bearing.grid, bearing.whirl))
    stiff = bearing.points[1].model_copy(update={"kxx": 7e6, "whirl_frequency": 3.0})
    other = bearing.model_copy(update={"points": (bearing.points[0], stiff)})
    assert other.whirl.tolist() == [0.0, 3.0] and other.at(0.0, 3.0)[0][0, 0] == 7e6
    assert bearing.whirl.tolist() == [0.0, 9.0] and bearing.at(0.0, 9.0)[0][0, 0] == 2e6
