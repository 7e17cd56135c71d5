#include <math.h>
#include <string.h>

#include "control_law.h"

typedef law_real real;

extern const law_matrices law_table[LAW_SPEEDS][LAW_PRESSURES];
extern const real law_speeds[LAW_SPEEDS], law_pressures[LAW_PRESSURES];
#if LAW_CHECKED
extern const law_limits limits;
#endif
#if LAW_PREDICTED
extern const law_predictor predictor_table[LAW_MODEL_SPEEDS][LAW_MODEL_PRESSURES];
extern const real model_speeds[LAW_MODEL_SPEEDS], model_pressures[LAW_MODEL_PRESSURES];
#endif
#if LAW_ANGLES
extern const real runout[LAW_ANGLES][2];
#endif

static real larger(real a, real b) { return a > b ? a : b; }
static real smaller(real a, real b) { return a < b ? a : b; }
static real clip(real value, real limit) { return smaller(larger(value, -limit), limit); }

/* The table: matrices over speed and pressure, interpolated bilinearly; outside its edge holds. */

static int cell_of(const real axis[], int count, real value) {
    int k = 0;
    while (k < count - 2 && value >= axis[k + 1]) k++;
    return k;
}

/* Weight of the upper end of cell k. */
static real weight_of(const real axis[], int count, int k, real value) {
    if (count < 2) return 0;
    real share = (value - axis[k]) / (axis[k + 1] - axis[k]);
    share = larger(share, 0); /* of NaN too */
    return smaller(share, 1);
}

/* Write the `size` numbers of an operating point to `to`, from a table of so many over pressures, over speeds. */
static void interpolate(real to[], const real table[], int size, const real speeds[], int n_speeds, real speed,
                        const real pressures[], int n_pressures, real pressure) {
    int i = cell_of(speeds, n_speeds, speed), j = cell_of(pressures, n_pressures, pressure);
    real a = weight_of(speeds, n_speeds, i, speed), b = weight_of(pressures, n_pressures, j, pressure);
    int right = n_pressures > 1 ? size : 0, down = n_speeds > 1 ? size * n_pressures : 0;
    const real *here = table + (i * n_pressures + j) * size;
    real w00 = (1 - a) * (1 - b), w01 = (1 - a) * b, w10 = a * (1 - b), w11 = a * b;
    for (int k = 0; k < size; k++)
        to[k] = w00 * here[k] + w01 * here[right + k] + w10 * here[down + k] + w11 * here[down + right + k];
}

static void read_table(law_memory *law, real speed, real pressure) {
    interpolate((real *)&law->now, (const real *)law_table, (int)(sizeof(law_matrices) / sizeof(real)), law_speeds,
                LAW_SPEEDS, speed, law_pressures, LAW_PRESSURES, pressure);
}

/* The law: x+ = A x + B (y - centre) + W (sat(v) - v), v = C x + D (y - centre) + bias, reference = sat(share v). */

static void answer(law_memory *law, const real y[2], real speed, real pressure, real reference[2]) {
    const law_matrices *m = &law->now;
    const real bias[2] = {BIAS_X, BIAS_Y};
    real since = law->count - START, error[2], v[2], lost[2], share = 1;
    if (law->count < START + AVERAGE + FADE_IN) law->count += 1;
    if (law->until_read == 0) {
        read_table(law, speed, pressure);
        law->until_read = REFRESH;
    }
    law->until_read -= 1;
    if (since < AVERAGE) { /* it seeks its centre, the mean of the displacement */
        for (int k = 0; k < 2 && since >= 0; k++) {
            law->sums[k] += y[k];
            law->centre[k] = law->sums[k] / (since + 1);
        }
        reference[0] = reference[1] = 0;
        return;
    }
    for (int k = 0; k < 2; k++) error[k] = y[k] - law->centre[k];
    for (int k = 0; k < 2; k++) {
        v[k] = m->D[k][0] * error[0] + m->D[k][1] * error[1] + bias[k];
        for (int i = 0; i < LAW_STATES; i++) v[k] += m->C[k][i] * law->x[i];
        lost[k] = clip(v[k], LIMIT) - v[k];
    }
    for (int i = 0; i < LAW_STATES; i++) {
        real total = m->B[i][0] * error[0] + m->B[i][1] * error[1];
        total += m->W[i][0] * lost[0] + m->W[i][1] * lost[1];
        for (int k = 0; k < LAW_STATES; k++) total += m->A[i][k] * law->x[k];
        law->next[i] = total;
    }
    memcpy(law->x, law->next, sizeof law->x);
#if LAW_FADES
    if (since - AVERAGE < FADE_IN) share = (since - AVERAGE) / FADE_IN;
#endif
    for (int k = 0; k < 2; k++) reference[k] = clip(share * v[k], LIMIT);
}

