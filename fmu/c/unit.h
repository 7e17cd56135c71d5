/* A functional mock-up unit: what the FMI 2.0 and 3.0 faces and what a unit can hold (plant.c, linear.c) share. Sizes and tables come from tables.h. */
#ifndef UNIT_H
#define UNIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tables.h"
#if GUARDED
#include "control_law.h"
#endif

#define TO_RPM 9.549296585513721

typedef enum { REAL, INTEGER, BOOLEAN, CLOCK } Kind;
typedef enum { TIME, INPUT, OUTPUT, PARAMETER, SEED, CONSTANT, PRESSURE, STATE, DERIVATIVE, TURNED, TICKS } Store;
typedef enum { NEVER, BEFORE_START, ALWAYS } Settable;
/* BETWEEN: within a communication step, while the master reads the outputs of a sample. */
typedef enum { CREATED, INITIALISING, STEPPING, IN_EVENT, TERMINATED, BETWEEN } Phase;
typedef enum { OK, WARNING, FAILED } Outcome;

/* One variable; its value reference is its place in `variables`. A value outside low to high is refused, for the reason
   `why`; one outside the checked range is warned of once in a run, with the sentence `beyond`. */
typedef struct {
    const char *name, *unit;
    Kind kind;
    Store store;
    Settable settable;
    int index;
    double low, high, value, checked_low, checked_high;
    const char *why, *beyond;
} Variable;

/* `count` equal values in a row of the workspace before any state is put in. */
typedef struct {
    int32_t count;
    double value;
} Run;

/* A step of a formula: x a, x / a, a / x, x + a, the root of x, or the factor on a viscosity by Sutherland's law. */
typedef struct {
    enum { TIMES, BY, UNDER, PLUS, ROOT, VISCOSITY } kind;
    double a;
} Operation;

/* Entries of the workspace at the start, or of the parameters, that follow from a number that can be set; the least of
   several films where they share an entry. */
typedef struct {
    int32_t turned;
    bool in_record, least;
    int32_t place, count, first, n_operations;
} Entries;

/* A number that is chosen from a list: its place among those that can be set, and the list in `chosen`. */
typedef struct {
    int32_t turned, first, count;
} Choice;

/* A machine that the choices lead to: where its workspace begins in the runs, and which entries can be set. */
typedef struct {
    int32_t run, first, count;
} Variant;

/* Adds factor x theta[i] x theta[j] (theta[-1] = 1) to an element of [A B; C D]. */
typedef struct {
    int32_t row, column, i, j;
    double factor;
} Term;

extern const Variable variables[N_VARIABLES];
extern const Run initial_runs[N_RUNS];
extern const double initial_parameters[N_VARIANTS * N_P];
extern const int64_t indices[N_VARIANTS * N_IX];
extern const Variant variants[N_VARIANTS];
extern const Choice choices[N_CHOICES + 1];
extern const double chosen[N_CHOSEN + 1];
extern const int32_t pressure_nodes[N_PRESSURE + 1][2];
extern const Entries entries[N_ENTRIES + 1];
extern const Operation operations[];
#if N_STATES
extern const Term terms[N_TERMS];
extern const double surfaces[N_THETA][N_BASIS];
extern const int32_t exponents[N_BASIS][2];
#endif

/* All that a saved state holds, byte for byte. */
typedef struct {
    char magic[8];
    char hash[40];
    uint64_t size, check;
    int64_t count;
    double start, stop, seed;
    int64_t phase, touching, event, settled;
    double inputs[N_INPUTS], outputs[N_OUT], parameters[N_P], turned[N_TURNED + 1], w[N_W];
} State;

typedef struct Unit {
    State s;
    double initial[N_W], gathered[N_P], effective[N_P], derivatives[N_STATES + 1];
    bool logging, event_mode, early_return, model_exchange, has_gathered, has_refused, has_warned[N_VARIABLES];
    uint32_t refused;
    char refusal[400];
    char *name;
    void *environment, *callback, *update, *room;
    double return_at;
    void (*log_message)(struct Unit *, Outcome, const char *category, const char *text);
    void (*show_between)(struct Unit *);
} Unit;

Unit *unit_create(const char *name, const char *token, bool logging, void *environment, void *callback,
                  void (*log_message)(Unit *, Outcome, const char *, const char *));
void unit_free(Unit *u);
void unit_expand(Unit *u, const Run *first);
void unit_reset(Unit *u);
Outcome unit_tell(Unit *u, Outcome outcome, const char *category, const char *format, ...);
Outcome unit_fail(Unit *u, Outcome outcome, const char *format, ...);
bool unit_log(Unit *u, bool on, size_t n, const char *const categories[]);
bool unit_exchanges(Unit *u, const char *function, bool exchange);
bool unit_count(Unit *u, const char *function, size_t given, size_t wanted);

bool unit_known(Unit *u, uint32_t reference);
bool unit_get(Unit *u, uint32_t reference, Kind kind, double *value);
bool unit_set(Unit *u, uint32_t reference, Kind kind, double value);

Outcome unit_run(Unit *u, double start, double stop);
Outcome unit_set_time(Unit *u, double time);
Outcome unit_check_end(Unit *u, double time);
bool unit_set_states(Unit *u, const double x[]);
double unit_time(const Unit *u);
Outcome unit_check_inputs(Unit *u);
bool unit_may_begin(Unit *u);
int64_t unit_samples_in(Unit *u, double now, double length, Outcome *outcome);
bool unit_ends_early(Unit *u, int64_t left);
bool unit_allows(Unit *u, const char *function);

/* What a unit holds, in plant.c or linear.c: outputs as they are now, a communication step, and what not all have. */
bool unit_initialise(Unit *u);
bool unit_refresh(Unit *u);
Outcome unit_step(Unit *u, double now, double length, double *reached);
bool unit_film_pressure(Unit *u, double *values);
void unit_tick(Unit *u);
bool unit_directional(Unit *u, const uint32_t unknowns[], size_t n_unknowns, const uint32_t knowns[], size_t n_knowns,
                      const double seed[], double sensitivity[]);

bool unit_save(Unit *u, void **state);
bool unit_drop(Unit *u, void **state);
bool unit_state_size(Unit *u, size_t *size);
bool unit_restore(Unit *u, const State *from);
bool unit_serialise(Unit *u, const State *from, void *bytes, size_t size);
bool unit_deserialise(Unit *u, const void *bytes, size_t size, void **state);

#endif
