"""Shaft inputs: derived values, and one sentence for each invalid input."""

import numpy as np
import pytest

from fe_shaft import (
    BearingElement,
    DiskElement,
    Material,
    PointMass,
    Rotor,
    ShaftElement,
    Unbalance,
    modal_reduction,
    steel,
)


def shaft(n: int = 3) -> list[ShaftElement]:
    return [ShaftElement(0.1, 0.0, 0.02) for _ in range(n)]


def table_rotor(extrapolate: str = "error") -> Rotor:
    """A rotor on bearings whose stiffness grows from 1 to 4 MN/m over 0 to 300 rad/s."""
    table = {"frequency": [0.0, 100.0, 300.0], "extrapolate": extrapolate}
    return Rotor(shaft(), [], [BearingElement(n, [1e6, 2e6, 4e6], 0.0, **table) for n in (0, 3)])


def tabled(first: list[float], last: list[float]) -> Rotor:
    """A rotor on bearings with tables over two ranges of speeds."""
    ends = ((0, first), (3, last))
    return Rotor(shaft(), [], [BearingElement(n, [1e6, 2e6], 0.0, frequency=speeds) for n, speeds in ends])


def test_material_derives_the_elastic_constant_that_is_missing():
    assert steel.Poisson == pytest.approx(211 / 162.4 - 1)
    assert Material("m", rho=7850.0, E=210e9, Poisson=0.3).G_s == pytest.approx(210e9 / 2.6)


def test_disc_from_geometry_has_the_inertia_of_a_ring():
    """Against 2 kg of solid disc, d = .1 m, w = .02 m: Ip = m r^2 / 2, Id = m (3 r^2 + w^2) / 12."""
    rho = 2 / (np.pi * 0.05**2 * 0.02)
    disc = DiskElement.from_geometry(0, Material("m", rho, 1e11, Poisson=0.3), 0.02, 0.0, 0.1)
    assert (disc.m, disc.Ip, disc.Id) == pytest.approx((2.0, 0.0025, 2 * (3 * 0.05**2 + 0.02**2) / 12))


def test_bearing_is_isotropic_unless_set_otherwise():
    bearing = BearingElement(0, 1e6, 100.0)
    assert np.array_equal(bearing.stiffness, 1e6 * np.eye(2))
    assert np.array_equal(bearing.damping, 100.0 * np.eye(2))
    assert BearingElement(0, 1e6, 100.0, kyy=0.0, cyy=0.0).stiffness[1, 1] == 0.0


def test_elements_are_numbered_by_order_or_sorted_by_their_numbers():
    assert [e.n for e in Rotor(shaft()).shaft_elements] == [0, 1, 2]
    shuffled = Rotor([ShaftElement(0.3, 0.0, 0.02, n=1), ShaftElement(0.1, 0.0, 0.02, n=0)])
    assert shuffled.nodes_pos == pytest.approx([0.0, 0.1, 0.4])
    assert shuffled.ndof == 12
    assert shuffled.number_dof == 4


