"""Machine files: round trips from machine to text, and changes of single values."""

import pickle

import numpy as np
import pytest
import tomlkit
from hypothesis import given, settings, strategies as st

from rotorsim.base.errors import MachineFileError
from rotorsim.machine import load_machine, machine_text, shipped_machines
from rotorsim.machine.file_text import parse, value_at, with_value
from rotorsim.machine.schema import Machine, leaves


def si(low, high, unit):
    """Any double between the limits, as text in SI units."""
    return st.floats(low, high, exclude_min=low == 0).map(lambda value: f"{value!r} {unit}")


def table(required, **optional):
    return st.fixed_dictionaries(required, optional={k: v for k, v in optional.items()})


MATERIAL = table(
    {"density": si(0, 1e5, "kg/m^3"), "youngs_modulus": si(0, 1e13, "Pa"), "poisson_ratio": st.floats(-0.9, 0.5)}
)
SECTION = table({"length": si(0.4, 1, "m"), "outer_diameter": si(0.01, 1, "m")}, inner_diameter=si(0, 0.009, "m"))
SHAFT = table(
    {"start": si(-0.1, 0, "m"), "material": MATERIAL, "sections": st.lists(SECTION, min_size=2, max_size=4)},
    damping_ratio=st.floats(0, 0.5),
    max_element_length=si(0.01, 1, "m"),
)
FILM = table(
    {
        "kind": st.just("gas_film"),
        "position": si(0.2, 0.3, "m"),
        "diameter": si(0.02, 1, "m"),
        "length": si(0.02, 0.1, "m"),
        "clearance": si(1e-6, 1e-3, "m"),
    }
)
BEARING = table(
    {"kind": st.just("linear"), "position": si(0.001, 0.1, "m"), "kxx": si(0, 1e14, "N/m")},
    kyy=si(0, 1e14, "N/m"),
    kxy=si(-1e14, 1e14, "N/m"),
    cyy=si(0, 1e12, "N*s/m"),
)
UNBALANCE = table({"me": si(0, 1e-2, "kg*m")}, phase=si(-6.28, 6.28, "rad"), position=si(0.1, 0.3, "m"))
INJECTOR = table(
    {"angle": si(-7, 7, "rad"), "reference": st.sampled_from(["+x", "-x", "+y", "-y", "none"])},
    offset=si(-0.005, 0.005, "m"),
)
INJECTION = table(
    {
        "law": st.just("orifice"),
        "seat_gap": si(2e-6, 1e-4, "m"),
        "minimum_gap": si(0, 1e-6, "m"),
        "pin_diameter": si(0, 0.1, "m"),
        "pin_discharge": st.floats(0.1, 2),
        "orifice_diameter": si(0, 0.01, "m"),
        "curtain_discharge": st.floats(0.1, 2),
        "plenum_volume": si(0, 1e-3, "m^3"),
        "pin_bias": si(0, 1e-2, "m"),
        "pin_per_volt": si(0, 1e-2, "m/V"),
    },
    loss_factor=si(0, 1e-6, "kg/(s*Pa^2)"),
    polytropic_exponent=st.floats(1, 2),
)
DISC = table(
    {
        "position": si(0.1, 0.4, "m"),
        "mass": si(0, 1e6, "kg"),
        "polar_inertia": si(0, 1e6, "kg*m^2"),
        "diametral_inertia": si(0, 1e6, "kg*m^2"),
    }
)
MACHINE = table(
    {
        "name": st.text(),
        "shaft": SHAFT,
        "discs": st.lists(DISC, min_size=1, max_size=2),
        "bearings": st.tuples(BEARING, FILM).map(list),
        "injection": INJECTION,
        "effects": table(
            {}, unbalance=st.one_of(UNBALANCE, st.lists(UNBALANCE, min_size=1, max_size=3)), gravity=st.just({})
        ),
    },
    description=st.text(),
    injectors=st.lists(INJECTOR, max_size=4),
    probe=table({"position": si(0, 0.3, "m")}),
    gas=table({}, temperature=si(200, 400, "K"), viscosity=si(1e-6, 1, "Pa*s"), ambient_pressure=si(1, 1e8, "Pa")),
    grid=table({}, n_theta=st.integers(2, 128).map(lambda n: 4 * n), n_z=st.integers(2, 128).map(lambda n: 2 * n)),
    solver=table(
        {}, time_step=st.sampled_from(["0.2 ms", "0.1 ms", "50 us", "40 us"]), tolerance=st.floats(1e-12, 1e-3)
    ),
)


@settings(derandomize=True)
@given(MACHINE)
def test_a_machine_written_as_text_reads_back_equal(tables):
    tables["solver"] = {**tables.get("solver", {}), "minimum_film": "0.1 um"}
    machine = Machine.model_validate(tables)
    again = Machine.from_text(machine.text)
    assert again == machine
    assert (again.text, again.hash) == (machine.text, machine.hash)


