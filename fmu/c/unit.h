/* A plant in a functional mock-up unit: what the FMI 2.0 and 3.0 faces share. Sizes and tables come from tables.h. */
#ifndef UNIT_H
#define UNIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tables.h"

typedef enum { REAL, INTEGER, BOOLEAN } Kind;
typedef enum { TIME, INPUT, OUTPUT, PARAMETER, SEED, CONSTANT, PRESSURE } Store;
typedef enum { NEVER, BEFORE_START, ALWAYS } Settable;
typedef enum { CREATED, INITIALISING, STEPPING, IN_EVENT, TERMINATED } Phase;
typedef enum { OK, WARNING, DISCARD, FAILED } Outcome;

/* One variable; its value reference is its place in `variables`. */
typedef struct {
    const char *name, *unit;
    Kind kind;
    Store store;
    Settable settable;
    int index;
    bool whole;
    double low, high, value;
} Variable;

/* `count` equal values in a row of the workspace before any state is put in. */
typedef struct {
    int32_t count;
    double value;
} Run;

extern const Variable variables[N_VARIABLES];
extern const Run initial_runs[N_RUNS];
extern const double initial_parameters[N_P];
extern const int64_t indices[N_IX];
extern const int32_t pressure_nodes[N_PRESSURE + 1][2];

/* All that a saved state holds, byte for byte. */
typedef struct {
    char magic[8];
    char hash[40];
    uint64_t size, check;
    int64_t count;
    double start, seed;
    int64_t phase, touching, event, settled;
    double inputs[N_INPUTS], outputs[N_OUT], parameters[N_P], w[N_W];
} State;

typedef struct Unit {
    State s;
    double initial[N_W];
    bool logging, event_mode, early_return, has_refused;
    uint32_t refused;
    char refusal[400];
    char *name;
    void *environment, *callback;
    void (*say)(struct Unit *, Outcome, const char *category, const char *text);
} Unit;

Unit *unit_create(const char *name, const char *token, bool logging, void *environment, void *callback,
                  void (*say)(Unit *, Outcome, const char *, const char *));
void unit_free(Unit *u);
void unit_reset(Unit *u);
Outcome unit_fail(Unit *u, Outcome outcome, const char *format, ...);

bool unit_get(Unit *u, uint32_t reference, Kind kind, double *value);
bool unit_set(Unit *u, uint32_t reference, Kind kind, double value);
bool unit_film_pressure(Unit *u, double *values);

Outcome unit_start_at(Unit *u, double time);
bool unit_initialise(Unit *u);
Outcome unit_step(Unit *u, double now, double length, double *reached);
double unit_time(const Unit *u);

State *unit_save(Unit *u, State *into);
bool unit_restore(Unit *u, const State *from);
bool unit_serialise(Unit *u, const State *from, void *bytes, size_t size);
State *unit_deserialise(Unit *u, const void *bytes, size_t size);

#endif
