/* Plausibility of the samples that a law is given, as rotorsim.control.guard has it, in the same order.

   Included by law.c, which has the table and how it is read. */
#ifndef PLAUSIBILITY_H
#define PLAUSIBILITY_H

static double larger(double a, double b) { return a > b ? a : b; }
static double smaller(double a, double b) { return a < b ? a : b; }

/* Begin a pause; returns the fault. */
static double suspend(double *m, double fault) {
    bool again = m[M_LENGTH] > 0.0 && m[M_SINCE] < PAUSE_SETTLED;
    m[M_LENGTH] = again ? smaller(2.0 * m[M_LENGTH], PAUSE_MOST) : PAUSE_FIRST;
    m[M_REST] = m[M_LENGTH];
    m[M_REASON] = fault;
    m[M_SINCE] = m[M_AWAY] = 0.0;
    return fault;
}

/* Whether speed (k = 0) or pressure (1) is out of its limits or has jumped; one that is not finite does not count. */
static bool lost(double *m, int k, const double *limits, double value) {
    if (!isfinite(value)) return false;
    bool inside = limits[0] <= value && value <= limits[1];
    bool near = m[M_KNOWN + k] == 0.0 || fabs(value - m[M_AT + k]) <= limits[2];
    if (inside && !near && value != 0.0) {
        bool again = fabs(value - m[M_OTHER + k]) <= limits[2];
        m[M_HELD + k] = again ? m[M_HELD + k] + 1.0 : 1.0;
        m[M_OTHER + k] = value;
        near = m[M_HELD + k] > ACCEPTED;
    } else {
        m[M_HELD + k] = 0.0;
    }
    if (inside && near) {
        m[M_AT + k] = value;
        m[M_KNOWN + k] = 1.0;
        m[M_HELD + k] = 0.0;
    }
    return !(inside && near);
}

static void count_repeats(double *m, int k, double value) {
    if (m[M_COUNT] > 0.0 && value == m[M_SEEN + k]) {
        m[M_SAME + k] += 1.0;
    } else {
        m[M_SAME + k] = 0.0;
        if (m[M_COUNT] < ARMED) m[M_CHANGED + k] += 1.0;
    }
    m[M_SEEN + k] = value;
}

/* Fault of a wrong connection for which there is enough evidence, or 0. */
static double connection(double *w) {
    double found = 0.0, most = law_table[L_CHECKS + T_EVIDENCE];
    for (int j = 1; j < WAYS; j++)
        if (w[L_EVIDENCE + j] > most) {
            found = FAULT_CONNECTION + j - 1.0;
            most = w[L_EVIDENCE + j];
        }
    return found != 0.0 ? suspend(w + L_SEEN, found) : 0.0;
}

#if L_PN > 0
/* Whether the last plausible speed and pressure lie where the predictors' model holds. */
static bool modelled(const double *m) {
    const double *model = law_table + L_CHECKS + T_MODEL;
    return model[0] <= m[M_AT] && m[M_AT] <= model[1] && model[2] <= m[M_AT + 1] && m[M_AT + 1] <= model[3];
}

/* Channel k of the displacement if the sensors are connected in way j. */
static double connected(int j, int k, double x, double y) {
    double value = k == 0 ? x : y;
    if (j == 4) return k == 0 ? y : x;
    return (j == 1 && k == 0) || (j == 2 && k == 1) || j == 3 ? -value : value;
}

static void start_predictors(double *w, double x, double y) {
    for (int j = 0; j < WAYS; j++) {
        double *state = w + L_PX + j * L_PN;
        for (int i = 0; i < L_PN; i++) state[i] = 0.0;
        state[L_PN - 2] = connected(j, 0, x, y);
        state[L_PN - 1] = connected(j, 1, x, y);
        w[L_EVIDENCE + j] = 1.0;
    }
}

