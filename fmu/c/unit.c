/* Life of a unit: creation, equilibrium, steps. The physics is in rotorsim_serve, compiled from the plant's kernels. */
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SETTLE = 0, ADVANCE = 1, READ_OUT = 2 };
enum { BEYOND_STROKE = -1, NO_LIFT_OFF = -2, BROKEN = -99 };

#define ARRAY(data, n) NULL, NULL, (n), 8, (data), (n), 8
#define ROW(data, n) NULL, NULL, (n), 8, (data), 1, (n), 8 * (n), 8
#define ARRAY_OF(type) void *, void *, int64_t, int64_t, type *, int64_t, int64_t

extern int32_t rotorsim_serve(int64_t *result, void **error, int64_t task, ARRAY_OF(double), ARRAY_OF(double),
                              ARRAY_OF(const int64_t), double *parameters, ARRAY_OF(double), void *, void *, int64_t,
                              int64_t, double *, int64_t, int64_t, int64_t, int64_t, int64_t steps);

static int64_t serve(Unit *u, int64_t task, double inputs[6]) {
    int64_t result = 0;
    void *error = NULL;
    State *s = &u->s;
    int32_t code = rotorsim_serve(&result, &error, task, ARRAY(s->w, N_W), ARRAY(u->initial, N_W),
                                  ARRAY(indices, N_IX), s->parameters, ARRAY(inputs, 6), ROW(s->outputs, N_OUT), STEPS);
    return code == 0 ? result : BROKEN;
}

Outcome unit_fail(Unit *u, Outcome outcome, const char *format, ...) {
    char text[500];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    u->say(u, outcome, "logStatusError", text);
    return outcome;
}

static void expand_initial(double *w) {
    for (int r = 0; r < N_RUNS; r++)
        for (int32_t k = 0; k < initial_runs[r].count; k++) *w++ = initial_runs[r].value;
}

void unit_reset(Unit *u) {
    State *s = &u->s;
    memset(s, 0, sizeof *s);
    memcpy(s->magic, MAGIC, sizeof s->magic);
    memcpy(s->hash, MODEL_HASH, strlen(MODEL_HASH));
    s->size = sizeof *s;
    memcpy(s->parameters, initial_parameters, sizeof s->parameters);
    for (uint32_t i = 0; i < N_VARIABLES; i++) {
        if (variables[i].store == INPUT) s->inputs[variables[i].index] = variables[i].value;
        if (variables[i].store == SEED) s->seed = variables[i].value;
    }
    u->s.phase = CREATED;
    u->has_refused = false;
}

Unit *unit_create(const char *name, const char *token, bool logging, void *environment, void *callback,
                  void (*say)(Unit *, Outcome, const char *, const char *)) {
    Unit *u = calloc(1, sizeof *u);
    if (!u) return NULL;
    const char *own = name ? name : "";
    u->name = calloc(strlen(own) + 1, 1);
    if (!u->name) {
        free(u);
        return NULL;
    }
    memcpy(u->name, own, strlen(own));
    u->environment = environment;
    u->callback = callback;
    u->say = say;
    u->logging = logging;
    if (!token || strcmp(token, TOKEN) != 0) {
        unit_fail(u, FAILED, "the token '%s' is not that of this unit, '%s'; take it from modelDescription.xml",
                  token ? token : "", TOKEN);
        unit_free(u);
        return NULL;
    }
    expand_initial(u->initial);
    unit_reset(u);
    return u;
}

void unit_free(Unit *u) {
    if (!u) return;
    free(u->name);
    free(u);
}

double unit_time(const Unit *u) { return u->s.start + (double)u->s.count * SAMPLE; }

Outcome unit_start_at(Unit *u, double time) {
    if (!isfinite(time)) return unit_fail(u, FAILED, "start time = %g s: not a time; give a number", time);
    u->s.start = time;
    return OK;
}

