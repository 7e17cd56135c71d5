/* The plant in a unit: equilibrium and steps, and where its physics end. The physics is in rotorsim_serve, compiled from the plant's kernels. */
#include <math.h>
#include <string.h>

#include "unit.h"

enum { SETTLE = 0, ADVANCE = 1, READ_OUT = 2 };
enum { BEYOND_STROKE = -1, NO_LIFT_OFF = -2, BROKEN = -99 };

#define ARRAY(data, n) NULL, NULL, (n), 8, (data), (n), 8
#define ROW(data, n) NULL, NULL, (n), 8, (data), 1, (n), 8 * (n), 8
#define ARRAY_OF(type) void *, void *, int64_t, int64_t, type *, int64_t, int64_t

extern int32_t rotorsim_serve(int64_t *result, void **error, int64_t task, ARRAY_OF(double), ARRAY_OF(double),
                              ARRAY_OF(const int64_t), double *parameters, ARRAY_OF(double), void *, void *, int64_t,
                              int64_t, double *, int64_t, int64_t, int64_t, int64_t, int64_t steps);

static double formula(const Entries *e, double x) {
    for (const Operation *o = &operations[e->first]; o < &operations[e->first + e->n_operations]; o++) {
        switch (o->kind) {
            case TIMES: x = x * o->a; break;
            case BY: x = x / o->a; break;
            case UNDER: x = o->a / x; break;
            case PLUS: x = x + o->a; break;
            case ROOT: x = sqrt(x); break;
            case VISCOSITY: x = 1.0 + x, x = x * sqrt(x) * (1.0 + o->a) / (x + o->a); break;
        }
    }
    return x;
}

/* Number of the machine that the values chosen from lists stand for. */
static int32_t variant(const Unit *u) {
    int32_t number = 0;
    for (const Choice *c = choices; c < &choices[N_CHOICES]; c++) {
        int32_t k = 0;
        while (k + 1 < c->count && u->s.turned[c->turned] != chosen[c->first + k]) k++;
        number = number * c->count + k;
    }
    return number;
}

/* What follows from the numbers set, in the workspace at the start or in the parameters. A parameter that was set itself
   keeps its value. */
static void turn(Unit *u, bool in_record, double *target) {
    const Variant *own = &variants[variant(u)];
    for (const Entries *e = &entries[own->first]; e < &entries[own->first + own->count]; e++) {
        if (e->in_record != in_record) continue;
        double x = formula(e, u->s.turned[e->turned]);
        for (int32_t k = e->place; k < e->place + e->count; k++)
            if (!in_record || u->s.parameters[k] == initial_parameters[k]) target[k] = e->least ? fmin(target[k], x) : x;
    }
}

/* Parameters as the kernels take them, after any of them was set, or written at its address. */
static void gather(Unit *u) {
    if (u->has_gathered && memcmp(u->gathered, u->s.parameters, sizeof u->gathered) == 0) return;
    memcpy(u->gathered, u->s.parameters, sizeof u->gathered);
    u->has_gathered = true;
    const double *own = &initial_parameters[variant(u) * N_P], *set = u->s.parameters;
    for (int k = 0; k < N_P; k++) u->effective[k] = set[k] == initial_parameters[k] ? own[k] : set[k];
    turn(u, true, u->effective);
}

static double ambient(const Unit *u) { return P_AMBIENT < 0 ? AMBIENT : u->effective[P_AMBIENT < 0 ? 0 : P_AMBIENT]; }

static int64_t serve(Unit *u, int64_t task, double inputs[6]) {
    int64_t result = 0;
    void *error = NULL;
    State *s = &u->s;
    int32_t code = rotorsim_serve(&result, &error, task, ARRAY(s->w, N_W), ARRAY(u->initial, N_W),
                                  ARRAY(&indices[variant(u) * N_IX], N_IX), u->effective, ARRAY(inputs, 6), ROW(s->outputs, N_OUT), STEPS);
    return code == 0 ? result : BROKEN;
}

static bool hold_inputs(Unit *u, double row[6]) {
    static const int places[6] = INPUT_PLACES;
    for (int k = 0; k < 6; k++) row[k] = places[k] >= 0 ? u->s.inputs[places[k]] : 0.0;
    double gauge = row[1];
    row[1] += ambient(u);
    if (row[1] > 0.0) return true;
    unit_fail(u, FAILED, "injection.pressure = %g Pa: below vacuum at gas.ambient_pressure = %g Pa; give more", gauge,
              ambient(u));
    return false;
}

bool unit_initialise(Unit *u) {
    double row[6];
    if (u->s.settled) return true;
    if (!unit_may_begin(u)) return false;
    gather(u);
    unit_expand(u, &initial_runs[variants[variant(u)].run]);
    turn(u, false, u->initial);
    if (!hold_inputs(u, row)) return false;
    int64_t status = serve(u, SETTLE, row);
    if (status == BEYOND_STROKE) {
        unit_fail(u, FAILED, "the pins' bias is beyond the stroke of the actuators; change injection.pin_bias or "
                             "actuators.sensitivity");
    } else if (status == NO_LIFT_OFF) {
        unit_fail(u, FAILED, "no lift-off: at %.3g MPa gauge and %.0f rpm the film does not carry the %.1f N on it; %s",
                  (row[1] - ambient(u)) / 1e6, row[0] * TO_RPM,
                  hypot(u->s.w[W_LOAD], u->s.w[W_LOAD + 1]),
                  N_INJ ? "raise injection.pressure" : "start at a higher shaft.speed_ref");
    } else if (status < 0) {
        unit_fail(u, FAILED, "the equilibrium cannot be computed; check the parameters");
    } else {
        u->s.w[W_SEED] = u->s.seed;
        serve(u, READ_OUT, row);
        u->s.settled = 1;
    }
    return u->s.settled;
}

