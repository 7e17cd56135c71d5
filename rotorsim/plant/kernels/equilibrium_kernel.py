r"""Static equilibrium of rotor, film and plena.

With K_s = K + k_n Phi_b' Phi_b (k_n the nominal springs, which make K_s regular), H = (Phi_b K_s^-1 Phi_b')^-1 and
X_f = Phi_b K_s^-1 f, the journals' equation is  (H - k_n) X - F(X) = H X_f:  exact, whatever k_n. The films are settled
by pseudo-transient continuation (reynolds.transient). Forces that depend on the motion (a bearing's clearance, a rub)
enter with their tangent, which is updated until the rotor rests: first without them, then with it. A bearing within
its clearance carries nothing, and its tangent leads far off: such a pass is repeated with the rotor held to where it
is, by a share of its own stiffness that fades with every pass that gets through (the proximal point method, Rockafellar
1976). A supply line is settled together with the flow it carries; where the film does not carry with the flow of the
last pass, half way back to the one before is tried.

This file is a template as `step` is.

Cites: kelley_1998, rockafellar_1976.
"""

from __future__ import annotations

from reynolds.film import force, stored
from reynolds.grid import CONVERGENCE
from reynolds.jit import inlined, kernel
from reynolds.transient import (
    FIRST_STEP,
    GROWTH,
    LAST_STEP,
    MOST_STEPS,
    RETREAT,
    ROUGH,
    SHARP,
    begin_pseudo_film,
    rest_foil,
    take_back,
)
from rotorsim.plant.kernels.effect_calls import (
    FILM,
    RIG,
    ROTOR,
    film_constants,
    first_forces,
    motion_tangent,
    rotating_damping,
    steady_forces,
)
from rotorsim.plant.kernels.films import film_part, least_gap
from rotorsim.plant.kernels.injectors import flow_of_injectors
from rotorsim.plant.kernels.modal_rotor import add_force, add_tables, factor_matrix, project, solve_matrix
from rotorsim.plant.kernels.sample import prepare, warm_films
from rotorsim.plant.kernels.step import factorise, solve_film, touch

SLOWER = 1.5
"""Growth of the pseudo-steps over strips of foil, which the film bends as the rotor comes down."""
DAMPING = 2e3
"""Damper [N s/m] on the journal while it settles."""
MOST_PASSES = 120
STEADY = 1e-7
"""Change of a temperature [K] at which it rests."""
LEAST_FLOW = 1e-14
"""Change of flow [kg/s] at which a supply line rests: its droop is below 1e-4 Pa."""
LONGEST = 10.0
"""Longest step of a pass, in displacements of the rotor before it."""
HOLD, FIRMER, FIRMEST, LOOSER, FAINT = 1.0, 4.0, 1e6, 0.25, 1e-6
"""Share of the rotor's stiffness that holds it first, its growth, the last one tried, its fading, what is let go."""
SETTLED, BEYOND_STROKE, NO_LIFT_OFF, RESTLESS = 1, -1, -2, -3
"""Codes of `settle`: an actuator cannot hold its pin at the bias; the film does not carry the rotor; supply line or
motion-dependent forces prevent convergence."""


@kernel
def static_terms(w, P, speed, moving):
    """Steady modal force into f, stiffness into KT; `moving`: motion-dependent forces too, linearised at rest at q."""
    for e in range(ROTOR.n * ROTOR.n):
        w[ROTOR.KT + e] = w[ROTOR.K + e]
    factor = speed * rotating_damping(P)
    if factor != 0.0:
        for e in range(ROTOR.n * ROTOR.n):
            w[ROTOR.KT + e] += factor * w[ROTOR.N + e]
    if ROTOR.n_tables > 0:
        add_tables(w, ROTOR, speed, 0, 1.0, ROTOR.KT)
    for m in range(ROTOR.n):
        w[ROTOR.f + m] = 0.0
    steady_forces(w, P, speed)
    if moving:
        motion_tangent(w, P, speed)


@inlined
def narrowest_of(w, P, f):
    """Smallest distance [m] between journal f and its sleeve where they stand."""
    v = film_part(w, f)
    return least_gap(w, P, f, v[FILM.journal], v[FILM.journal + 1])