/* Advance predictor j by the displacement [um] and the output [V]; returns the weighted square of its error. */
static double predictor(double *w, int j, double x, double y, const double u[2]) {
    double *state = w + L_PX + j * L_PN, *next = w + L_PNEW;
    const double *b = w + L_PBLOCK;
    double e0 = connected(j, 0, x, y), e1 = connected(j, 1, x, y);
    for (int k = 0; k < L_PN; k++) {
        e0 -= b[L_PC + k] * state[k];
        e1 -= b[L_PC + L_PN + k] * state[k];
    }
    for (int i = 0; i < L_PN; i++) {
        double total = b[L_PB + 2 * i] * u[0] + b[L_PB + 2 * i + 1] * u[1];
        total += b[L_PL + 2 * i] * e0 + b[L_PL + 2 * i + 1] * e1;
        for (int k = 0; k < L_PN; k++) total += b[i * L_PN + k] * state[k];
        next[i] = total;
    }
    for (int i = 0; i < L_PN; i++) state[i] = next[i];
    return b[L_PS] * e0 * e0 + 2.0 * b[L_PS + 1] * e0 * e1 + b[L_PS + 2] * e1 * e1;
}

/* Advance all predictors by a displacement [m] and the reference [V] that acts while it is measured: the last output. */
static void predict(double *w, double x, double y, bool acting) {
    double *evidence = w + L_EVIDENCE;
    const double *u = w + L_GUARD + G_OUT;
    x = 1e6 * x;
    y = 1e6 * y;
    if (evidence[0] == 0.0) start_predictors(w, x, y);
    double first = predictor(w, 0, x, y, u);
    evidence[0] += (first - evidence[0]) / LATELY;
    for (int j = 1; j < WAYS; j++) {
        double q = predictor(w, j, x, y, u);
        double ratio = evidence[0] > MISSED ? (NU + first) / (NU + q) : 1.0;
        evidence[j] = acting ? larger(DOUBT * evidence[j] * ratio, 1.0) : 1.0;
    }
}
#endif

/* Fault of a finite displacement, or 0. */
static double displacement(double *w, const double measured[N_INPUTS], double x, double y, bool centred) {
    const double *limits = law_table + L_CHECKS;
    double *m = w + L_SEEN;
    for (int k = 0; k < 2; k++) count_repeats(m, k, measured[k]);
    m[M_COUNT] += 1.0;
    double away = larger(fabs(x - m[M_GOOD]), fabs(y - m[M_GOOD + 1]));
    bool paused = m[M_REST] > 0.0;
    bool jumped = m[M_FRESH] > 0.0 && away > limits[T_JUMP];
    if (jumped) w[L_EVIDENCE] = 0.0;
    if (jumped && !paused) {
        m[M_AWAY] += 1.0;
        return m[M_AWAY] <= GLITCH ? FAULT_JUMP : suspend(m, FAULT_JUMP);
    }
    m[M_AWAY] = 0.0;
    m[M_FRESH] = 1.0;
    m[M_GOOD] = x;
    m[M_GOOD + 1] = y;
#if L_PN > 0
    predict(w, x, y, centred && w[L_GUARD + G_BAD] == 0.0 && modelled(m));
#endif
    if (paused) {
        m[M_REST] -= 1.0;
        return m[M_REASON];
    }
    double far = larger(fabs(x - w[L_CENTRE]), fabs(y - w[L_CENTRE + 1]));
    if (centred && far > limits[T_RANGE]) return FAULT_RANGE;
    for (int k = 0; k < 2; k++)
        if (m[M_SAME + k] >= limits[T_STUCK] && m[M_CHANGED + k] > 0.5 * ARMED) return FAULT_STUCK;
    return connection(w);
}

/* Fault of a good sample after which samples have been bad too often, or 0. */
static double unsteady(double *w) {
    double *m = w + L_SEEN;
    m[M_RETURNS] *= FORGOTTEN;
    if (w[L_GUARD + G_BAD] > 0.0) {
        m[M_RETURNS] += 1.0;
        if (m[M_RETURNS] > OFTEN) {
            m[M_RETURNS] = 0.0;
            return suspend(m, FAULT_UNSTEADY);
        }
    }
    return 0.0;
}

/* Alarm code for finite samples, or 0; `in`: what was measured less the runout; `centred` where the law's centre is
   known. */
static double implausible(double *w, const double measured[N_INPUTS], const double in[N_INPUTS], bool centred) {
    double *m = w + L_SEEN;
    bool far = lost(m, 0, law_table + L_CHECKS + T_SPEED, in[2]);
    if (lost(m, 1, law_table + L_CHECKS + T_PRESSURE, in[3])) far = true;
    double fault = displacement(w, measured, in[0], in[1], centred);
    if (fault == 0.0 && far) fault = FAULT_POINT_FAR;
    if (fault == 0.0) {
        m[M_SINCE] += 1.0;
        fault = unsteady(w);
    }
    return fault;
}

#endif