/* Outputs of an equilibrium, or of a state that was computed elsewhere, which are not in it. */
bool unit_refresh(Unit *u) {
    double row[6];
    if (u->s.settled || u->s.phase == INITIALISING) return unit_initialise(u);
    gather(u);
    if (!hold_inputs(u, row)) return false;
    serve(u, READ_OUT, row);
    u->s.settled = 1;
    return true;
}

void unit_tick(Unit *u) { (void)u; }

bool unit_film_pressure(Unit *u, double *values) {
    for (int k = 0; k < N_PRESSURE; k++)
        values[k] = 0.5 * (u->s.w[pressure_nodes[k][1]] + u->s.w[pressure_nodes[k][0]]);
    return true;
}

static double warmest(const State *s) {
    double rise = 0.0, speed = s->w[W_SPEED];
    double cold = TURNED_TEMPERATURE < 0 ? TEMPERATURE : s->turned[TURNED_TEMPERATURE < 0 ? 0 : TURNED_TEMPERATURE];
    for (int k = 0; k < N_RISES; k++) rise = fmax(rise, s->outputs[FIRST_RISE + k]);
    return cold + RISE + HEATING * speed * speed + rise;
}

/* Depth [m] in its sleeve at which a journal that contact pushes back ends a run: the largest clearance. */
static double deepest(const Unit *u) {
    double clearance = 0.0;
    for (int f = 0; f < N_FILMS * PUSHED; f++) clearance = fmax(clearance, u->effective[P_CLEARANCE + FILM_RECORD * f]);
    return clearance;
}

/* A sentence where the physics of the plant end: what follows would be numbers without a meaning. */
static Outcome check_physics(Unit *u) {
    const State *s = &u->s;
    for (int k = 0; k < N_OUT; k++)
        if (!isfinite(s->outputs[k]))
            return unit_fail(u, FAILED, "t = %.4f s, %.0f rpm: an output is not a number any more; check the inputs",
                             unit_time(u), s->w[W_SPEED] * TO_RPM);
    if (H_MIN >= 0 && s->outputs[H_MIN] < -deepest(u))
        return unit_fail(u, FAILED, "film.h_min = %.4g um at t = %.4f s, %.0f rpm: the journal is inside its sleeve, "
                                    "deeper than %g um; %s", 1e6 * s->outputs[H_MIN], unit_time(u),
                         s->w[W_SPEED] * TO_RPM, 1e6 * deepest(u),
                         deepest(u) > 0.0 ? "lower the speed or the load" : "add [effects.contact] to the machine");
    if (HOTTEST < 1e9 && warmest(s) > HOTTEST)
        return unit_fail(u, FAILED, "%.4g degC in a film at t = %.4f s, %.0f rpm: above limits.temperature %.4g degC; "
                                    "lower the speed or raise it", warmest(s) - 273.15, unit_time(u),
                         s->w[W_SPEED] * TO_RPM, HOTTEST - 273.15);
    return OK;
}

/* One sample; where work is bounded, with the outputs about it. */
static int64_t advance(Unit *u, double row[6]) {
#if BOUNDED
    double *w = u->s.w, *work = u->s.outputs + N_OUT - 3, before = WORK(w);
    w[W_LEFT] = 0.0;
    int64_t status = serve(u, ADVANCE, row);
    work[0] = w[W_LEFT], work[1] = WORK(w) - before, work[2] = w[W_OVERRUNS];
    return status;
#else
    return serve(u, ADVANCE, row);
#endif
}

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    Outcome outcome;
    double row[6];
    State *s = &u->s;
    int64_t n = unit_samples_in(u, now, length, &outcome), touched = 0;
    if (n && !unit_refresh(u)) n = 0, outcome = FAILED;
    double from = s->w[W_COMMAND];
    s->event = 0;
    gather(u);
    for (int64_t k = 0; k < n && !(s->event && u->early_return); k++) {
        if (!hold_inputs(u, row)) {
            outcome = FAILED;
            break;
        }
        if (k + 1 < n) row[0] = from + (row[0] - from) * ((double)(k + 1) / (double)n);
        if (s->inputs[DRIVE_ON] == 0.0) row[0] = NAN;
        if (advance(u, row) < 0) {
            outcome = unit_fail(u, FAILED, "no solution of the step at t = %.4f s, %.0f rpm; export with a smaller "
                                           "solver.time_step or a finer grid",
                                unit_time(u), s->w[W_SPEED] * TO_RPM);
            break;
        }
        s->count++;
        if (check_physics(u) == FAILED) {
            outcome = FAILED;
            break;
        }
        if (TOUCHDOWN >= 0) touched |= s->outputs[TOUCHDOWN] != 0.0;
        if (touched != s->touching) s->event = 1;
        if (unit_ends_early(u, n - k - 1)) break;
    }
    if (outcome != FAILED && n) {
        if (TOUCHDOWN >= 0) s->outputs[TOUCHDOWN] = (double)touched;
        if (s->event && u->logging)
            u->log_message(u, OK, "logEvents", touched ? "the journal touches its sleeve" : "the journal is free again");
        s->touching = touched;
    }
    *reached = unit_time(u);
    return outcome;
}
