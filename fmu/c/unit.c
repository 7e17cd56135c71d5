/* Life of a unit, whatever it holds: creation, time, what inputs and communication steps are refused. */
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CACHE_LINE = 64 };

static Outcome tell(Unit *u, Outcome outcome, const char *category, const char *format, va_list arguments) {
    char text[600];
    vsnprintf(text, sizeof text, format, arguments);
    u->log_message(u, outcome, category, text);
    return outcome;
}

Outcome unit_tell(Unit *u, Outcome outcome, const char *category, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    tell(u, outcome, category, format, arguments);
    va_end(arguments);
    return outcome;
}

Outcome unit_fail(Unit *u, Outcome outcome, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    tell(u, outcome, "logStatusError", format, arguments);
    va_end(arguments);
    return outcome;
}

/* Debug logging of all categories, or of those given; what is refused or warned of is always logged. False after an
   unknown one. */
bool unit_log(Unit *u, bool on, size_t n, const char *const categories[]) {
    for (size_t k = 0; k < n; k++) {
        bool events = strcmp(categories[k], "logEvents") == 0;
        if (events) u->logging = on;
        if (!events && strcmp(categories[k], "logStatusError") != 0 && strcmp(categories[k], "logStatusWarning") != 0) {
            unit_fail(u, FAILED, "log category '%s': is not known; give logEvents, logStatusWarning or logStatusError",
                      categories[k]);
            return false;
        }
    }
    if (n == 0) u->logging = on;
    return true;
}

/* Whether a function belongs to what the instance was made for, model exchange or co-simulation. */
bool unit_exchanges(Unit *u, const char *function, bool exchange) {
    static const char *const kinds[] = {"co-simulation", "model exchange"};
    if (u && u->model_exchange == exchange) return true;
    if (u)
        unit_fail(u, FAILED, "%s: this instance is for %s; make one for %s", function, kinds[u->model_exchange],
                  kinds[exchange]);
    return false;
}

/* Whether a call brings as many values as it needs. */
bool unit_count(Unit *u, const char *function, size_t given, size_t wanted) {
    if (u && given == wanted) return true;
    if (u) unit_fail(u, FAILED, "%s: %u values; give %u", function, (unsigned)given, (unsigned)wanted);
    return false;
}

/* Fill the workspace before any state with runs of equal values. */
void unit_expand(Unit *u, const Run *first) {
    for (double *w = u->initial; w < u->initial + N_W; first++)
        for (int32_t k = 0; k < first->count; k++) *w++ = first->value;
}

void unit_reset(Unit *u) {
    State *s = &u->s;
    memset(s, 0, sizeof *s);
    memcpy(s->magic, MAGIC, sizeof s->magic);
    memcpy(s->hash, MODEL_HASH, strlen(MODEL_HASH));
    s->size = sizeof *s;
    s->stop = INFINITY;
    memcpy(s->parameters, initial_parameters, sizeof s->parameters);
    for (uint32_t i = 0; i < N_VARIABLES; i++) {
        if (variables[i].store == INPUT) s->inputs[variables[i].index] = variables[i].value;
        if (variables[i].store == TURNED) s->turned[variables[i].index] = variables[i].value;
        if (variables[i].store == SEED) s->seed = variables[i].value;
    }
    u->s.phase = CREATED;
    u->has_refused = u->has_gathered = false;
    memset(u->has_warned, 0, sizeof u->has_warned);
}

/* Whether numbers that are none are distinguished from others, which -ffast-math gives up. A square that is exact but for its last
   digit shows fused or extended arithmetic: right, but other bits than those of the model in Python. */
static bool check_arithmetic(Unit *u) {
    volatile double zero = 0.0, one = 1.0 + 0x1p-30, square = 1.0 + 0x1p-29;
    double none = zero / zero, rest = one * one - square;
    if (isfinite(none) || none <= 0.0 || none >= 0.0) {
        unit_fail(u, FAILED, "this unit was compiled with -ffast-math, which takes NaN for a number; compile it without");
        return false;
    }
    if (rest != 0.0)
        unit_tell(u, WARNING, "logStatusWarning", "this unit was compiled with fused or extended arithmetic and has other "
                                                  "last digits; -ffp-contract=off, and SSE on x86, give those of the model");
    return true;
}

