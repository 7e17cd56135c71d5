/* A control law in a unit: control_law.c, with the same bits as rotorsim.control.law_kernel.

   What is measured at the start of a sample is answered at its end: the plant gets a reference one sample after what it
   showed. */
#include <string.h>

#include "unit.h"

static law_memory *memory(Unit *u) { return (law_memory *)u->s.w; } /* all numbers, as w is */

bool unit_refresh(Unit *u) {
    (void)u; /* outputs change with a step only */
    return true;
}

bool unit_initialise(Unit *u) {
    if (!unit_may_begin(u)) return false;
    law_reset(memory(u));
    u->s.settled = 1;
    return true;
}

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    Outcome outcome;
    double *in = u->s.inputs, *out = u->s.outputs;
    int64_t n = unit_samples_in(u, now, length, &outcome);
    for (int64_t k = 0; k < n; k++) out[2] = law_step(memory(u), in, in[2], in[3], N_INPUTS > 4 ? in[N_INPUTS - 1] : 0.0, out);
    u->s.count += n;
    *reached = unit_time(u);
    return outcome;
}

bool unit_film_pressure(Unit *u, double *values) {
    (void)u, (void)values;
    return false;
}