def test_replace_changes_one_value_and_leaves_the_original_alone():
    machine = load_machine("dtu_gas_bearing")
    changed = machine.replace("effects.unbalance.me", "12 g*mm")
    assert changed.effects["unbalance"][0].me == 12e-6
    assert machine == load_machine("dtu_gas_bearing")
    assert changed != machine and changed.hash != machine.hash
    back = f"{machine.effects['unbalance'][0].me!r} kg*m"
    assert changed.replace(path="effects.unbalance.me", value=back) == machine


def test_replace_reaches_list_items_by_index_and_absent_tables_and_fields():
    machine = load_machine("plain_rotor")
    assert machine.replace("bearings.1.kxx", "3 MN/m").bearings[1].kxx == 3e6
    assert machine.replace("effects.coupling.force_2x", "1 N").effects["coupling"][0].force_2x == 1.0
    assert machine.replace("effects.unbalance.0.phase", "90 deg").effects["unbalance"][0].phase == np.pi / 2
    assert machine.replace("gas.temperature", "20 degC").gas.temperature == 293.15
    assert machine.replace("grid.n_z", np.int64(24)).grid.n_z == 24
    assert machine.replace("shaft.damping_ratio", np.float64(0.01)).shaft.damping_ratio == 0.01
    assert machine.replace("shaft.damping_ratio", "0.01").shaft.damping_ratio == 0.01


def test_replace_works_on_one_of_several_planes_of_unbalance():
    text = load_machine("plain_rotor").text.replace("[effects.unbalance]", "[[effects.unbalance]]")
    machine = Machine.from_text(text + '\n[[effects.unbalance]]\nme = "1 g*mm"\nposition = "100 mm"\n')
    assert machine.replace("effects.unbalance.1.me", "2 g*mm").effects["unbalance"][1].me == 2e-6


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("effects.unbalance.me", "20 g", "effects.unbalance.me: '20 g' is not a mass*length; write e.g. '10 g*mm'"),
        ("effects.unbalanc.me", "2 g*mm", "effects.unbalanc: unknown effect; did you mean 'unbalance'?"),
        ("bearings.7.kxx", "3 MN/m", "bearings: has 2 entries, counted from 0; '7' is none of them"),
        ("bearings.kxx", "3 MN/m", "bearings: has 2 entries, counted from 0; 'kxx' is none of them"),
        ("shaft.start.x", "3 mm", "shaft.start.x: 'shaft.start' is a value, not a table; check the path"),
        ("shaft..x", "3 mm", "'shaft..x' is not a path; write e.g. 'effects.unbalance.me'"),
        ("gird.n_z", 8, "gird: unknown field; did you mean 'grid'?"),
        ("bearings.0", "3 mm", "bearings.0: holds several values; name the one to change"),
        ("shaft", "3 mm", "shaft: holds several values; name the one to change"),
        ("grid.n_z", object(), "grid.n_z: <object object"),
    ],
)
def test_replace_refuses_what_leads_nowhere_or_is_not_valid(path, value, sentence):
    with pytest.raises(MachineFileError) as caught:
        load_machine("dtu_gas_bearing").replace(path, value)
    assert sentence in str(caught.value)


def test_saving_keeps_comments_and_changes(tmp_path):
    path = tmp_path / "rig.toml"
    load_machine("dtu_gas_bearing").replace("effects.unbalance.me", "12 g*mm").save(path)
    text = path.read_text()
    assert "# DTU thesis, Table C.2" in text and 'me = "12 g*mm"' in text
    assert load_machine(path).effects["unbalance"][0].me == 12e-6
    assert [p.name for p in tmp_path.iterdir()] == ["rig.toml"]


def test_a_machine_survives_pickling_and_hashes_by_content():
    machine = load_machine("dtu_gas_bearing")
    assert pickle.loads(pickle.dumps(machine)) == machine
    assert len({machine, load_machine("dtu_gas_bearing"), Machine.from_text(machine.text)}) == 1


@pytest.mark.parametrize("name", shipped_machines())
def test_a_value_that_is_replaced_on_its_line_gives_the_bytes_of_an_edit_of_the_parsed_file(name):
    text, tables = machine_text(name), parse(machine_text(name))
    written = [path for path, *_ in leaves(load_machine(name)) if isinstance(value_at(tables, path), (str, float))]
    for path in written[::4]:
        old = value_at(tables, path)
        new = 1.25 * old if isinstance(old, float) else f'{old} "#\\'
        document = tomlkit.parse(text)
        *above, last = path.split(".")
        held = document
        for key in above:
            held = held[int(key)] if isinstance(held, list) else held if key == "0" and "0" not in held else held[key]
        held[last] = new
        assert with_value(text, path, new) == tomlkit.dumps(document), path
    assert len(written) > 8


def test_a_new_value_stands_before_the_block_to_be_switched_on_that_follows_its_table():
    text = '[[bearings]]\nkxx = "1 N/m"\n\n#[drive]\n#power = "1 kW"\n\n[shaft]\nstart = "0 m"\n'
    found = with_value(text, "bearings.0.kyy", "2 N/m")
    assert found == text.replace('kxx = "1 N/m"\n', 'kxx = "1 N/m"\nkyy = "2 N/m"\n')