/* Alarm for states that have overflowed, those of an unstable law: they start again from rest. */
static int overflow(law_memory *law) {
    real total = 0;
    for (int k = 0; k < LAW_STATES; k++) total += 0 * law->x[k];
    if (total == 0) return LAW_OK;
    memset(law->x, 0, sizeof law->x);
    return LAW_OVERFLOW;
}

/* The guard: what the output does in bad samples, and how it comes back. */

/* Factor by which an output that may be wrong fades out faster. */
static real pace(const law_guard *g) {
    real most = larger(ABS(g->begin[0]), ABS(g->begin[1])), usual = FADE_OUT * larger(g->step, LEAST);
    return QUICK * most <= usual ? QUICK : larger(usual / most, SLOW);
}

/* Part of the output that is left, and of the states where the law comes back. */
static real left(const law_guard *g) { return larger(1 - larger(g->bad - HOLD, 0) / FADE_OUT, 0); }

/* A bad sample: the output is the last one, later a part of it; at once where that may be wrong itself. */
static void hold(law_guard *g, int fault, real reference[2]) {
    int wrong = fault >= LAW_OUT_OF_RANGE && fault < LAW_ANGLE;
    if (g->bad == 0) memcpy(g->begin, g->out, sizeof g->begin);
    if (g->bad < HOLD && wrong) g->bad = HOLD;
    g->bad += wrong ? pace(g) : 1;
    g->lost += 1;
    g->alarm = g->last = (real)fault;
    for (int k = 0; k < 2; k++) reference[k] = g->out[k] = left(g) * g->begin[k];
}

/* A sample on the way back: the law's output becomes a mean of it and the output then, a step away at most. */
static void come_back(law_guard *g, real reference[2]) {
    g->back -= 1;
    real part = larger(g->back, 0) / g->span, late = larger(g->span - g->back - FADE_OUT - 1, 0);
    real most = larger(g->step, LEAST) * (1 + late / QUICK);
    int behind = 0;
    for (int k = 0; k < 2; k++) {
        real to = reference[k] + part * (g->begin[k] - reference[k]);
        reference[k] = smaller(larger(to, g->out[k] - most), g->out[k] + most);
        behind = behind || reference[k] != to;
    }
    if (g->back <= 0 && !behind) g->span = g->alarm = 0;
}

/* A good sample: the output is the law's, and after bad ones on the way from the output then to it. */
static void resume(law_guard *g, real reference[2]) {
    if (g->bad > 0) {
        memcpy(g->begin, g->out, sizeof g->begin);
        g->span = g->back = larger(smaller(g->bad, FADE_OUT) + 1, g->back);
        g->bad = 0;
    }
    if (g->span > 0)
        come_back(g, reference);
    else if (g->out[0] != 0 || g->out[1] != 0)
        for (int k = 0; k < 2; k++) g->step = larger(g->step, ABS(reference[k] - g->out[k]));
    memcpy(g->out, reference, sizeof g->out);
}

#if LAW_CHECKED
/* Plausibility of samples that are numbers. */

/* Begin a pause; returns the fault. */
static int suspend(law_checks *m, int fault) {
    int again = m->length > 0 && m->since < PAUSE_SETTLED;
    m->rest = m->length = again ? smaller(2 * m->length, PAUSE_MOST) : PAUSE_FIRST;
    m->reason = (real)fault;
    m->since = m->away = 0;
    return fault;
}

