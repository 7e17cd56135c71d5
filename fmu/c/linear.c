/* A linear model in a unit: dx/dt = A x + B u, y = C x + D u, or sampled; A, B, C, D move with speed and pressure.

   theta is polynomial in the scaled scheduling variables, every element of [A B; C D] is a sum of terms in theta. In
   co-simulation a continuous model is stepped exactly for inputs held over a sample (matrix exponential). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

#define N_U (N_INPUTS - 2) /* the last two inputs are speed and pressure */
#define ROWS (N_STATES + N_OUT)
#define COLUMNS (N_STATES + N_U)

static const double middle[2] = MIDDLE, half_range[2] = HALF_RANGE;

/* theta (0) and its derivatives by speed (1) and pressure (2), at the present operating point. */
static void parameters(const Unit *u, double theta[3][N_THETA]) {
    double q[2], power[2][2]; /* power[v][d]: the d-th derivative of a monomial's factor in variable v */
    for (int v = 0; v < 2; v++) q[v] = (u->s.inputs[N_U + v] - middle[v]) / half_range[v];
    memset(theta, 0, 3 * N_THETA * sizeof(double));
    for (int t = 0; t < N_BASIS; t++) {
        for (int v = 0; v < 2; v++) {
            int e = exponents[t][v];
            power[v][0] = pow(q[v], e);
            power[v][1] = e ? e * pow(q[v], e - 1) / half_range[v] : 0.0;
        }
        for (int k = 0; k < N_THETA; k++) {
            theta[0][k] += surfaces[k][t] * power[0][0] * power[1][0];
            theta[1][k] += surfaces[k][t] * power[0][1] * power[1][0];
            theta[2][k] += surfaces[k][t] * power[0][0] * power[1][1];
        }
    }
}

/* [A B; C D], and if wanted its derivatives by speed and pressure. */
static void matrices(const Unit *u, double M[ROWS][COLUMNS], double by_speed[ROWS][COLUMNS],
                     double by_pressure[ROWS][COLUMNS]) {
    double theta[3][N_THETA];
    double(*by[3])[COLUMNS] = {M, by_speed, by_pressure};
    parameters(u, theta);
    for (int d = 0; d < 3; d++)
        if (by[d]) memset(by[d], 0, sizeof(double) * ROWS * COLUMNS);
    for (int k = 0; k < N_TERMS; k++) {
        const Term *t = &terms[k];
        double a = t->i < 0 ? 1.0 : theta[0][t->i], b = t->j < 0 ? 1.0 : theta[0][t->j];
        M[t->row][t->column] += t->factor * a * b;
        for (int d = 1; d < 3; d++) {
            double da = t->i < 0 ? 0.0 : theta[d][t->i], db = t->j < 0 ? 0.0 : theta[d][t->j];
            if (by[d]) by[d][t->row][t->column] += t->factor * (da * b + a * db);
        }
    }
}

static double row_times(const Unit *u, double row[COLUMNS]) {
    double sum = 0.0;
    for (int k = 0; k < N_STATES; k++) sum += row[k] * u->s.w[k];
    for (int k = 0; k < N_U; k++) sum += row[N_STATES + k] * u->s.inputs[k];
    return sum;
}

bool unit_refresh(Unit *u) {
    double M[ROWS][COLUMNS];
    matrices(u, M, NULL, NULL);
    for (int r = 0; r < N_STATES; r++) u->derivatives[r] = row_times(u, M[r]);
    for (int r = 0; r < N_OUT; r++) u->s.outputs[r] = row_times(u, M[N_STATES + r]);
    return true;
}

bool unit_initialise(Unit *u) {
    if (!unit_may_begin(u)) return false;
    u->s.settled = 1;
    return unit_refresh(u);
}

#if CONTINUOUS
typedef double Square[COLUMNS][COLUMNS];

static void multiply(Square a, Square b, Square product) {
    for (int r = 0; r < COLUMNS; r++)
        for (int c = 0; c < COLUMNS; c++) {
            double sum = 0.0;
            for (int k = 0; k < COLUMNS; k++) sum += a[r][k] * b[k][c];
            product[r][c] = sum;
        }
}

/* exp of [A B; 0 0] times SAMPLE: Taylor's series of a scaled matrix, squared. States are counted in powers of two near
   their typical sizes, or displacements [m] next to voltages would cost most of the digits. */
