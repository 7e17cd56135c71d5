/* A control law in a unit: a scheduled discrete state space with saturation, anti-windup and a switch-on without a jump.

   The arithmetic is that of rotorsim.control.runtime.kernels, in the same order, so both give the same bits. What is
   measured at the start of a sample is answered at its end: the plant gets a reference one sample after what it showed. */
#include <string.h>

#include "unit.h"

extern const double law_table[N_TABLE], law_axes[N_SPEEDS + N_PRESSURES];

static const double settings[7] = SETTINGS;
enum { REFRESH, START, AVERAGE, FADE, LIMIT, BIAS_X, BIAS_Y };

static int cell_of(int first, int count, double value) {
    int k = 0;
    while (k < count - 2 && value >= law_axes[first + k + 1]) k++;
    return k;
}

static double clip(double value, double limit) {
    double above = value > -limit ? value : -limit;
    return above < limit ? above : limit;
}

static double weight_of(int first, int count, int k, double value) {
    if (count < 2) return 0.0;
    double low = law_axes[first + k], high = law_axes[first + k + 1];
    double share = (value - low) / (high - low);
    share = share > 0.0 ? share : 0.0;
    return share < 1.0 ? share : 1.0;
}

static void refresh(double *w, double speed, double pressure) {
    int i = cell_of(0, N_SPEEDS, speed), j = cell_of(N_SPEEDS, N_PRESSURES, pressure);
    double a = weight_of(0, N_SPEEDS, i, speed), b = weight_of(N_SPEEDS, N_PRESSURES, j, pressure);
    const double *at = law_table + (i * N_PRESSURES + j) * BLOCK;
    int right = N_PRESSURES > 1 ? BLOCK : 0, down = N_SPEEDS > 1 ? BLOCK * N_PRESSURES : 0;
    double w00 = (1 - a) * (1 - b), w01 = (1 - a) * b, w10 = a * (1 - b), w11 = a * b;
    for (int k = 0; k < BLOCK; k++)
        w[k] = w00 * at[k] + w01 * at[right + k] + w10 * at[down + k] + w11 * at[down + right + k];
}

static void step(double *w, const double in[N_INPUTS], double out[N_OUT]) {
    double count = w[L_DONE], since = count - settings[START], fade = 1.0;
    w[L_DONE] = count + 1.0;
    if ((int64_t)count % (int64_t)settings[REFRESH] == 0) refresh(w, in[2], in[3]);
    if (since < settings[AVERAGE]) {
        if (since >= 0.0) {
            for (int k = 0; k < 2; k++) {
                w[L_SUMS + k] += in[k];
                w[L_CENTRE + k] = w[L_SUMS + k] / (since + 1.0);
            }
        }
        out[0] = out[1] = 0.0;
        return;
    }
    double y0 = in[0] - w[L_CENTRE], y1 = in[1] - w[L_CENTRE + 1];
    double v0 = w[L_D] * y0 + w[L_D + 1] * y1 + settings[BIAS_X];
    double v1 = w[L_D + 2] * y0 + w[L_D + 3] * y1 + settings[BIAS_Y];
    for (int k = 0; k < ORDER; k++) {
        v0 += w[L_C + k] * w[L_X + k];
        v1 += w[L_C + ORDER + k] * w[L_X + k];
    }
    double lost0 = clip(v0, settings[LIMIT]) - v0, lost1 = clip(v1, settings[LIMIT]) - v1;
    for (int i = 0; i < ORDER; i++) {
        double total = w[L_B + 2 * i] * y0 + w[L_B + 2 * i + 1] * y1;
        total += w[L_W + 2 * i] * lost0 + w[L_W + 2 * i + 1] * lost1;
        for (int k = 0; k < ORDER; k++) total += w[i * ORDER + k] * w[L_X + k];
        w[L_NEW + i] = total;
    }
    memcpy(w + L_X, w + L_NEW, ORDER * sizeof *w);
    if (since - settings[AVERAGE] < settings[FADE]) fade = (since - settings[AVERAGE]) / settings[FADE];
    out[0] = clip(fade * v0, settings[LIMIT]);
    out[1] = clip(fade * v1, settings[LIMIT]);
}

bool unit_refresh(Unit *u) {
    (void)u; /* outputs change with a step only */
    return true;
}

bool unit_initialise(Unit *u) {
    if (u->has_refused) {
        unit_fail(u, FAILED, "%s", u->refusal);
        return false;
    }
    if (unit_check_inputs(u) != OK) return false;
    memcpy(u->s.w, u->initial, sizeof u->s.w);
    u->s.settled = 1;
    return true;
}

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    Outcome outcome;
    int64_t n = unit_samples_in(u, now, length, &outcome);
    for (int64_t k = 0; k < n; k++) step(u->s.w, u->s.inputs, u->s.outputs);
    u->s.count += n;
    *reached = unit_time(u);
    return outcome;
}

bool unit_film_pressure(Unit *u, double *values) {
    (void)u, (void)values;
    return false;
}
