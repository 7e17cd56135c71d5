/* A control law in a unit: control_law.c, with the same bits as rotorsim.control.law_kernel.

   What is measured at the start of a sample is answered at its end: the plant gets a reference one sample after what it
   showed. A law with a clock answers at its ticks, at once; time passes between them. */
#include <string.h>

#include "unit.h"

static law_memory *memory(Unit *u) { return (law_memory *)u->s.w; } /* all numbers, as w is */

static void answer(Unit *u, law_memory *m) {
    double *in = u->s.inputs, *out = u->s.outputs;
    out[2] = law_step(m, in, in[2], in[3], N_INPUTS > 4 ? in[N_INPUTS - 1] : 0.0, out);
}

/* While the clock ticks, the answer to the inputs as they are; the memory moves on with the end of the tick alone. */
bool unit_refresh(Unit *u) {
    if (CLOCKED && u->s.event) {
        law_memory trial = *memory(u);
        answer(u, &trial);
    }
    return true;
}

void unit_tick(Unit *u) { answer(u, memory(u)); }

bool unit_initialise(Unit *u) {
    if (!unit_may_begin(u)) return false;
    law_reset(memory(u));
    u->s.settled = 1;
    return true;
}

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    Outcome outcome;
    int64_t n = unit_samples_in(u, now, length, &outcome);
    if (CLOCKED && n > 1) {
        outcome = unit_fail(u, FAILED, "communication step = %g s: law.clock ticks within it; give %g s", length, SAMPLE);
        n = 0;
    }
    for (int64_t k = 0; k < n; k++) {
        if (!CLOCKED) answer(u, memory(u));
        u->s.count++;
        if (unit_ends_early(u, n - k - 1)) break;
    }
    *reached = unit_time(u);
    return outcome;
}

bool unit_film_pressure(Unit *u, double *values) {
    (void)u, (void)values;
    return false;
}
