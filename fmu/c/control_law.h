#ifndef LAW_H
#define LAW_H

#include "tables.h"

typedef LAW_REAL law_real;

/* Matrices of the law at an operating point; W: anti-windup gain. */
typedef struct {
    law_real A[LAW_STATES][LAW_STATES], B[LAW_STATES][2], C[2][LAW_STATES], D[2][2], W[LAW_STATES][2];
} law_matrices;

/* Guard against bad samples: the last output [V], that from which it fades or returns, bad samples in a row, samples until
   the law acts fully again, and how many those were, alarm now, last alarm, number of bad samples, largest step [V]. */
typedef struct {
    law_real out[2], begin[2], bad, back, span, alarm, last, lost, step;
} law_guard;

#if LAW_CHECKED
/* Limits beyond which a sample is implausible. */
typedef struct {
    law_real jump, range, stuck, speed[3], pressure[3], evidence, model_speed[2], model_pressure[2];
} law_limits;
#endif

#if LAW_PREDICTED
/* Kalman predictor of the displacement [um] from the reference [V]; S: inverse covariance of its error (xx, xy, yy). */
typedef struct {
    law_real A[LAW_PREDICTED][LAW_PREDICTED], B[LAW_PREDICTED][2], C[2][LAW_PREDICTED], L[LAW_PREDICTED][2], S[3];
} law_predictor;
#endif

#if LAW_CHECKED
/* Memory of the plausibility checks. */
typedef struct {
    law_real seen[2], good[2], same[2], changed[2]; /* last sample, last without a jump, repeats, changes at the start */
    law_real at[2], known[2], other[2], held[2];    /* speed and pressure: last good one, whether there is one, another
                                                       value and for how many samples it has stood */
    law_real count, fresh, away;                    /* first samples, whether the last was finite, jumped ones in a row */
    law_real rest, reason, length, since, returns;  /* pause: samples left, alarm, length, good samples since; returns */
#if LAW_PREDICTED
    law_predictor now;                              /* predictor of the operating point */
    law_real x[LAW_WAYS][LAW_PREDICTED], next[LAW_PREDICTED];
    law_real evidence[LAW_WAYS], until_read;
    law_real acts, acting[2];                       /* whether and which reference [V] acts in this sample */
#endif
} law_checks;
#endif

/* All that a running law remembers: of fixed size, all numbers; copy it to save a state. Counts are whole numbers. */
typedef struct {
    law_matrices now;               /* matrices of the operating point */
    law_real x[LAW_STATES], next[LAW_STATES];
    law_real centre[2], sums[2];    /* position that asks for nothing [m]; sums of the displacement while it is sought */
    law_real count, until_read;     /* samples since the start, and until the table is read again */
    law_guard guard;
#if LAW_CHECKED
    law_checks checks;
#endif
} law_memory;

/* Forget the past; call it once before the first sample. */
void law_reset(law_memory *law);

/* One sample: the reference [V] for the displacement [m], speed [rad/s], gauge pressure [Pa] and shaft angle [rad].
   Returns the alarm: 0 as long as the law acts fully. */
int law_step(law_memory *law, const law_real measured[2], law_real speed, law_real pressure, law_real angle,
             law_real reference[2]);

#if LAW_PREDICTED
/* Before law_step, where the reference [V] that acts in this sample is not the last one that the law gave. */
void law_applied(law_memory *law, const law_real reference[2]);
#endif

#if LAW_TESTED
/* Whether this build computes what it was exported with: 0, or LAW_NOT_IEEE, LAW_OTHER_BITS. Resets the memory. */
#define LAW_NOT_IEEE 1   /* NaN is not kept out, or the output is wrong: compiled with -ffast-math? */
#define LAW_OTHER_BITS 2 /* right but for rounding: fused or extended arithmetic (-ffp-contract=off, no x87) */
int law_self_test(law_memory *law);
#endif

#endif