/* Whether speed (k = 0) or pressure (1) is out of `range` (low, high, jump); one that is not finite does not count. */
static int astray(law_checks *m, int k, const real range[3], real value) {
    if (!isfinite(value)) return 0;
    int inside = range[0] <= value && value <= range[1];
    int near = m->known[k] == 0 || ABS(value - m->at[k]) <= range[2];
    if (inside && !near && value != 0) {
        int again = ABS(value - m->other[k]) <= range[2];
        m->held[k] = again ? m->held[k] + 1 : 1;
        m->other[k] = value;
        near = m->held[k] > ACCEPTED;
    } else {
        m->held[k] = 0;
    }
    if (inside && near) {
        m->at[k] = value;
        m->known[k] = 1;
        m->held[k] = 0;
    }
    return !(inside && near);
}

static void count_repeats(law_checks *m, int k, real value) {
    if (m->count > 0 && value == m->seen[k]) {
        m->same[k] += 1;
    } else {
        m->same[k] = 0;
        if (m->count < ARMED) m->changed[k] += 1;
    }
    m->seen[k] = value;
}
#endif

#if LAW_PREDICTED
/* Alarm for a wrong connection of the sensors for which there is enough evidence, or LAW_OK. */
static int connection(law_checks *m) {
    int found = LAW_OK;
    real most = limits.evidence;
    for (int j = 1; j < LAW_WAYS; j++)
        if (m->evidence[j] > most) {
            found = LAW_CONNECTION + j - 1;
            most = m->evidence[j];
        }
    return found != LAW_OK ? suspend(m, found) : LAW_OK;
}

/* Whether the last plausible speed and pressure lie where the predictors' model holds. */
static int modelled(const law_checks *m) {
    return limits.model_speed[0] <= m->at[0] && m->at[0] <= limits.model_speed[1] &&
           limits.model_pressure[0] <= m->at[1] && m->at[1] <= limits.model_pressure[1];
}

/* Channel k of the displacement if the sensors are connected in way j: right, x, y or both reversed, swapped. */
static real connected(int j, int k, const real y[2]) {
    if (j == 4) return y[1 - k];
    return (j == 1 && k == 0) || (j == 2 && k == 1) || j == 3 ? -y[k] : y[k];
}

static void start_predictors(law_checks *m, const real y[2]) {
    memset(m->x, 0, sizeof m->x);
    for (int j = 0; j < LAW_WAYS; j++) {
        for (int k = 0; k < 2; k++) m->x[j][LAW_PREDICTED - 2 + k] = connected(j, k, y);
        m->evidence[j] = 1;
    }
}

/* Advance predictor j by the displacement [um] and the reference [V]; returns the weighted square of its error. */
static real predictor(law_checks *m, int j, const real y[2], const real u[2]) {
    const law_predictor *p = &m->now;
    real e[2];
    for (int k = 0; k < 2; k++) {
        e[k] = connected(j, k, y);
        for (int i = 0; i < LAW_PREDICTED; i++) e[k] -= p->C[k][i] * m->x[j][i];
    }
    for (int i = 0; i < LAW_PREDICTED; i++) {
        real total = p->B[i][0] * u[0] + p->B[i][1] * u[1];
        total += p->L[i][0] * e[0] + p->L[i][1] * e[1];
        for (int k = 0; k < LAW_PREDICTED; k++) total += p->A[i][k] * m->x[j][k];
        m->next[i] = total;
    }
    memcpy(m->x[j], m->next, sizeof m->next);
    return p->S[0] * e[0] * e[0] + 2 * p->S[1] * e[0] * e[1] + p->S[2] * e[1] * e[1];
}

/* Advance all predictors by a displacement [m] and the reference [V] that acts while it is measured. */
static void predict(law_checks *m, const real given[2], const real out[2], int acting) {
    const real y[2] = {(real)1e6 * given[0], (real)1e6 * given[1]}, *u = m->acts > 0 ? m->acting : out;
    if (m->evidence[0] == 0) start_predictors(m, y);
    real first = predictor(m, 0, y, u);
    m->evidence[0] += (first - m->evidence[0]) / LATELY;
    for (int j = 1; j < LAW_WAYS; j++) {
        real q = predictor(m, j, y, u), ratio = m->evidence[0] > MISSED ? (NU + first) / (NU + q) : 1;
        m->evidence[j] = acting ? larger(DOUBT * m->evidence[j] * ratio, 1) : 1;
    }
}

