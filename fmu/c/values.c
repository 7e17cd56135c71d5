/* Values by reference: what may be read and set when, and the sentence about what may not. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "unit.h"

static const Variable *find(Unit *u, uint32_t reference, Kind kind) {
    static const char *const kinds[] = {"a real number", "an integer", "a boolean", "a clock"};
    if (reference >= N_VARIABLES) {
        unit_fail(u, FAILED, "value reference %u: there is no such variable; see modelDescription.xml", (unsigned)reference);
        return NULL;
    }
    if (variables[reference].kind != kind) {
        unit_fail(u, FAILED, "%s: is %s; use the function of that type", variables[reference].name,
                  kinds[variables[reference].kind]);
        return NULL;
    }
    return &variables[reference];
}

/* Whether what a variable shows has been computed; if not, it is, as soon as there is an equilibrium to compute. */
bool unit_known(Unit *u, uint32_t reference) {
    if (u->s.phase != CREATED) return unit_refresh(u);
    unit_fail(u, FAILED, "%s: is not known before initialisation; enter initialisation mode first", variables[reference].name);
    return false;
}

bool unit_get(Unit *u, uint32_t reference, Kind kind, double *value) {
    const Variable *v = find(u, reference, kind);
    if (!v) return false;
    if ((v->store == OUTPUT || v->store == DERIVATIVE) && !unit_known(u, reference)) return false;
    switch (v->store) {
        case TIME: *value = unit_time(u); return true;
        case INPUT: *value = u->s.inputs[v->index]; return true;
        case OUTPUT: *value = u->s.outputs[v->index]; return true;
        case PARAMETER: *value = u->s.parameters[v->index]; return true;
        case STATE: *value = u->s.w[v->index]; return true;
        case DERIVATIVE: *value = u->derivatives[v->index]; return true;
        case TURNED: *value = u->s.turned[v->index]; return true;
        case SEED: *value = u->s.seed; return true;
        case CONSTANT: *value = v->value; return true;
        case TICKS: *value = (double)u->s.event; return true;
        case PRESSURE: break;
    }
    unit_fail(u, FAILED, "%s: is an array of %d values; read all of it", v->name, N_PRESSURE);
    return false;
}

static bool refuse(Unit *u, uint32_t reference, const char *text) {
    if (u->s.phase == CREATED || u->s.phase == INITIALISING) {
        u->has_refused = true;
        u->refused = reference;
        snprintf(u->refusal, sizeof u->refusal, "%s", text);
    }
    unit_fail(u, FAILED, "%s", text);
    return false;
}

/* The list that a variable is chosen from; NULL where it has none. */
static const Choice *list_of(const Variable *v) {
    for (const Choice *c = choices; c < &choices[N_CHOICES]; c++)
        if (v->store == TURNED && c->turned == v->index) return c;
    return NULL;
}

/* The one of a list that a value is near; NAN after a sentence where none is. */
static double offered(Unit *u, uint32_t reference, const Choice *c, double value) {
    const Variable *v = &variables[reference];
    char text[400];
    size_t n = (size_t)snprintf(text, sizeof text, "%s = %g %s: is not offered by this unit; give one of", v->name, value, v->unit);
    for (const double *one = &chosen[c->first]; one < &chosen[c->first + c->count]; one++) {
        if (fabs(value - *one) <= 1e-9 * fabs(*one)) return *one;
        if (n < sizeof text) n += (size_t)snprintf(text + n, sizeof text - n, " %.12g", *one);
    }
    refuse(u, reference, text);
    return NAN;
}

/* Whether a value fits its variable; if not, a sentence that keeps stopping the initialisation. */
static bool fits(Unit *u, uint32_t reference, double value) {
    const Variable *v = &variables[reference];
    char text[400];
    if (!(value >= v->low && value <= v->high)) {
        if (v->low == v->high)
            snprintf(text, sizeof text, "%s = %g %s: is fixed at %.17g in this unit; export the machine with another one",
                     v->name, value, v->unit, v->low);
        else
            snprintf(text, sizeof text, "%s = %g %s: outside %g to %g; give a value in between", v->name, value, v->unit,
                     v->low, v->high);
        return refuse(u, reference, text);
    }
    return true;
}

bool unit_set(Unit *u, uint32_t reference, Kind kind, double value) {
    const Variable *v = find(u, reference, kind);
    bool early = u->s.phase == CREATED || u->s.phase == INITIALISING;
    if (!v || !unit_allows(u, v->name)) return false;
    if (v->settable == NEVER) {
        unit_fail(u, FAILED, "%s: cannot be set; only inputs and parameters can", v->name);
        return false;
    }
    if (v->settable == BEFORE_START && !early) {
        unit_fail(u, FAILED, "%s: is fixed once the unit is initialised; reset it and set it before", v->name);
        return false;
    }
    if (v->store == INPUT) {
        u->s.inputs[v->index] = value; /* judged when it is used */
    } else {
        const Choice *c = list_of(v);
        if (c ? isnan(value = offered(u, reference, c, value)) : !fits(u, reference, value)) return false;
        if (u->has_refused && u->refused == reference) u->has_refused = false;
        if (v->store == SEED) u->s.seed = value;
        if (v->store == PARAMETER) u->s.parameters[v->index] = value;
        if (v->store == TURNED) u->s.turned[v->index] = value;
        if (v->store == STATE) u->s.w[v->index] = value;
        if (v->store == TICKS) u->s.event = value != 0.0;
    }
    if (early) u->s.settled = 0;
    if (v->store != INPUT) u->has_gathered = false;
    return true;
}
