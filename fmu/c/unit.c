/* Life of a unit, whatever it holds: creation, time, what inputs and communication steps are refused. */
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

Outcome unit_set_time(Unit *u, double time) {
    u->s.count = 0;
    return unit_start_at(u, time);
}

bool unit_set_states(Unit *u, const double x[], size_t n) {
    for (size_t k = 0; k < n; k++)
        if (!isfinite(x[k])) {
            unit_fail(u, FAILED, "state %d = %g: not a number; take a smaller step", (int)k + 1, x[k]);
            return false;
        }
    if (n != N_STATES) return false;
    memcpy(u->s.w, x, n * sizeof *x);
    return true;
}

/* A sentence about an input that makes no sense, or OK. */
Outcome unit_check_inputs(Unit *u) {
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

/* Samples in a communication step, 0 after a sentence about one that is refused. */
int64_t unit_samples_in(Unit *u, double now, double length, Outcome *outcome) {
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
        *outcome = unit_check_inputs(u);
    }
    return *outcome == OK ? (int64_t)n : 0;
}

