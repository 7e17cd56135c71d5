"""A unit of a machine that is sampled at 50 kHz, on two films: its steps, and the bits of the Python plant."""

import numpy as np
import pytest

from fmu.check import plant_outputs, run
from fmu.importer import reference_inputs
from rotorsim.plant import Plant

SPEED = 12000.0


@pytest.fixture(scope="module")
def fast(gcc, tmp_path_factory):
    """Model and loaded unit of the small turbo rotor on a coarse grid."""
    from fmu.export import choose, export, plant_unit
    from fmu.importer import ImportedUnit

    model = plant_unit(Plant("grooved_turbo_rotor", n_theta=16, n_z=8), SPEED, 0.0)
    files = export(model, tmp_path_factory.mktemp("units") / "fast.fmu", (3,), choose("host"))
    with ImportedUnit(files[3]) as unit:
        yield model, unit


@pytest.mark.parametrize("steps", [1, 5])
def test_a_unit_steps_at_its_machine_s_rate_with_the_bits_of_the_plant(fast, steps):
    model, unit = fast
    assert model.sample == 2e-5 == float(unit.description.defaultExperiment.stepSize)
    inputs = reference_inputs(model, 120, steps * model.sample)
    truth = plant_outputs(model, inputs, steps * model.sample)
    rows = run(unit, inputs, steps * model.sample, list(truth))
    for k, (name, (values, good)) in enumerate(truth.items()):
        assert values[good].tobytes() == rows[good, k].tobytes(), name


def test_a_step_that_is_no_multiple_is_refused_with_those_that_are(fast):
    _, unit = fast
    log = []
    instance = unit.instance(log=lambda *words: log.append(str(words)))
    instance.initialise({})
    with pytest.raises(Exception):  # noqa: B017  (FMPy has several)
        instance.step(0.0, 3.1e-5)
    assert "2e-05" in "".join(log)
    assert np.isfinite(instance.get(["disc.x"])[0])
