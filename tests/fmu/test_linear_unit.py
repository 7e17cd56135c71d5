"""Units of identified LPV models: trajectories of the model, and exact derivatives for model exchange."""

import numpy as np
import pytest
from lpv_models import make_lpv

from fmu.check import derivative_error, jacobian, model_exchange, moving_inputs, names, simulated
from fmu.linear_units import find_terms
from rotorsim.base.errors import DataError


@pytest.fixture(scope="module")
def exported(gcc, tmp_path_factory):
    """Return model and files by FMI version for a kind of LPV model; each is exported once."""
    from fmu.export import choose, export, linear_unit

    known = {}

    def get(kind):
        if kind not in known:
            folder = tmp_path_factory.mktemp("linear")
            make_lpv(kind).save(folder / "bearing.json")
            model = linear_unit(folder / "bearing.json")
            known[kind] = model, export(model, folder / "bearing.fmu", (2, 3), choose("host"))
        return known[kind]

    return get


@pytest.fixture(
    params=[(kind, version) for kind in ("2", "3") for version in (2, 3)], ids=lambda p: f"{p[0]}-fmi{p[1]}"
)
def both(exported, request):
    """Return model and loaded unit, for two structures and both versions of FMI."""
    from fmu.importer import ImportedUnit

    model, files = exported(request.param[0])
    with ImportedUnit(files[request.param[1]]) as unit:
        yield model, unit


@pytest.mark.parametrize("kind", ["1", "2", "3", "3-delay", "blackbox"])
def test_terms_make_the_matrices_for_any_parameters(kind):
    from fmu.linear_units import LinearUnit

    unit = LinearUnit(make_lpv(kind), "bearing", 300.0, 5e5)
    theta = np.random.default_rng(0).normal(size=len(unit.lpv.coefficients))
    A, B, C, D = unit.matrices(theta)
    wanted, found = np.block([[A, B], [C, D]]), np.zeros((len(A) + 2, len(A) + 2))
    for row, column, i, j, factor in find_terms(unit.matrices, len(theta), kind != "blackbox"):
        found[row, column] += factor * (theta[i] if i >= 0 else 1.0) * (theta[j] if j >= 0 else 1.0)
    np.testing.assert_allclose(found, wanted, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("kind", ["3", "blackbox"])
@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_finds_no_problem_in_a_linear_unit(exported, kind, version):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(exported(kind)[1][version])) == []


def check_run(model, unit, samples, tolerance):
    """Hold a run of a unit to the model in Python."""
    inputs = moving_inputs(model, samples)
    instance = unit.instance()
    instance.initialise({name: values[0] for name, values in inputs.items()})
    rows = instance.run(inputs, model.sample, ["disc.x", "disc.y"])
    instance.close()
    truth = simulated(model, inputs, model.sample)
    np.testing.assert_allclose(rows, truth, rtol=0, atol=tolerance * np.abs(truth).max())


def test_co_simulation_follows_the_model_in_python(both):
    check_run(*both, 500, 1e-9)


def test_a_sampled_model_follows_python_and_is_for_co_simulation_only(exported):
    from fmu.importer import ImportedUnit

    model, files = exported("blackbox")
    for path in files.values():
        with ImportedUnit(path) as unit:
            assert unit.description.modelExchange is None
            check_run(model, unit, 200, 1e-12)


def test_directional_derivatives_are_the_matrices(both):
    assert derivative_error(both[1], both[0]) < 1e-14


def test_derivatives_by_speed_and_pressure_are_those_of_differences(both):
    model, unit = both
    instance = model_exchange(unit)
    set_real = instance.setFloat64 if unit.is_3 else instance.setReal
    unknowns, scheduling = names(model)[0], ["shaft.speed_ref", "injection.pressure"]
    refs = [unit.variables[name].valueReference for name in ("piezo.ref_x", "piezo.ref_y", *scheduling)]
    rows = [unit.variables[name].valueReference for name in unknowns]
    get_real = instance.getFloat64 if unit.is_3 else instance.getReal
    x = np.random.default_rng(1).normal(size=model.order)
    instance.setContinuousStates((np.ctypeslib.as_ctypes(x)), model.order)

    def values(speed, pressure):
        set_real(refs, [0.3, -0.2, speed, pressure])
        return np.array(get_real(rows))

    for k, step in enumerate((1.0, 1e3)):
        q, move = np.array([250.0, 4e5]), np.eye(2)[k] * step
        wanted = (values(*(q + move)) - values(*(q - move))) / (2 * step)
        values(*q)
        found = jacobian(unit, instance, unknowns, [scheduling[k]])[:, 0]
        np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-7 * np.abs(wanted).max())
    instance.terminate()
    instance.freeInstance()


def test_model_exchange_with_a_solver_gives_what_co_simulation_gives(both):
    from fmpy import simulate_fmu

    model, unit = both
    start = {"piezo.ref_x": 0.5, "shaft.speed_ref": 300.0, "injection.pressure": 5e5}
    path = unit.folder
    options = {"filename": path, "stop_time": 0.05, "output_interval": 0.01, "start_values": start}
    options |= {"output": ["disc.x", "disc.y"], "model_description": unit.description}
    solved = simulate_fmu(fmi_type="ModelExchange", relative_tolerance=1e-9, **options)
    instance = unit.instance()
    instance.initialise(start)
    held = {"piezo.ref_x": np.full(250, 0.5)}
    rows = instance.run(held, model.sample, ["disc.x", "disc.y"])[::50]
    instance.close()
    for k, name in enumerate(("disc.x", "disc.y")):
        np.testing.assert_allclose(solved[name], rows[:, k], rtol=0, atol=1e-4 * np.abs(rows).max())


def test_model_exchange_may_try_beyond_the_stop_time_but_not_go_there(both):
    from fmpy.fmi1 import FMICallException

    _, unit = both
    instance = model_exchange(unit, stop=1.0)
    instance.setTime(1.05)
    (instance.getFloat64 if unit.is_3 else instance.getReal)([unit.variables["der(x[1])"].valueReference])
    with pytest.raises(FMICallException, match=r"ompletedIntegratorStep failed with status 3"):
        instance.completedIntegratorStep()
    instance.setTime(1.0)
    instance.completedIntegratorStep()
    instance.terminate()
    instance.freeInstance()


def test_a_point_outside_the_range_is_reported_once(both):
    model, unit = both
    instance = unit.instance()
    instance.initialise({"shaft.speed_ref": 2000.0})
    for k in range(3):
        instance.step(k * model.sample, model.sample)
    assert sum("outside those the model was identified at" in text for text in instance.messages) == 1
    instance.close()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(both, value):
    model, unit = both
    instance = unit.instance()
    instance.initialise()
    instance.set({"injection.pressure": value})
    with pytest.raises(Exception):  # noqa: B017  (FMPy has several)
        instance.step(0.0, model.sample)
    assert instance.messages[-1].startswith("injection.pressure = ")
    instance.close()


def test_files_that_are_no_lpv_model_are_refused(tmp_path):
    from fmu.export import linear_unit

    with pytest.raises(DataError, match=r"model: .*is not there.*or take 'plant'"):
        linear_unit(tmp_path / "no.json")
    make_lpv("3").at(300.0, 5e5).save(tmp_path / "one.json")
    with pytest.raises(DataError, match="is a model of one operating point"):
        linear_unit(tmp_path / "one.json")


def test_every_check_of_the_command_passes_for_a_linear_unit(exported):
    from fmu.check import check

    for path in exported("3")[1].values():
        found = list(check(path, 0.05))
        assert len(found) >= 10
        assert [c for c in found if c.passed is False] == []