/* A unit whose workspace begins at a cache line, as in Python: elsewhere a vector is read from two of them. */
static Unit *make(void) {
    char *room = calloc(1, sizeof(Unit) + CACHE_LINE);
    if (!room) return NULL;
    uintptr_t w = (uintptr_t)room + offsetof(Unit, s.w);
    Unit *u = (Unit *)(room + (CACHE_LINE - w % CACHE_LINE) % CACHE_LINE);
    u->room = room;
    return u;
}

Unit *unit_create(const char *name, const char *token, bool logging, void *environment, void *callback,
                  void (*log_message)(Unit *, Outcome, const char *, const char *)) {
    Unit *u = make();
    if (!u) return NULL;
    const char *own = name ? name : "";
    u->name = calloc(strlen(own) + 1, 1);
    if (!u->name) {
        free(u->room);
        return NULL;
    }
    memcpy(u->name, own, strlen(own));
    u->environment = environment;
    u->callback = callback;
    u->log_message = log_message;
    u->logging = logging;
    if (!token || strcmp(token, TOKEN) != 0) {
        unit_fail(u, FAILED, "the token '%s' is not that of this unit, '%s'; take it from modelDescription.xml",
                  token ? token : "", TOKEN);
        unit_free(u);
        return NULL;
    }
    if (!check_arithmetic(u)) {
        unit_free(u);
        return NULL;
    }
    unit_expand(u, initial_runs);
    unit_reset(u);
    return u;
}

void unit_free(Unit *u) {
    if (!u || !unit_allows(u, "FreeInstance")) return;
    free(u->name);
    free(u->room);
}

double unit_time(const Unit *u) { return u->s.start + (double)u->s.count * SAMPLE; }

/* Start and stop time of a run; stop = INFINITY where it has none. */
Outcome unit_run(Unit *u, double start, double stop) {
    if (!isfinite(start)) return unit_fail(u, FAILED, "start time = %g s: not a time; give a number", start);
    if (!(stop >= start))
        return unit_fail(u, FAILED, "stop time = %g s: not after the start at %g s; give a later one", stop, start);
    u->s.start = start;
    u->s.stop = stop;
    return OK;
}

/* The standard wants an error beyond the stop time. */
Outcome unit_check_end(Unit *u, double time) {
    if (time <= u->s.stop + 0.01 * SAMPLE) return OK;
    return unit_fail(u, FAILED, "time = %.9g s: beyond the stop time %.9g s of this run; end it there, or initialise with a "
                                "later stop time or none", time, u->s.stop);
}

Outcome unit_set_time(Unit *u, double time) {
    if (!isfinite(time)) return unit_fail(u, FAILED, "time = %g s: not a time; give a number", time);
    u->s.count = 0;
    u->s.start = time;
    return OK;
}

bool unit_set_states(Unit *u, const double x[]) {
    for (int k = 0; k < N_STATES; k++)
        if (!isfinite(x[k])) {
            unit_fail(u, FAILED, "state %d = %g: not a number; take a smaller step", k + 1, x[k]);
            return false;
        }
    memcpy(u->s.w, x, N_STATES * sizeof *x);
    return true;
}

/* A value with its unit; of a speed [rad/s] also in rpm. */
static const char *shown(char text[80], const Variable *v, double value) {
    int n = snprintf(text, 80, "%g %s", value, v->unit);
    if (strcmp(v->unit, "rad/s") == 0) snprintf(text + n, 80 - (size_t)n, " (%.6g rpm)", value * TO_RPM);
    return text;
}

static Outcome refuse_beyond(Unit *u, const Variable *v, double value) {
    char text[80];
    return unit_fail(u, FAILED, "%s = %s: outside %g to %g%s%s; give a value in between", v->name, shown(text, v, value),
                     v->low, v->high, *v->why ? ", " : "", v->why);
}