/* The predictors of the last plausible speed and pressure, if they are known. */
static void read_predictors(law_checks *m, real speed, real pressure) {
    interpolate((real *)&m->now, (const real *)predictor_table, (int)(sizeof(law_predictor) / sizeof(real)), model_speeds,
                LAW_MODEL_SPEEDS, m->known[0] > 0 ? m->at[0] : speed, model_pressures, LAW_MODEL_PRESSURES,
                m->known[1] > 0 ? m->at[1] : pressure);
}

void law_applied(law_memory *law, const real reference[2]) {
    law->checks.acts = 1;
    memcpy(law->checks.acting, reference, sizeof law->checks.acting);
}
#endif

#if LAW_CHECKED
/* Alarm of a finite displacement, or LAW_OK; `centred` where the law's centre is known. */
static int displacement(law_memory *law, const real measured[2], const real y[2], int centred) {
    law_checks *m = &law->checks;
    for (int k = 0; k < 2; k++) count_repeats(m, k, measured[k]);
    if (m->count < ARMED) m->count += 1;
    real away = larger(ABS(y[0] - m->good[0]), ABS(y[1] - m->good[1]));
    int paused = m->rest > 0, jumped = m->fresh > 0 && away > limits.jump;
#if LAW_PREDICTED
    if (jumped) m->evidence[0] = 0;
#endif
    if (jumped && !paused) {
        m->away += 1;
        return m->away <= GLITCH ? LAW_JUMP : suspend(m, LAW_JUMP);
    }
    m->away = 0;
    m->fresh = 1;
    memcpy(m->good, y, sizeof m->good);
#if LAW_PREDICTED
    predict(m, y, law->guard.out, centred && law->guard.bad == 0 && modelled(m));
#endif
    if (paused) {
        m->rest -= 1;
        return (int)m->reason;
    }
    real far = larger(ABS(y[0] - law->centre[0]), ABS(y[1] - law->centre[1]));
    if (centred && far > limits.range) return LAW_OUT_OF_RANGE;
    for (int k = 0; k < 2; k++)
        if (m->same[k] >= limits.stuck && m->changed[k] > ARMED / 2) return LAW_STUCK;
#if LAW_PREDICTED
    return connection(m);
#else
    return LAW_OK;
#endif
}

/* Alarm of a good sample after which samples have been bad too often, or LAW_OK. */
static int unsteady(law_memory *law) {
    law_checks *m = &law->checks;
    m->returns *= FORGOTTEN;
    if (law->guard.bad == 0) return LAW_OK;
    m->returns += 1;
    if (m->returns <= OFTEN) return LAW_OK;
    m->returns = 0;
    return suspend(m, LAW_UNSTEADY);
}

/* Alarm of what was measured, less the runout in `y`; `fault`: what is known of it already. */
static int check(law_memory *law, int fault, const real measured[2], const real y[2], real speed, real pressure) {
    law_checks *m = &law->checks;
    if (fault != LAW_OK) {
        m->fresh = 0;
        if (fault == LAW_POINT) m->known[0] = m->known[1] = 0;
#if LAW_PREDICTED
        m->evidence[0] = m->acts = 0;
#endif
        return fault;
    }
#if LAW_PREDICTED
    if (m->until_read == 0) {
        read_predictors(m, speed, pressure);
        m->until_read = REFRESHED;
    }
    m->until_read -= 1;
#endif
    int far = astray(m, 0, limits.speed, speed);
    if (astray(m, 1, limits.pressure, pressure)) far = 1;
    fault = displacement(law, measured, y, law->count >= START + AVERAGE);
    if (fault == LAW_OK && far) fault = LAW_POINT_FAR;
    if (fault == LAW_OK) {
        m->since += 1;
        fault = unsteady(law);
    }
#if LAW_PREDICTED
    m->acts = 0;
#endif
    return fault;
}
#endif

#if LAW_ANGLES
/* Runout [m] of a sensor at a shaft angle [rad]: straight lines between the angles of the table. */
static real runout_at(int axis, real angle) {
    real turns = angle / TURN, place = (turns - FLOOR(turns)) * LAW_ANGLES;
    int k = (int)place;
    real share = place - (real)k;
    return (1 - share) * runout[k % LAW_ANGLES][axis] + share * runout[(k + 1) % LAW_ANGLES][axis];
}
#endif