@kernel
def narrowest(w, P):
    """Smallest distance [m] between journals and sleeves where they stand."""
    low = narrowest_of(w, P, 0)
    for f in range(1, ROTOR.n_films):
        low = min(low, narrowest_of(w, P, f))
    return low


@inlined
def stand_apart(w, P):
    """Whether every film is thicker than twice its least; written so that NaN does not count as a gap."""
    apart = True
    for f in range(ROTOR.n_films):
        apart = apart and narrowest_of(w, P, f) > 2.0 * film_constants(P, f).h_min
    return apart


@inlined
def nominal_springs(w, P):
    """K_s into T: the rotor's stiffness with the nominal spring of every film."""
    n = ROTOR.n
    for c in range(n):
        for r in range(n):
            value = w[ROTOR.KT + c * n + r]
            for f in range(ROTOR.n_films):
                B = ROTOR.journal + 2 * n * f
                value = value + P.nominal_stiffness[f] * (w[B + r] * w[B + c] + w[B + n + r] * w[B + n + c])
            w[ROTOR.T + c * n + r] = value


@inlined
def condense_one(w, P):
    """static_a and static_rhs of a single journal, from the modal force solved in v_rhs."""
    n = ROTOR.n
    B = ROTOR.journal
    k = P.nominal_stiffness[0]
    for m in range(n):
        w[ROTOR.q_mid + m] = w[B + m]
        w[ROTOR.q_rhs + m] = w[B + n + m]
    solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.q_mid, n)
    solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.q_rhs, n)
    cxx, cyx = project(w, ROTOR, B, ROTOR.q_mid)
    cxy, cyy = project(w, ROTOR, B, ROTOR.q_rhs)
    x, y = project(w, ROTOR, B, ROTOR.v_rhs)
    inverse = 1.0 / (cxx * cyy - cxy * cyx)
    hxx, hxy, hyx, hyy = cyy * inverse, -cxy * inverse, -cyx * inverse, cxx * inverse
    a = ROTOR.static_a
    w[a], w[a + 1], w[a + 2], w[a + 3] = hxx - k, hxy, hyx, hyy - k
    w[ROTOR.static_rhs], w[ROTOR.static_rhs + 1] = hxx * x + hxy * y, hyx * x + hyy * y


@inlined
def condense_journals(w, P):
    """static_a and static_rhs of several journals, from the modal force solved in v_rhs.

    With C the compliance of all journals on K_s, H X = H X_f is solved for X_f, and H = C^-1 column by column.
    """
    n, m = ROTOR.n, 2 * ROTOR.n_films
    for col in range(m):
        for e in range(n):
            w[ROTOR.q_mid + e] = w[ROTOR.journal + col * n + e]
        solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.q_mid, n)
        for row in range(m):
            value = 0.0
            for e in range(n):
                value += w[ROTOR.journal + row * n + e] * w[ROTOR.q_mid + e]
            w[ROTOR.journal_a + col * m + row] = value
    factor_matrix(w, ROTOR.journal_a, ROTOR.journal_rhs, m)
    for col in range(m):
        for row in range(m):
            w[ROTOR.compliance + row] = 1.0 if row == col else 0.0
        solve_matrix(w, ROTOR.journal_a, ROTOR.journal_rhs, ROTOR.compliance, m)
        for row in range(m):
            w[ROTOR.static_a + m * row + col] = w[ROTOR.compliance + row]
    for row in range(m):
        value = 0.0
        for e in range(n):
            value += w[ROTOR.journal + row * n + e] * w[ROTOR.v_rhs + e]
        w[ROTOR.static_rhs + row] = value
    solve_matrix(w, ROTOR.journal_a, ROTOR.journal_rhs, ROTOR.static_rhs, m)
    for row in range(m):
        w[ROTOR.static_a + m * row + row] -= P.nominal_stiffness[row // 2]


@inlined
def journal_statics(w, P):
    """Condense the rotor to its journals: static_a and static_rhs; the factors of K_s stay in T, v_mid."""
    n, m = ROTOR.n, 2 * ROTOR.n_films
    nominal_springs(w, P)
    factor_matrix(w, ROTOR.T, ROTOR.v_mid, n)
    for e in range(n):
        w[ROTOR.v_rhs + e] = w[ROTOR.f + e]
    solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.v_rhs, n)
    if ROTOR.n_films == 1:
        condense_one(w, P)
    else:
        condense_journals(w, P)
    for e in range(m * m):
        w[ROTOR.compliance + e] = 0.0
    for row in range(m):
        w[ROTOR.compliance + m * row + row] = 1.0


