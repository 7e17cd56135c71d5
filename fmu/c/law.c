/* A control law in a unit: a scheduled discrete state space with saturation, anti-windup and a switch-on without a jump.

   The arithmetic is that of rotorsim.control.law_kernel, in the same order, so both give the same bits. What is
   measured at the start of a sample is answered at its end: the plant gets a reference one sample after what it showed. */
#include <math.h>
#include <string.h>

#include "unit.h"

extern const double law_table[N_TABLE], law_axes[N_AXES];

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

/* Write the block of an operating point to `to`, of a table of nodes whose axes begin at `at`. */
static void interpolate(double *to, const double *table, int block, int at, int speeds, int pressures, double speed,
                        double pressure) {
    int i = cell_of(at, speeds, speed), j = cell_of(at + speeds, pressures, pressure);
    double a = weight_of(at, speeds, i, speed), b = weight_of(at + speeds, pressures, j, pressure);
    const double *here = table + (i * pressures + j) * block;
    int right = pressures > 1 ? block : 0, down = speeds > 1 ? block * pressures : 0;
    double w00 = (1 - a) * (1 - b), w01 = (1 - a) * b, w10 = a * (1 - b), w11 = a * b;
    for (int k = 0; k < block; k++)
        to[k] = w00 * here[k] + w01 * here[right + k] + w10 * here[down + k] + w11 * here[down + right + k];
}

static void refresh(double *w, double speed, double pressure) {
    interpolate(w, law_table, BLOCK, 0, N_SPEEDS, N_PRESSURES, speed, pressure);
}

#if L_CHECKS >= 0
#include "plausibility.h"

/* The same of the predictors, at the last plausible speed and pressure if they are known. */
static void refresh_predictors(double *w, const double in[N_INPUTS]) {
    const double *m = w + L_SEEN;
    double speed = m[M_KNOWN] > 0.0 ? m[M_AT] : in[2], pressure = m[M_KNOWN + 1] > 0.0 ? m[M_AT + 1] : in[3];
    interpolate(w + L_PBLOCK, law_table + L_CHECKS + FIRST_BLOCK, L_PSIZE, N_SPEEDS + N_PRESSURES, L_PSPEEDS,
                L_PPRESSURES, speed, pressure);
}

/* Alarm code of a sample with finite numbers (0) or not; `in`: what was measured less the runout. */
static double check(double *w, double fault, const double measured[N_INPUTS], const double in[N_INPUTS]) {
    if (fault != 0.0) {
        w[L_SEEN + M_FRESH] = w[L_EVIDENCE] = 0.0;
        if (fault == FAULT_POINT) w[L_SEEN + M_KNOWN] = w[L_SEEN + M_KNOWN + 1] = 0.0;
        return fault;
    }
    if (L_PN > 0 && fmod(w[L_SEEN + M_COUNT], REFRESHED) == 0.0) refresh_predictors(w, in);
    return implausible(w, measured, in, w[L_DONE] >= settings[START] + settings[AVERAGE]);
}
#endif