/* A sentence, once in a run, about a value outside the range in which the model was checked. */
static Outcome warn_beyond(Unit *u, uint32_t reference, double value) {
    const Variable *v = &variables[reference];
    char text[80];
    if ((value >= v->checked_low && value <= v->checked_high) || u->has_warned[reference]) return OK;
    u->has_warned[reference] = true;
    return unit_tell(u, WARNING, "logStatusWarning", "%s = %s: %s", v->name, shown(text, v, value), v->beyond);
}

/* FAILED after a sentence about an input, or a number of the machine, that makes no sense, WARNING after the first
   about one beyond what was checked. */
Outcome unit_check_inputs(Unit *u) {
    Outcome outcome = OK;
    if (GUARDED) return OK; /* a law keeps what is not a number out of its states, and reports it */
    int left = N_INPUTS + (u->has_gathered ? 0 : N_TURNED);
    for (uint32_t i = 0; left && i < N_VARIABLES; i++) {
        const Variable *v = &variables[i];
        if (v->store != INPUT && (v->store != TURNED || u->has_gathered)) continue;
        left--;
        double value = (v->store == INPUT ? u->s.inputs : u->s.turned)[v->index];
        if (!isfinite(value)) return unit_fail(u, FAILED, "%s = %g %s: not a number; check the signal", v->name, value, v->unit);
        if (value < v->low || value > v->high) return refuse_beyond(u, v, value);
        if (warn_beyond(u, i, value) == WARNING) outcome = WARNING;
    }
    return outcome;
}

/* Whether no value was refused and all inputs make sense; else a sentence. */
bool unit_may_begin(Unit *u) {
    if (u->has_refused) unit_fail(u, FAILED, "%s", u->refusal);
    return !u->has_refused && unit_check_inputs(u) != FAILED;
}

/* Samples in a communication step, 0 after a sentence about one that is refused; `outcome` may be a warning. */
int64_t unit_samples_in(Unit *u, double now, double length, Outcome *outcome) {
    double n = round(length / SAMPLE);
    if (!isfinite(now) || fabs(now - unit_time(u)) > 0.01 * SAMPLE) {
        *outcome = unit_fail(u, FAILED, "communication point = %.9g s: the unit is at %.9g s; continue from there", now,
                             unit_time(u));
    } else if (!(length > 0.0) || !isfinite(length)) {
        *outcome = unit_fail(u, FAILED, "communication step = %g s: not a step; give a multiple of %g s", length, SAMPLE);
    } else if (n < 1.0 || n > 1e9 || fabs(length / SAMPLE - n) > 1e-6) {
        /* no discard: a master may retry a discarded step for ever, and no retry can succeed */
        *outcome = unit_fail(u, FAILED, "communication step = %.9g s: not a multiple of %g s; give e.g. %g s", length,
                             SAMPLE, SAMPLE * (n < 1.0 ? 1.0 : n));
    } else {
        *outcome = unit_check_end(u, unit_time(u) + n * SAMPLE);
        if (*outcome == OK) *outcome = unit_check_inputs(u);
    }
    return *outcome == FAILED ? 0 : (int64_t)n;
}

/* Whether a step with samples left ends here: the master is shown the outputs, and may have asked to stop at this time. */
bool unit_ends_early(Unit *u, int64_t left) {
    if (!u->show_between || left <= 0) return false;
    u->s.phase = BETWEEN;
    u->show_between(u);
    u->s.phase = STEPPING;
    return unit_time(u) > u->return_at - 0.01 * SAMPLE;
}

/* Whether a function may be called now: within a step a master may read, and nothing else. */
bool unit_allows(Unit *u, const char *function) {
    if (u && u->s.phase != BETWEEN) return true;
    if (u) unit_fail(u, FAILED, "%s: not allowed within a communication step; read outputs there, and return", function);
    return false;
}