/* Alarm for what is not finite, or LAW_OK; what the law does not use does not count. */
static int not_a_number(const real measured[2], real speed, real pressure, real angle) {
    (void)angle;
    if (!(ABS(measured[0]) < FARTHEST && ABS(measured[1]) < FARTHEST)) return LAW_SENSOR;
    if ((LAW_SPEEDS > 1 && !isfinite(speed)) || (LAW_PRESSURES > 1 && !isfinite(pressure))) return LAW_POINT;
#if LAW_ANGLES
    if (!(ABS(angle) < WOUND)) return LAW_ANGLE;
#endif
    return LAW_OK;
}

void law_reset(law_memory *law) {
    memset(law, 0, sizeof *law); /* all bits zero is 0.0 in IEEE 754 */
    law->centre[0] = CENTRE_X;
    law->centre[1] = CENTRE_Y;
}

int law_step(law_memory *law, const real measured[2], real speed, real pressure, real angle, real reference[2]) {
    int fault = not_a_number(measured, speed, pressure, angle);
    real y[2] = {measured[0], measured[1]};
#if LAW_ANGLES
    if (fault == LAW_OK)
        for (int k = 0; k < 2; k++) y[k] -= runout_at(k, angle);
#endif
#if LAW_CHECKED
    fault = check(law, fault, measured, y, speed, pressure);
#endif
    if (fault == LAW_OK) {
        if (law->guard.bad > 0) /* old states, and after a wrong connection wrong ones */
            for (int k = 0; k < LAW_STATES; k++) law->x[k] *= left(&law->guard);
        answer(law, y, speed, pressure, reference);
        fault = overflow(law);
    }
    if (fault == LAW_OK)
        resume(&law->guard, reference);
    else
        hold(&law->guard, fault, reference);
    return (int)law->guard.alarm;
}

#if LAW_TESTED
/* The self test: a run whose outputs were computed at the export. */

/* The next of a sequence of 16-bit numbers. */
static long shuffle(unsigned long *state) {
    *state = (*state * 1664525UL + 1013904223UL) & 0xFFFFFFFFUL;
    return (long)(*state >> 16);
}

static int is_number(real value) { /* by its bits: -ffast-math takes every value for a number */
    unsigned char byte[sizeof(real)];
    const int one = 1, little = *(const char *)&one;
    memcpy(byte, &value, sizeof byte);
    int high = byte[little ? sizeof byte - 1 : 0], low = byte[little ? sizeof byte - 2 : 1];
    return (high & 0x7F) != 0x7F || (low & NOT_FINITE) != NOT_FINITE;
}

int law_self_test(law_memory *law) {
    unsigned long state = 1;
    int found = 0;
    volatile real zero = 0;
    law_reset(law);
    for (int k = 0; k < TEST_SAMPLES; k++) {
        real reference[2], measured[2];
        for (int i = 0; i < 2; i++) measured[i] = TEST_SCALE * (real)(shuffle(&state) - 32768);
        if (k % TEST_EVERY == TEST_EVERY - 8) measured[k / TEST_EVERY % 2] = zero / zero; /* NaN */
        law_step(law, measured, TEST_SPEED + TEST_SPEED_STEP * (real)k, TEST_PRESSURE + TEST_PRESSURE_STEP * (real)k,
                 TEST_ANGLE_STEP * (real)k, reference);
        for (int i = 0; i < 2 && k % TEST_EVERY == TEST_EVERY - 1; i++) {
            real right = test_references[k / TEST_EVERY][i];
            if (!is_number(reference[i]) || ABS(reference[i] - right) > TEST_ERROR) found = LAW_NOT_IEEE;
            if (found == 0 && TEST_EXACT && memcmp(&reference[i], &right, sizeof right) != 0) found = LAW_OTHER_BITS;
        }
    }
    law_reset(law);
#if defined __FAST_MATH__ || (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__)
    return LAW_NOT_IEEE;
#endif
    return found;
}
#endif