@inlined
def begin_pseudo_steps(w, P, iadt):
    """Right-hand sides of an implicit Euler step of 1/iadt from the present state, for all films and journals."""
    m = 2 * ROTOR.n_films
    for f in range(ROTOR.n_films):
        begin_pseudo_film(film_part(w, f), film_constants(P, f), FILM)
    for e in range(m * m):
        w[ROTOR.journal_a + e] = w[ROTOR.static_a + e]
    for row in range(m):
        place = film_part(w, row // 2)[FILM.journal + row % 2]
        w[ROTOR.journal_a + m * row + row] += DAMPING * iadt
        w[ROTOR.journal_rhs + row] = w[ROTOR.static_rhs + row] + DAMPING * iadt * place


@inlined
def keep_films(w):
    """Note pressures, plena and journals before a step that may fail."""
    for f in range(ROTOR.n_films):
        v, s = film_part(w, f), ROTOR.journal_before + 2 * f
        for k in range(FILM.length):
            v[FILM.p_1 + k] = v[FILM.p + k]
        for k in range(FILM.n_inj):
            v[FILM.plenum_1 + k] = v[FILM.plenum + k]
        w[s], w[s + 1] = v[FILM.journal], v[FILM.journal + 1]


@inlined
def restore_films(w):
    """Take a step that failed back."""
    for f in range(ROTOR.n_films):
        v, s = film_part(w, f), ROTOR.journal_before + 2 * f
        take_back(v, FILM)
        v[FILM.journal], v[FILM.journal + 1] = w[s], w[s + 1]


@inlined
def rest_films(w):
    """Give the films a past at rest and no rates."""
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        for k in range(FILM.length):
            v[FILM.p_1 + k] = v[FILM.p_2 + k] = v[FILM.p_3 + k] = v[FILM.p + k]
            v[FILM.m_old + k] = stored(v, FILM, k)
            v[FILM.rate + k] = 0.0
        if FILM.foil == 1:
            rest_foil(v, FILM)
        for k in range(FILM.n_inj):
            plenum = v[FILM.plenum + k]
            v[FILM.plenum_1 + k] = v[FILM.plenum_2 + k] = v[FILM.plenum_3 + k] = v[FILM.plenum_old + k] = plenum
        for k in range(CONVERGENCE):
            v[FILM.convergence + k] = 0.0


@inlined
def lift_rotor(w, P):
    """Add the forces of the films, and of the nominal springs that K_s has too much, to q."""
    for f in range(ROTOR.n_films):
        v, k = film_part(w, f), P.nominal_stiffness[f]
        fx, fy = v[FILM.force] + k * v[FILM.journal], v[FILM.force + 1] + k * v[FILM.journal + 1]
        add_force(w, ROTOR, ROTOR.journal + 2 * ROTOR.n * f, fx, fy, ROTOR.q)


@inlined
def place_rotor(w, P):
    """Put the rotor where steady forces and film hold it, by the factors of its stiffness."""
    for m in range(ROTOR.n):
        w[ROTOR.q + m] = w[ROTOR.f + m]
    lift_rotor(w, P)
    solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.q, ROTOR.n)


@inlined
def copy_displacement(w, source, target):
    """Copy one displacement of the rotor over another."""
    for m in range(ROTOR.n):
        w[target + m] = w[source + m]


@inlined
def free_statics(w):
    """The factors of K in T, v_mid for a rotor without film."""
    for e in range(ROTOR.n * ROTOR.n):
        w[ROTOR.T + e] = w[ROTOR.KT + e]
    factor_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.n)


