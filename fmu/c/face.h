/* The calls that FMI 2.0 and 3.0 have alike. A face defines before it: VERSION (fmi2, fmi3), the types Component and Real,
   DERIVATIVES (its name of that call) and log_message after it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

#define GLUE_(a, b) a##b
#define GLUE(a, b) GLUE_(a, b)
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)
#define FMI(name) GLUE(VERSION, name)
#define CALL(name) TEXT(FMI(name))
#define NO(name, ...) \
    FMI(Status) FMI(name)(Component c, __VA_ARGS__) { return not_here(c, CALL(name)); }

static const FMI(Status) statuses[] = {FMI(OK), FMI(Warning), FMI(Error)};

static FMI(Status) done(bool well) { return well ? FMI(OK) : FMI(Error); }

static FMI(Status) not_here(Component c, const char *function) {
    return c ? statuses[unit_fail(c, FAILED, "%s: this unit has no such thing; see its capability flags", function)] : FMI(Error);
}

/* Refuse a call that comes in the wrong order, or go from one phase to the next. */
static bool in_phase(Unit *u, const char *function, Phase first, Phase last) {
    if (!u) return false;
    if ((Phase)u->s.phase >= first && (Phase)u->s.phase <= last) return true;
    unit_fail(u, FAILED, "%s: not allowed now; initialise, step and terminate in this order", function);
    return false;
}

static FMI(Status) go(Unit *u, const char *function, Phase from, Phase to) {
    if (!in_phase(u, function, from, from)) return FMI(Error);
    u->s.phase = to;
    return FMI(OK);
}

const char *FMI(GetVersion)(void) { return FMI(Version); }

FMI(Status) FMI(SetDebugLogging)(Component c, FMI(Boolean) on, size_t n, const FMI(String) categories[]) {
    return done(c && unit_log(c, on, n, categories));
}

void FMI(FreeInstance)(Component c) { unit_free(c); }

FMI(Status) FMI(Terminate)(Component c) {
    if (!in_phase(c, CALL(Terminate), STEPPING, IN_EVENT)) return FMI(Error);
    ((Unit *)c)->s.phase = TERMINATED;
    return FMI(OK);
}

FMI(Status) FMI(Reset)(Component c) {
    bool well = unit_allows(c, CALL(Reset));
    if (well) unit_reset(c);
    return done(well);
}

FMI(Status) FMI(GetFMUState)(Component c, FMI(FMUState) *state) { return done(unit_save(c, state)); }

FMI(Status) FMI(SetFMUState)(Component c, FMI(FMUState) state) { return done(unit_restore(c, state)); }

FMI(Status) FMI(FreeFMUState)(Component c, FMI(FMUState) *state) { return done(unit_drop(c, state)); }

FMI(Status) FMI(SerializedFMUStateSize)(Component c, FMI(FMUState) state, size_t *size) {
    (void)state;
    return done(unit_state_size(c, size));
}

FMI(Status) FMI(SerializeFMUState)(Component c, FMI(FMUState) state, FMI(Byte) bytes[], size_t size) {
    return done(unit_serialise(c, state, bytes, size));
}

FMI(Status) FMI(DeserializeFMUState)(Component c, const FMI(Byte) bytes[], size_t size, FMI(FMUState) *state) {
    return done(unit_deserialise(c, bytes, size, state));
}

#if CONTINUOUS
FMI(Status) FMI(EnterContinuousTimeMode)(Component c) {
    if (!unit_exchanges(c, CALL(EnterContinuousTimeMode), true)) return FMI(Error);
    return go(c, CALL(EnterContinuousTimeMode), IN_EVENT, STEPPING);
}

FMI(Status) FMI(CompletedIntegratorStep)(Component c, FMI(Boolean) no_way_back, FMI(Boolean) *event, FMI(Boolean) *end) {
    (void)no_way_back;
    if (!unit_exchanges(c, CALL(CompletedIntegratorStep), true) || !event || !end) return FMI(Error);
    *event = *end = false;
    return statuses[unit_check_end(c, unit_time(c))]; /* a solver may try beyond the stop time, not go there */
}

FMI(Status) FMI(SetTime)(Component c, Real time) {
    return unit_exchanges(c, CALL(SetTime), true) ? statuses[unit_set_time(c, time)] : FMI(Error);
}

FMI(Status) FMI(SetContinuousStates)(Component c, const Real x[], size_t n) {
    return done(unit_exchanges(c, CALL(SetContinuousStates), true) &&
                unit_count(c, CALL(SetContinuousStates), n, N_STATES) && unit_set_states(c, x));
}

FMI(Status) FMI(GetContinuousStates)(Component c, Real x[], size_t n) {
    if (!unit_exchanges(c, CALL(GetContinuousStates), true)) return FMI(Error);
    if (!unit_count(c, CALL(GetContinuousStates), n, N_STATES)) return FMI(Error);
    memcpy(x, ((Unit *)c)->s.w, sizeof(double) * N_STATES);
    return FMI(OK);
}

FMI(Status) FMI(DERIVATIVES)(Component c, Real x[], size_t n) {
    if (!unit_exchanges(c, CALL(DERIVATIVES), true)) return FMI(Error);
    if (!unit_count(c, CALL(DERIVATIVES), n, N_STATES)) return FMI(Error);
    if (unit_check_inputs(c) == FAILED || !unit_refresh(c)) return FMI(Error);
    memcpy(x, ((Unit *)c)->derivatives, sizeof(double) * N_STATES);
    return FMI(OK);
}

FMI(Status) FMI(GetEventIndicators)(Component c, Real x[], size_t n) {
    (void)x;
    return done(unit_count(c, CALL(GetEventIndicators), n, 0));
}

FMI(Status) FMI(GetNominalsOfContinuousStates)(Component c, Real x[], size_t n) {
    if (!unit_count(c, CALL(GetNominalsOfContinuousStates), n, N_STATES)) return FMI(Error);
    memcpy(x, (const double[])NOMINALS, sizeof(double) * N_STATES);
    return FMI(OK);
}
#else
FMI(Status) FMI(EnterContinuousTimeMode)(Component c) { return not_here(c, CALL(EnterContinuousTimeMode)); }
NO(CompletedIntegratorStep, FMI(Boolean) no_way_back, FMI(Boolean) *event, FMI(Boolean) *end)
NO(SetTime, Real time)
NO(SetContinuousStates, const Real x[], size_t n)
NO(GetContinuousStates, Real x[], size_t n)
NO(DERIVATIVES, Real x[], size_t n)
NO(GetEventIndicators, Real x[], size_t n)
NO(GetNominalsOfContinuousStates, Real x[], size_t n)
#endif