def test_two_discs_on_one_node_add_up():
    one = Rotor(shaft(), [DiskElement(1, 3.0, 0.01, 0.02)])
    two = Rotor(shaft(), [DiskElement(1, 1.0, 0.004, 0.01), DiskElement(1, 2.0, 0.006, 0.01)])
    assert two.M() == pytest.approx(one.M())
    assert two.mass == pytest.approx(one.mass)


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: Material("m", 7800.0, 2e11), "give G_s"),
        (lambda: Material("m", 7800.0, 2e11, 8e10, 0.4), "contradict"),
        (lambda: Material("m", 0.0, 2e11, 8e10), "rho = 0 must be positive"),
        (lambda: ShaftElement(0.0, 0.0, 0.02), "L = 0 must be positive"),
        (lambda: ShaftElement(0.1, 0.03, 0.02), "below odl = 0.02 m"),
        (lambda: ShaftElement(0.1, 0.0, 0.02, idr=0.03), "below odr = 0.02 m"),
        (lambda: ShaftElement(0.1, 0.0, 0.02, eta_v=-1e-4), "eta_v = -0.0001 must not be negative"),
        (lambda: ShaftElement(0.1, 0.0, 0.02, axial_force=np.nan), "axial_force = nan is not a finite number"),
        (lambda: BearingElement(0, np.nan, 0.0), "bearing at node 0: kxx holds nan"),
        (lambda: BearingElement(0, [1e6, np.nan], 0.0, frequency=[0, 1]), "kxx holds nan"),
        (lambda: BearingElement(0, [1e6, 2e6], 0.0, frequency=[1, 0]), "value 1, 0, is not above"),
        (lambda: BearingElement(0, [1e6, 2e6], 0.0), "its axes have no entries"),
        (lambda: BearingElement(0, 1e6, 0.0, extrapolate="linear"), "choose 'error' or 'hold'"),
        (lambda: PointMass(0, -1.0), "none may be negative or NaN"),
        (lambda: DiskElement(0, np.nan, 0.0, 0.0), "none may be negative or NaN"),
        (lambda: Rotor(shaft(), [], [BearingElement(1, 1e6, 0.0, n_link=4)]), "pedestal at node 4 has no mass"),
        (lambda: Rotor(shaft(), clamped=[9]), "clamp at node 9"),
        (lambda: table_rotor().run_modal(500.0), "speed 500 rad/s is outside its table, 0 to 300 rad/s"),
        (lambda: tabled([100.0, 200.0], [300.0, 400.0]).run_critical_speed(), "from 300 rad/s.* up to 200 rad/s"),
        (lambda: tabled([500.0, 900.0], [500.0, 900.0]).run_critical_speed(limit=200.0), "limit = 200 .* begin at 500"),
        (lambda: Rotor(shaft()).run_campbell([]), "give a list of at least one number"),
        (lambda: Rotor(shaft()).run_campbell([3.0, 1.0]), "value 1, 1, is not above"),
        (lambda: Rotor(shaft()).run_campbell([0.0, np.nan]), "value 1 is nan"),
        (lambda: Rotor(shaft()).run_campbell([0.0], frequencies=0), "at least one mode"),
        (lambda: Rotor(shaft()).run_ucs(), "no bearing whose stiffness could vary"),
        (lambda: table_rotor().run_ucs((1e7, 1e6)), "give a positive ascending range"),
        (lambda: table_rotor().run_critical_speed(limit=-1.0), "both must be positive"),
        (lambda: Rotor(shaft()).run_time_response(0.0, np.zeros((2, 3)), [0, 1]), "F has shape \\(2, 3\\)"),
        (lambda: Rotor(shaft()).run_time_response(0.0, np.zeros((3, 16)), [0, 1, 3]), "not evenly spaced"),
        (lambda: Rotor(shaft()).run_freq_response([1.0], inputs=[99]), "degree of freedom 99"),
        (lambda: Rotor.from_ross(object()), "give a rotor of ROSS"),
        (lambda: DiskElement(0, -1.0, 0.0, 0.0), "none may be negative"),
        (lambda: DiskElement.from_geometry(0, steel, 0.1, 0.3, 0.2), "below o_d = 0.2 m"),
        (lambda: Rotor([]), "no elements"),
        (
            lambda: Rotor(shaft(), [DiskElement(4, 1.0, 0.0, 0.0)]),
            "disc at node 4, but the shaft has nodes 0 to 3",
        ),
        (lambda: Rotor(shaft(), [], [BearingElement(-1, 1e6, 0.0)]), "bearing at node -1"),
        (lambda: Rotor(shaft(), [], [BearingElement(1, 1e6, 0.0)] * 2), "2 bearings at node 1"),
        (lambda: Rotor([ShaftElement(0.1, 0.0, 0.02, n=0)] * 2), "span 0 overlap"),
        (lambda: Rotor([ShaftElement(L, i, o, n=0) for L, i, o in ((0.1, 0.0, 0.02), (0.2, 0.02, 0.03))]), "long"),
        (lambda: Rotor([ShaftElement(0.1, 0.0, 0.02, n=n) for n in (0, 2)]), "numbered \\[0, 2\\]"),
        (lambda: DiskElement(0, 1.0, 0.1, 0.1, offset=np.inf), "offset = inf"),
        (lambda: BearingElement(0, 1e6, 0.0, mxx=-1.0), "mxx = -1 must not be negative"),
        (lambda: Rotor([*shaft(1), ShaftElement(0.1, 0.0, 0.02, n=1)]), "leave all of them out"),
        (
            lambda: Rotor(shaft(), [], [BearingElement(1, 1e6, 0.0)]).run_static(),
            "free to fall or tilt \\(.*tilt about x",
        ),
        (lambda: Rotor(shaft()).run_unbalance_response(7, 1e-5, 0.0, 1.0), "unbalance at node 7"),
        (
            lambda: table_rotor().run_time_response(9.0, None, [0.0, 1e-3], unbalance=[Unbalance(7, 1e-5)]),
            "unbalance at node 7",
        ),
        (lambda: modal_reduction(Rotor(shaft()), {9: 4e6}, 2, 0.0), "reduction: node 9"),
        (lambda: modal_reduction(Rotor(shaft()), {1: 4e6}, 9, 0.0), "9 modes a plane"),
        (lambda: modal_reduction(Rotor(shaft()), {1: 4e6}, 2, 0.0).shape(4), "node 4 is not among 0 to 3"),
    ],
)
def test_impossible_input_is_refused_with_a_sentence_that_names_it(build, sentence):
    with pytest.raises(ValueError, match=sentence):
        build()
