"""Evidence for a law: random halves of the records, and a force whose shape is free."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import screen
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.force_shape import process_at, responses, shape_of
from rotorsim.discrepancy.law_terms import ObservedPlaces, PlaceMotion
from rotorsim.discrepancy.stability import PAIRS, PlacedTerm, _forms, _products, _view, stability

RECORDS, LINES, MOMENTS = 8, 12, 64


def fit_of(J: np.ndarray, residual: np.ndarray) -> ParameterFit:
    """A calibration of two numbers with priors, one of them off its own."""
    parameters = (FitParameter("shaft_stiffness", 0.01, sd=0.5), FitParameter("shaft_damping", 0.01, sd=2.0))
    point = ParameterPoint({parameters[0]: 0.1})
    return ParameterFit(parameters, point, residual, J, float(residual @ residual))


def halved(law: tuple[str, float], noise: float):
    """Terms at two places, a calibration, and a residual that is one of them in every record, with noise."""
    rng = np.random.default_rng(3)
    n = 40 * RECORDS
    names = [(name, place) for place in ("disc 0", "disc 1") for name in ("cubic", "dry", "drag")]
    terms = [PlacedTerm(name, place, rng.normal(size=(n, 2))) for name, place in names]
    own = next(one for one in terms if one.place == law[0])
    residual = law[1] * own.columns.sum(axis=1) + noise * rng.normal(size=n)
    layout = SimpleNamespace(record=np.repeat(np.arange(RECORDS), 40))
    seen = SimpleNamespace(
        comparison=SimpleNamespace(trials=[None] * RECORDS, layout=layout, repeated=list(range(RECORDS)))
    )
    return seen, fit_of(rng.normal(size=(n, 2)), residual), own, [one for one in terms if one is not own]


def test_the_scalar_products_of_all_records_screen_as_all_rows_do():
    seen, base, own, others = halved(("disc 1", 1.0), 1.0)
    terms = [own, *others]
    wanted = screen(base, _forms(terms), [one.columns for one in terms])
    found = _view(_products(seen, base, terms).sum(axis=0), base, terms)
    assert found.gram == pytest.approx(wanted.gram, abs=1e-9) and found.products == pytest.approx(wanted.products)
    assert [found.drop(i)[0] for i in range(6)] == pytest.approx([wanted.drop(i)[0] for i in range(6)])


def test_all_halves_choose_a_law_that_every_record_shows():
    seen, base, own, others = halved(("disc 1", 1.0), 0.1)
    found = stability(seen, base, [own], others, 9.0)
    assert (found.chosen, found.at_place, found.halves, found.others) == (2 * PAIRS, 2 * PAIRS, 2 * PAIRS, ())


def test_halves_of_records_that_show_nothing_choose_at_random():
    """Six terms with no share in the records: the probability that one has 25 of 50 halves is below 1e-7."""
    seen, base, own, others = halved(("disc 1", 0.0), 1.0)
    found = stability(seen, base, [own], others, 0.0)
    assert found.chosen < PAIRS and found.halves == 2 * PAIRS


def test_few_points_are_not_halved_however_often_they_were_recorded():
    seen, base, own, others = halved(("disc 1", 1.0), 0.1)
    seen.comparison.repeated = [0, 1, 2, 3, 4, 4, 4, 4]
    assert stability(seen, base, [own], others, 9.0) is None


def test_repeats_of_a_point_are_in_one_half():
    """Two records of each of six points, with a law in those of one half: halves are of points."""
    seen, base, own, others = halved(("disc 1", 1.0), 0.1)
    seen.comparison.repeated = [0, 0, 2, 3, 4, 5, 6, 6]
    taken = list[np.ndarray]()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rotorsim.discrepancy.stability._products", lambda *given: np.diag(np.arange(8))[:, :, None])
        patch.setattr("rotorsim.discrepancy.stability._view", lambda G, base, terms: taken.append(G[:, 0]))
        patch.setattr("rotorsim.discrepancy.stability._greedy", lambda view, terms, count, price: (0,))
        stability(seen, base, [own], others, 9.0)
    sides = np.array(taken) > 0
    assert len(sides) == 2 * PAIRS and np.array_equal(sides[:, 6], sides[:, 7])


def free_force(force, noise: float = 0.01):
    """Observed places whose records are the response to a force (2, n) of displacement, velocity, speed, angle."""
    rng, turn = np.random.default_rng(5), 2 * np.pi * np.arange(MOMENTS) / MOMENTS
    motions, rows = {"disc 0": [], "disc 1": []}, []
    for k in range(RECORDS):
        speed = 50.0 + 25.0 * (k % 3)
        for place in motions:
            H = rng.normal(size=(LINES, 2, 2)) + 1j * rng.normal(size=(LINES, 2, 2))
            phase = rng.uniform(0, 2 * np.pi, (2, 3, 1))
            orders = np.arange(1, 4)[:, None]
            u = np.sum(np.cos(orders * turn + phase), axis=1)
            v = -np.sum(orders * np.sin(orders * turn + phase), axis=1)
            motions[place].append(PlaceMotion(u, v, 2 * turn, speed, H, np.arange(LINES, dtype=float)))
        own = motions["disc 1"][-1]
        f = np.fft.rfft(-force(own.displacement, own.velocity, speed, own.angle))[:, :LINES] * (2 / MOMENTS)
        f[:, 0] /= 2
        rows.append(vector(np.einsum("lij,jl->il", own.H, f)[None]))
    sigma = noise * np.ones(rows[0].size * RECORDS)
    residual = np.concatenate(rows) / sigma + rng.normal(size=len(sigma))
    trials = [SimpleNamespace(vector=vector)] * RECORDS
    comparison = SimpleNamespace(trials=trials, sigma=sigma, twin=SimpleNamespace(machine=None))
    J = rng.normal(size=(len(sigma), 2))
    seen = ObservedPlaces(comparison, residual, J, motions)
    return seen, fit_of(J, residual)


def vector(spectra: np.ndarray) -> np.ndarray:
    """Real and imaginary parts of lines (1, 2, lines)."""
    return np.concatenate([spectra[0].real.ravel(), spectra[0].imag.ravel()])


def test_the_evidence_of_a_process_is_that_of_a_gaussian_vector_with_its_covariance():
    r"""r is N(J v_0, 1 + J P^-1 J' + S S') against N(J v_0, 1 + J P^-1 J'), with v_0 the priors' pull."""
    seen, base = free_force(lambda u, v, speed, angle: 0.0 * u, 1.0)
    points = np.random.default_rng(0).normal(size=(5, 5))
    lengths = np.array([1.0, 2.0, 100.0, 1.0, 1.0])
    found = process_at(seen, base, "disc 0", 0.2, lengths, points)
    S, sd = responses(seen, "disc 0", 0.2, lengths, points), np.array([k.sd for k in base.parameters])
    C = np.eye(len(seen.J)) + (seen.J * sd**2) @ seen.J.T
    mean = -seen.J @ base.vector
    wanted = (multivariate_normal.logpdf(seen.residual, mean, C + S @ S.T)
              - multivariate_normal.logpdf(seen.residual, mean, C))  # fmt: skip
    assert found.evidence == pytest.approx(wanted, rel=1e-6)


FORCES = {
    "displacement": lambda u, v, speed, angle: u * np.abs(u),
    "velocity": lambda u, v, speed, angle: np.tanh(2 * v),
    "displacement and speed": lambda u, v, speed, angle: np.tanh(u) * (speed / 75.0) ** 2,
    "displacement and shaft angle": lambda u, v, speed, angle: u * np.cos(angle),
}


@pytest.mark.parametrize(
    "names", [pytest.param(name, marks=pytest.mark.slow if "speed" in name else ()) for name in FORCES]
)
def test_a_force_of_free_shape_has_its_place_and_the_quantities_on_which_it_depends(names, monkeypatch):
    room = "rotorsim.discrepancy.force_shape"
    monkeypatch.setattr(f"{room}.table", lambda comparison, residual: residual)
    monkeypatch.setattr(f"{room}.excess", lambda residual: float(residual @ residual))
    monkeypatch.setattr(f"{room}.law_places", lambda machine: {"disc 0": 0.1, "disc 1": 0.2})
    monkeypatch.setattr(f"{room}.force_curve", lambda seen, place, left, along: along(seen.motions[place][0]))
    seen, base = free_force(FORCES[names])
    found = shape_of(seen, base)
    assert (found.place, found.position, " and ".join(found.depends)) == ("disc 1", 0.2, names)
    assert found.gone > 0.95 and found.near["disc 0"] > 100.0
    m = seen.motions["disc 1"][0]
    force, spread = found.curve
    wanted = -FORCES[names](m.displacement, m.velocity, m.speed, m.angle)
    assert np.abs(force - wanted).max() < 0.1 * np.abs(wanted).max() and np.all(spread > 0)


def test_no_force_of_free_shape_is_proposed_where_there_is_none():
    assert shape_of(*free_force(lambda u, v, speed, angle: 0.0 * u)) is None
