"""A unit of a machine that is sampled at 50 kHz: its steps, and the bits of the Python plant."""

import numpy as np
import pytest

from fmu.check import plant_outputs, run
from fmu.importer import reference_inputs
from rotorsim.plant import Plant


@pytest.fixture(scope="module", params=["plain_rotor", pytest.param("grooved_turbo_rotor", marks=pytest.mark.slow)])
def fast(request, probed_rotor, exported_plant):
    """Model and loaded unit of a plain rotor, and of the small turbo rotor on two films with a coarse grid."""
    if request.param == "plain_rotor":
        return probed_rotor
    return exported_plant(Plant(request.param, n_theta=16, n_z=8), 12000.0, 0.0)


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