@inlined
def restart(w, initial):
    """Everything as it is before any state is put in, but temperatures and displacement, which is kept in q_old too."""
    for k in range(ROTOR.q):
        w[k] = initial[k]
    for k in range(ROTOR.q + ROTOR.n, RIG.heat):
        w[k] = initial[k]
    for k in range(RIG.heat + 3 * ROTOR.n_films, initial.shape[0]):
        w[k] = initial[k]
    copy_displacement(w, ROTOR.q, ROTOR.q_old)


@inlined
def hold_rotor(w, share):
    """Add a spring, `share` of the rotor's stiffness, that is relaxed where the rotor was."""
    for r in range(ROTOR.n):
        for c in range(ROTOR.n):
            k = share * w[ROTOR.K + c * ROTOR.n + r]
            w[ROTOR.KT + c * ROTOR.n + r] += k
            w[ROTOR.f + r] += k * w[ROTOR.q_old + c]


@inlined
def led_off(w):
    """Whether a pass led far off, as it does where the tangent is almost singular."""
    moved, size = 0.0, 0.0
    for m in range(ROTOR.n):
        moved = max(moved, abs(w[ROTOR.q + m] - w[ROTOR.q_old + m]))
        size = max(size, abs(w[ROTOR.q_old + m]))
    # written so that a step that is not a number leads off
    return size > 0.0 and not moved <= LONGEST * size


@inlined
def rests(w, P, flow, before, warmer):
    """Whether the last pass moved neither rotor nor flow in the supply line, nor the temperatures, by `warmer` [K]."""
    moved, size = 0.0, 0.0
    for m in range(ROTOR.n):
        moved = max(moved, abs(w[ROTOR.q + m] - w[ROTOR.q_old + m]))
        size = max(size, abs(w[ROTOR.q + m]))
    still = (moved <= 1e-9 * size or RIG.n_motion == 0) and warmer <= STEADY
    # gas may flow back into the line, and none at all flows at ambient pressure
    return still and (abs(flow - before) <= max(1e-9 * abs(flow), LEAST_FLOW) or RIG.n_supply == 0)


@kernel
def march_films(w, ix, P, speed, near):
    """March films and journals to rest in growing pseudo-steps, as `settle_film` does; whether the films then carry.

    Films that are `near` their equilibrium begin with the last step, which is Newton's on the steady equations.
    """
    step, solved, last, converged = LAST_STEP if near else FIRST_STEP, ROUGH, False, False
    for _ in range(MOST_STEPS):
        last = step >= LAST_STEP
        iadt, tolerance = (0.0, SHARP) if last else (1.0 / step, solved)
        keep_films(w)
        begin_pseudo_steps(w, P, iadt)
        factorise(w, ix, P, speed, iadt)
        converged = solve_film(w, ix, P, speed, iadt, tolerance, True) > 0
        for f in range(ROTOR.n_films):
            force(film_part(w, f), FILM)
        if last and converged:
            break
        if converged:
            step *= GROWTH if FILM.strips == 0 else SLOWER
        else:
            restore_films(w)
            step *= RETREAT
            solved = SHARP if last else solved
    return last and converged and stand_apart(w, P)


@inlined
def lean_on_sleeves(w, P):
    """Contact of the journals where they stand, and a spring that is relaxed there, into f and KT."""
    n = ROTOR.n
    for f in range(ROTOR.n_films):
        v, s, B, k = film_part(w, f), ROTOR.journal_start + 2 * f, ROTOR.journal + 2 * n * f, P.nominal_stiffness[f]
        x, y = project(w, ROTOR, B, ROTOR.q)
        v[FILM.journal], v[FILM.journal + 1] = x, y
        w[s], w[s + 1] = x, y
        fx, fy, kxx, kxy, kyx, kyy, _ = touch(w, P, f, 0.0, 1.0)
        kxx, kyy = kxx + k, kyy + k
        add_force(w, ROTOR, B, fx + kxx * x + kxy * y, fy + kyx * x + kyy * y, ROTOR.f)
        for c in range(n):
            a, b = kxx * w[B + c] + kxy * w[B + n + c], kyx * w[B + c] + kyy * w[B + n + c]
            for r in range(n):
                w[ROTOR.KT + c * n + r] += w[B + r] * a + w[B + n + r] * b