/* A sentence about an input that makes no sense, or OK. */
static Outcome check_inputs(Unit *u) {
    for (uint32_t i = 0; i < N_VARIABLES; i++) {
        const Variable *v = &variables[i];
        if (v->store != INPUT) continue;
        double value = u->s.inputs[v->index];
        if (!isfinite(value)) return unit_fail(u, FAILED, "%s = %g %s: not a number; check the signal", v->name, value, v->unit);
        if (value < v->low || value > v->high)
            return unit_fail(u, FAILED, "%s = %g %s: outside %g to %g; give a value in between", v->name, value, v->unit,
                             v->low, v->high);
    }
    return OK;
}

static void hold_inputs(const Unit *u, double row[6]) {
    static const int places[6] = INPUT_PLACES;
    for (int k = 0; k < 6; k++) row[k] = places[k] >= 0 ? u->s.inputs[places[k]] : 0.0;
    row[1] += AMBIENT;
}

bool unit_initialise(Unit *u) {
    double row[6];
    if (u->s.settled) return true;
    if (u->has_refused) {
        unit_fail(u, FAILED, "%s", u->refusal);
        return false;
    }
    if (check_inputs(u) != OK) return false;
    hold_inputs(u, row);
    int64_t status = serve(u, SETTLE, row);
    if (status == BEYOND_STROKE) {
        unit_fail(u, FAILED, "the pins' bias is beyond the stroke of the actuators; change injection.pin_bias or "
                             "actuators.sensitivity");
    } else if (status == NO_LIFT_OFF) {
        unit_fail(u, FAILED, "no lift-off: at %.3g MPa gauge and %.0f rpm the film does not carry the %.1f N on it; %s",
                  (row[1] - AMBIENT) / 1e6, row[0] * 9.549296585513721,
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

/* Samples in a communication step, 0 after a sentence about one that is refused. */
static int64_t samples_in(Unit *u, double now, double length, Outcome *outcome) {
    double n = round(length / SAMPLE);
    if (!isfinite(now) || fabs(now - unit_time(u)) > 0.01 * SAMPLE) {
        *outcome = unit_fail(u, FAILED, "communication point = %.9g s: the unit is at %.9g s; go on from there", now,
                             unit_time(u));
    } else if (!(length > 0.0) || !isfinite(length)) {
        *outcome = unit_fail(u, FAILED, "communication step = %g s: not a step; give a multiple of %g s", length, SAMPLE);
    } else if (n < 1.0 || n > 1e9 || fabs(length / SAMPLE - n) > 1e-6) {
        *outcome = unit_fail(u, DISCARD, "communication step = %.9g s: not a multiple of %g s; give e.g. %g s", length,
                             SAMPLE, SAMPLE * (n < 1.0 ? 1.0 : n));
    } else {
        *outcome = check_inputs(u);
    }
    return *outcome == OK ? (int64_t)n : 0;
}

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    Outcome outcome;
    double row[6];
    State *s = &u->s;
    int64_t n = samples_in(u, now, length, &outcome), touched = 0;
    double from = s->w[W_COMMAND];
    s->event = 0;
    for (int64_t k = 0; k < n && !(s->event && u->early_return); k++) {
        hold_inputs(u, row);
        if (k + 1 < n) row[0] = from + (row[0] - from) * ((double)(k + 1) / (double)n);
        if (s->inputs[DRIVE_ON] == 0.0) row[0] = NAN;
        if (serve(u, ADVANCE, row) < 0) {
            outcome = unit_fail(u, FAILED, "no solution of the step at t = %.4f s, %.0f rpm; export with a smaller "
                                           "solver.time_step or a finer grid",
                                unit_time(u), s->w[W_SPEED] * 9.549296585513721);
            break;
        }
        s->count++;
        if (TOUCHDOWN >= 0) touched |= s->outputs[TOUCHDOWN] != 0.0;
        if (touched != s->touching) s->event = 1;
    }
    if (outcome == OK && n) {
        if (TOUCHDOWN >= 0) s->outputs[TOUCHDOWN] = (double)touched;
        if (s->event && u->logging)
            u->say(u, OK, "logEvents", touched ? "the journal touches its sleeve" : "the journal is free again");
        s->touching = touched;
    }
    *reached = unit_time(u);
    return outcome;
}
