"""Invalid film inputs: one sentence with thing, value and limit."""

import numpy as np
import pytest

from refusals import refused
from reynolds import FilmError, GasBearing, Injector


@pytest.mark.parametrize("journal", [(25e-6, 0.0), (0.0, -26e-6), (20e-6, 20e-6)])
@pytest.mark.parametrize("method", ["steady", "coefficients"])
def test_journal_outside_the_clearance_is_refused_with_its_film_thickness(plain, journal, method):
    with refused(FilmError, "journal", lambda gap: gap <= 0):
        getattr(plain(16, 4), method)(journal, 100.0)


@pytest.mark.parametrize("method", ["steady", "coefficients"])
def test_journal_without_a_place_is_refused(plain, method):
    with pytest.raises(FilmError, match="nan"):
        getattr(plain(16, 4), method)((np.nan, 0.0), 100.0)


def test_march_that_begins_outside_the_clearance_is_refused(plain):
    with pytest.raises(FilmError, match="touches the sleeve"):
        plain(16, 4).march(lambda t: (30e-6, 0.0), 1e-3, 1e-4)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"n_theta": 30}, "n_theta = 30: must be a multiple of 4, at least 8"),
        ({"n_theta": 4}, "n_theta = 4: must be a multiple of 4, at least 8"),
        ({"n_z": 7}, "n_z = 7: must be even, at least 4"),
        ({"n_z": 2}, "n_z = 2: must be even, at least 4"),
        ({"clearance": -1e-6}, "clearance = -1e-06 m: must be positive"),
        ({"clearance": 0.0}, "clearance = 0.0 m: must be positive"),
        (
            {"injectors": (Injector(0.0), Injector(1.0, law="loss_factor"))},
            "injectors: all must have the same law",
        ),
        ({"injectors": (Injector(0.0, offset=0.0199),)}, "from the centre: its orifice leaves the film"),
        ({"injectors": (Injector(0.0, offset=-0.03),)}, "from the centre: its orifice leaves the film"),
    ],
)
def test_film_that_makes_no_sense_is_refused_with_a_sentence(change, sentence):
    with pytest.raises(ValueError, match=sentence):
        GasBearing(**({"radius": 0.02, "length": 0.04, "clearance": 25e-6} | change)).steady()


def test_unknown_name_in_the_package_is_an_attribute_error():
    import reynolds

    with pytest.raises(AttributeError, match="nonsense"):
        _ = reynolds.nonsense