@kernel
def stand(w, initial, P, supply):
    """Fill w with the shaft at standstill on its sleeves, in films without supply [Pa, absolute]; whether it rests.

    Each pass solves with the contacts linearised and with the nominal springs relaxed where the journals are (the
    proximal point method), so that a journal which touches nothing yet falls instead of flying.
    """
    for k in range(initial.shape[0]):
        w[k] = initial[k]
    prepare(w, P, 0.0, supply, 0.0)
    rested = False
    for _ in range(MOST_PASSES * ROTOR.n_films):
        copy_displacement(w, ROTOR.q, ROTOR.q_old)
        static_terms(w, P, 0.0, True)
        lean_on_sleeves(w, P)
        free_statics(w)
        copy_displacement(w, ROTOR.f, ROTOR.q)
        solve_matrix(w, ROTOR.T, ROTOR.v_mid, ROTOR.q, ROTOR.n)
        moved, size = 0.0, 0.0
        for m in range(ROTOR.n):
            moved = max(moved, abs(w[ROTOR.q + m] - w[ROTOR.q_old + m]))
            size = max(size, abs(w[ROTOR.q + m]))
        rested = moved <= 1e-12 * size
        if rested:
            break
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        v[FILM.journal], v[FILM.journal + 1] = project(w, ROTOR, ROTOR.journal + 2 * ROTOR.n * f, ROTOR.q)
        begin_pseudo_film(v, film_constants(P, f), FILM)
        force(v, FILM)
    rest_films(w)
    copy_displacement(w, ROTOR.q, ROTOR.q_old)
    first_forces(w, P, 0.0)
    return rested


@kernel
def settle(w, initial, ix, P, speed, supply, near):
    """Fill w with the machine at rest in equilibrium at `speed` [rad/s] and supply [Pa, absolute].

    `initial` is the workspace before any state is put into it, or an equilibrium of the machine that is `near`. Returns
    SETTLED or why not.
    """
    flow, through, hold, fallen = 0.0, 0.0, 0.0, False
    for m in range(ROTOR.n):
        w[ROTOR.q + m] = 0.0
    for m in range(3 * ROTOR.n_films):
        w[RIG.heat + m] = 0.0
    for number in range(MOST_PASSES):
        restart(w, initial)
        if prepare(w, P, speed, supply, flow) == 0:
            return BEYOND_STROKE
        static_terms(w, P, speed, number > 0)
        if hold > 0.0:
            hold_rotor(w, hold)
        carries = True
        if ROTOR.n_films == 0:
            free_statics(w)
        else:
            journal_statics(w, P)
            carries = march_films(w, ix, P, speed, near)
            if not carries and (number == 0 or (RIG.n_motion == 0 and RIG.n_supply == 0)):
                return NO_LIFT_OFF
            rest_films(w)
        place_rotor(w, P)
        if not carries or (RIG.n_motion > 0 and led_off(w)):
            fallen = fallen or not carries
            hold = max(HOLD, FIRMER * hold)
            if hold > FIRMEST:
                break
            flow = 0.5 * (through + flow)
            copy_displacement(w, ROTOR.q_old, ROTOR.q)
            continue
        hold = LOOSER * hold if hold > FAINT else 0.0
        through, flow = flow, flow_of_injectors(w, FILM.film_flow)
        warmer = warm_films(w, P, 0.0) if RIG.n_heat > 0 else 0.0
        if hold == 0.0 and rests(w, P, flow, through, warmer) and (number > 0 or RIG.n_motion == 0):
            copy_displacement(w, ROTOR.q, ROTOR.q_old)
            # the acceleration with which what turns with the shaft starts to act
            first_forces(w, P, speed)
            return SETTLED
    if not fallen:
        return RESTLESS
    # the load is reported without what held the rotor
    static_terms(w, P, speed, False)
    journal_statics(w, P)
    return NO_LIFT_OFF