/* The law's equation for one sample of finite numbers. */
static void answer(double *w, const double in[N_INPUTS], double out[2]) {
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

/* Alarm code for what a law is given; speed and pressure count where it is scheduled over them, the shaft angle where
   it has a runout table. */
static double fault_in(const double in[N_INPUTS]) {
    if (!(fabs(in[0]) < FARTHEST && fabs(in[1]) < FARTHEST)) return FAULT_SENSOR;
    if ((N_SPEEDS > 1 && !isfinite(in[2])) || (N_PRESSURES > 1 && !isfinite(in[3]))) return FAULT_POINT;
#if L_ANGLES > 0
    if (!(fabs(in[4]) < WOUND)) return FAULT_ANGLE;
#endif
    return 0.0;
}

/* Alarm code for the states; those of an unstable law that have overflowed start again from rest. */
static double overflow(double *w) {
    double total = 0.0;
    for (int k = 0; k < ORDER; k++) total += 0.0 * w[L_X + k];
    if (total == 0.0) return 0.0;
    for (int k = 0; k < ORDER; k++) w[L_X + k] = 0.0;
    return FAULT_OVERFLOW;
}

static double most_of(double a, double b) { return a > b ? a : b; }

/* So many times faster an output that may be wrong fades out. */
static double pace(const double *g) {
    double most = most_of(fabs(g[G_BEGIN]), fabs(g[G_BEGIN + 1])), usual = FADE_OUT * most_of(g[G_STEP], LEAST);
    return QUICK * most <= usual ? QUICK : most_of(usual / most, SLOW);
}

/* Part of the output that is left, and of the states where the law comes back. */
static double left(const double *g) { return most_of(1.0 - most_of(g[G_BAD] - HOLD, 0.0) / FADE_OUT, 0.0); }

static void fade_states(double *w) {
    double part = left(w + L_GUARD);
    for (int k = 0; k < ORDER; k++) w[L_X + k] *= part;
}

/* A bad sample: the output is the last one, later a part of it; at once where that may be wrong itself. */
static void hold(double *g, double fault, double out[2]) {
    if (g[G_BAD] == 0.0) memcpy(g + G_BEGIN, g + G_OUT, 2 * sizeof *g);
    bool wrong = fault >= FAULT_RANGE && fault < FAULT_ANGLE;
    if (g[G_BAD] < HOLD && wrong) g[G_BAD] = HOLD;
    g[G_BAD] += wrong ? pace(g) : 1.0;
    g[G_LOST] += 1.0;
    g[G_ALARM] = g[G_LAST] = fault;
    double part = left(g);
    for (int k = 0; k < 2; k++) out[k] = g[G_OUT + k] = part * g[G_BEGIN + k];
}

/* A sample on the way back: the law's output becomes a mean of it and the output then, a step away at most. */
static void come_back(double *g, double out[2]) {
    g[G_BACK] -= 1.0;
    double part = most_of(g[G_BACK], 0.0) / g[G_SPAN], late = most_of(g[G_SPAN] - g[G_BACK] - FADE_OUT - 1.0, 0.0);
    double most = most_of(g[G_STEP], LEAST) * (1.0 + late / QUICK);
    bool behind = false;
    for (int k = 0; k < 2; k++) {
        double to = out[k] + part * (g[G_BEGIN + k] - out[k]), low = g[G_OUT + k] - most, high = g[G_OUT + k] + most;
        out[k] = most_of(to, low) < high ? most_of(to, low) : high;
        behind = behind || out[k] != to;
    }
    if (g[G_BACK] <= 0.0 && !behind) g[G_SPAN] = g[G_ALARM] = 0.0;
}

/* A good sample: the output is the law's, and after bad ones on the way from the output then to it. */
static void resume(double *g, double out[2]) {
    if (g[G_BAD] > 0.0) {
        memcpy(g + G_BEGIN, g + G_OUT, 2 * sizeof *g);
        double back = (g[G_BAD] < FADE_OUT ? g[G_BAD] : FADE_OUT) + 1.0;
        g[G_SPAN] = g[G_BACK] = back > g[G_BACK] ? back : g[G_BACK];
        g[G_BAD] = 0.0;
    }
    if (g[G_SPAN] > 0.0)
        come_back(g, out);
    else if (g[G_OUT] != 0.0 || g[G_OUT + 1] != 0.0)
        for (int k = 0; k < 2; k++) g[G_STEP] = most_of(g[G_STEP], fabs(out[k] - g[G_OUT + k]));
    memcpy(g + G_OUT, out, 2 * sizeof *g);
}

#if L_ANGLES > 0
/* Runout [m] of a sensor at a shaft angle [rad]. */
static double runout_at(int axis, double angle) {
    const double *runout = law_table + L_RUNOUT;
    double turns = angle / TURN, place = (turns - floor(turns)) * L_ANGLES;
    int k = (int)place, low = k % L_ANGLES, high = (k + 1) % L_ANGLES;
    double share = place - k;
    return (1.0 - share) * runout[2 * low + axis] + share * runout[2 * high + axis];
}
#endif

/* One sample; bad ones are held out of the law's states, see rotorsim.control.guard. */
static void step(double *w, const double measured[N_INPUTS], double out[N_OUT]) {
    double fault = fault_in(measured), in[N_INPUTS];
    memcpy(in, measured, sizeof in);
#if L_ANGLES > 0
    if (fault == 0.0)
        for (int k = 0; k < 2; k++) in[k] -= runout_at(k, in[4]);
#endif
#if L_CHECKS >= 0
    fault = check(w, fault, measured, in);
#endif
    if (fault == 0.0) {
        if (w[L_GUARD + G_BAD] > 0.0) fade_states(w);
        answer(w, in, out);
        fault = overflow(w);
    }
    if (fault == 0.0)
        resume(w + L_GUARD, out);
    else
        hold(w + L_GUARD, fault, out);
    out[2] = w[L_GUARD + G_ALARM];
}

bool unit_refresh(Unit *u) {
    (void)u; /* outputs change with a step only */
    return true;
}

bool unit_initialise(Unit *u) {
    if (!unit_may_begin(u)) return false;
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