static void hold(double M[ROWS][COLUMNS], Square held) {
    static const double sizes[N_STATES] = NOMINALS;
    Square scaled = {{0}}, term, next;
    double norm = 0.0;
    int squarings = 0, power[COLUMNS] = {0};
    for (int r = 0; r < N_STATES; r++) frexp(sizes[r], &power[r]);
    for (int r = 0; r < N_STATES; r++) {
        double sum = 0.0;
        for (int c = 0; c < COLUMNS; c++) {
            scaled[r][c] = ldexp(M[r][c] * SAMPLE, power[c] - power[r]);
            sum += fabs(scaled[r][c]);
        }
        norm = fmax(norm, sum);
    }
    while (norm > 0.25 && squarings < 60) norm *= 0.5, squarings++;
    for (int r = 0; r < N_STATES; r++)
        for (int c = 0; c < COLUMNS; c++) scaled[r][c] = ldexp(scaled[r][c], -squarings);
    memset(held, 0, sizeof(Square));
    for (int r = 0; r < COLUMNS; r++) held[r][r] = 1.0;
    memcpy(term, held, sizeof(Square));
    for (int n = 1; n <= 14; n++) {
        multiply(term, scaled, next);
        for (int r = 0; r < COLUMNS; r++)
            for (int c = 0; c < COLUMNS; c++) held[r][c] += term[r][c] = next[r][c] / n;
    }
    for (int n = 0; n < squarings; n++) {
        multiply(held, held, next);
        memcpy(held, next, sizeof(Square));
    }
    for (int r = 0; r < N_STATES; r++)
        for (int c = 0; c < COLUMNS; c++) held[r][c] = ldexp(held[r][c], power[r] - power[c]);
}
#endif

Outcome unit_step(Unit *u, double now, double length, double *reached) {
    double M[ROWS][COLUMNS], x[N_STATES];
    Outcome outcome;
    int64_t n = unit_samples_in(u, now, length, &outcome);
    if (n) {
        matrices(u, M, NULL, NULL);
#if CONTINUOUS
        Square held;
        hold(M, held);
        memcpy(M, held, sizeof(double) * N_STATES * COLUMNS);
#endif
        for (int64_t k = 0; k < n; k++) {
            for (int r = 0; r < N_STATES; r++) x[r] = row_times(u, M[r]);
            memcpy(u->s.w, x, sizeof x);
            u->s.count++;
            if (unit_ends_early(u, n - k - 1)) break;
        }
        unit_refresh(u);
        for (int r = 0; r < N_OUT; r++)
            if (!isfinite(u->s.outputs[r])) {
                outcome = unit_fail(u, FAILED, "t = %.4f s: an output is not a number any more; check the inputs", unit_time(u));
                break;
            }
    }
    *reached = unit_time(u);
    return outcome;
}

void unit_tick(Unit *u) { (void)u; }

bool unit_film_pressure(Unit *u, double *values) {
    (void)u, (void)values;
    return false;
}

/* Place of a known in (states, inputs), or -1. */
static int known_place(uint32_t reference) {
    if (reference >= N_VARIABLES) return -1;
    if (variables[reference].store == STATE) return variables[reference].index;
    return variables[reference].store == INPUT ? N_STATES + variables[reference].index : -1;
}

static int unknown_row(uint32_t reference) {
    if (reference >= N_VARIABLES) return -1;
    if (variables[reference].store == DERIVATIVE) return variables[reference].index;
    return variables[reference].store == OUTPUT ? N_STATES + variables[reference].index : -1;
}

bool unit_directional(Unit *u, const uint32_t unknowns[], size_t n_unknowns, const uint32_t knowns[], size_t n_knowns,
                      const double seed[], double sensitivity[]) {
    double M[ROWS][COLUMNS], by[2][ROWS][COLUMNS];
    matrices(u, M, by[0], by[1]);
    for (size_t i = 0; i < n_unknowns; i++) {
        int r = unknown_row(unknowns[i]);
        double sum = 0.0;
        for (size_t k = 0; r >= 0 && k < n_knowns; k++) {
            int c = known_place(knowns[k]);
            if (c < 0) r = -1;
            else sum += seed[k] * (c < COLUMNS ? M[r][c] : row_times(u, by[c - COLUMNS][r]));
        }
        if (r < 0) {
            unit_fail(u, FAILED, "directional derivative: is of outputs and derivatives by states and inputs; ask for those");
            return false;
        }
        sensitivity[i] = sum;
    }
    return true;
}
