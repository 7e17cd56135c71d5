/* FMI 3.0 on top of unit.h: co-simulation, and model exchange of what has continuous states. */
#include "fmi3Functions.h"

typedef fmi3Instance Component;
typedef fmi3Float64 Real;
#define VERSION fmi3
#define DERIVATIVES GetContinuousStateDerivatives
#include "face.h"

static void log_message(Unit *u, Outcome outcome, const char *category, const char *text) {
    fmi3LogMessageCallback log;
    memcpy(&log, &u->callback, sizeof log);
    if (log) log(u->environment, statuses[outcome], category, text);
}

/* The master may read the outputs that a sample within its step left, and end the step there or at a later one. */
static void show_between(Unit *u) {
    fmi3IntermediateUpdateCallback update;
    fmi3Boolean asked = false;
    fmi3Float64 at = unit_time(u);
    memcpy(&update, &u->update, sizeof update);
    update(u->environment, at, false, true, true, u->early_return, &asked, &at);
    if (asked && u->early_return) u->return_at = at;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment e, fmi3LogMessageCallback log) {
    (void)resources, (void)visible; /* it reads no files and has no window */
    if (CONTINUOUS) {
        void *callback;
        memcpy(&callback, &log, sizeof callback);
        Unit *u = unit_create(name, token, logging, e, callback, log_message);
        if (u) u->model_exchange = true;
        return u;
    }
    if (log) log(e, fmi3Error, "logStatusError", "model exchange: this unit is for co-simulation only; use that");
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment e,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log) log(e, fmi3Error, "logStatusError", "scheduled execution: this unit is for co-simulation only; use that");
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment e,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    void *callback;
    (void)resources, (void)visible;
    (void)required, (void)n; /* all outputs can be read between samples */
    memcpy(&callback, &log, sizeof callback);
    if (CLOCKED && !events) {
        if (log) log(e, fmi3Error, "logStatusError", "law.clock: ticks in event mode; instantiate with it");
        return NULL;
    }
    Unit *u = unit_create(name, token, logging, e, callback, log_message);
    if (u) {
        u->event_mode = events;
        u->early_return = early;
        memcpy(&u->update, &update, sizeof update);
        u->show_between = update ? show_between : NULL;
    }
    return u;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance, (void)tolerance; /* the steps of the unit are fixed */
    if (!in_phase(c, "fmi3EnterInitializationMode", CREATED, CREATED)) return fmi3Error;
    if (unit_run(c, start, has_stop ? stop : INFINITY) != OK) return fmi3Error;
    return go(c, "fmi3EnterInitializationMode", CREATED, INITIALISING);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Unit *u = c;
    if (!in_phase(u, "fmi3ExitInitializationMode", INITIALISING, INITIALISING) || !unit_initialise(u)) return fmi3Error;
    u->s.phase = u->event_mode || u->model_exchange ? IN_EVENT : STEPPING;
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Unit *u = c;
    if (u && !u->event_mode && !unit_exchanges(u, "fmi3EnterEventMode without event mode", true)) return fmi3Error;
    return go(u, "fmi3EnterEventMode", STEPPING, IN_EVENT);
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    return unit_exchanges(c, "fmi3EnterStepMode", false) ? go(c, "fmi3EnterStepMode", IN_EVENT, STEPPING) : fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
                                    fmi3Boolean *states, fmi3Boolean *next, fmi3Float64 *time) {
    if (!in_phase(c, "fmi3UpdateDiscreteStates", IN_EVENT, IN_EVENT)) return fmi3Error;
    if (again) *again = false;
    if (end) *end = false;
    if (nominals) *nominals = false;
    if (states) *states = false;
    if (next) *next = false;
    if (time) *time = 0.0;
    if (CLOCKED && ((Unit *)c)->s.event) unit_tick(c);
    ((Unit *)c)->s.event = 0;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return done(c != NULL); }

static bool enough(Unit *u, const char *function, size_t given, size_t wanted) {
    return given < wanted ? unit_count(u, function, given, wanted) : u != NULL;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 value[], size_t nv) {
    size_t at = 0;
    if (!c) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        bool array = r[k] < N_VARIABLES && variables[r[k]].store == PRESSURE;
        size_t length = array ? N_PRESSURE : 1;
        if (!enough(c, "fmi3GetFloat64", nv, at + length)) return fmi3Error;
        if (array && !unit_known(c, r[k])) return fmi3Error;
        if (!(array ? unit_film_pressure(c, value + at) : unit_get(c, r[k], REAL, value + at))) return fmi3Error;
        at += length;
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 value[], size_t nv) {
    if (!enough(c, "fmi3SetFloat64", nv, n)) return fmi3Error;
    for (size_t k = 0; k < n; k++)
        if (!unit_set(c, r[k], REAL, value[k])) return fmi3Error;
    return fmi3OK;
}

#define ACCESS(Name, type, kind)                                                                                       \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference r[], size_t n, type value[], size_t nv) {        \
        double v;                                                                                                      \
        if (!enough(c, "fmi3Get" #Name, nv, n)) return fmi3Error;                                                      \
        for (size_t k = 0; k < n; k++) {                                                                               \
            if (!unit_get(c, r[k], kind, &v)) return fmi3Error;                                                        \
            value[k] = (type)v;                                                                                        \
        }                                                                                                              \
        return fmi3OK;                                                                                                 \
    }                                                                                                                  \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference r[], size_t n, const type value[], size_t nv) {  \
        if (!enough(c, "fmi3Set" #Name, nv, n)) return fmi3Error;                                                      \
        for (size_t k = 0; k < n; k++)                                                                                 \
            if (!unit_set(c, r[k], kind, (double)value[k])) return fmi3Error;                                          \
        return fmi3OK;                                                                                                 \
    }

ACCESS(Int32, fmi3Int32, INTEGER)
ACCESS(Boolean, fmi3Boolean, BOOLEAN)

#define NO_SUCH_TYPE(Name, type)                                                                                       \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference r[], size_t n, type value[], size_t nv) {        \
        (void)r, (void)value, (void)nv;                                                                                \
        return n ? not_here(c, "fmi3Get" #Name) : fmi3OK;                                                              \
    }                                                                                                                  \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference r[], size_t n, const type value[], size_t nv) {  \
        (void)r, (void)value, (void)nv;                                                                                \
        return n ? not_here(c, "fmi3Set" #Name) : fmi3OK;                                                              \
    }

NO_SUCH_TYPE(Float32, fmi3Float32)
NO_SUCH_TYPE(Int8, fmi3Int8)
NO_SUCH_TYPE(UInt8, fmi3UInt8)
NO_SUCH_TYPE(Int16, fmi3Int16)
NO_SUCH_TYPE(UInt16, fmi3UInt16)
NO_SUCH_TYPE(UInt32, fmi3UInt32)
NO_SUCH_TYPE(Int64, fmi3Int64)
NO_SUCH_TYPE(UInt64, fmi3UInt64)
NO_SUCH_TYPE(String, fmi3String)

#define REFS const fmi3ValueReference r[], size_t n

NO(GetBinary, REFS, size_t sizes[], fmi3Binary values[], size_t nv)
NO(SetBinary, REFS, const size_t sizes[], const fmi3Binary values[], size_t nv)
#if CLOCKED
fmi3Status fmi3GetClock(fmi3Instance c, REFS, fmi3Clock values[]) {
    double ticks;
    if (!in_phase(c, "fmi3GetClock", IN_EVENT, IN_EVENT)) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (!unit_get(c, r[k], CLOCK, &ticks)) return fmi3Error;
        values[k] = ticks != 0.0;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, REFS, const fmi3Clock values[]) {
    if (!in_phase(c, "fmi3SetClock", IN_EVENT, IN_EVENT)) return fmi3Error;
    for (size_t k = 0; k < n; k++)
        if (!unit_set(c, r[k], CLOCK, values[k])) return fmi3Error;
    return fmi3OK;
}
#else
NO(GetClock, REFS, fmi3Clock values[])
NO(SetClock, REFS, const fmi3Clock values[])
#endif
NO(GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
NO(GetVariableDependencies, fmi3ValueReference r, size_t a[], fmi3ValueReference b[], size_t d[], fmi3DependencyKind k[], size_t n)
NO(GetAdjointDerivative, REFS, const fmi3ValueReference k[], size_t nk, const fmi3Float64 s[], size_t ns, fmi3Float64 d[], size_t nd)
NO(GetIntervalDecimal, REFS, fmi3Float64 v[], fmi3IntervalQualifier q[])
NO(GetIntervalFraction, REFS, fmi3UInt64 v[], fmi3UInt64 s[], fmi3IntervalQualifier q[])
NO(GetShiftDecimal, REFS, fmi3Float64 v[])
NO(GetShiftFraction, REFS, fmi3UInt64 v[], fmi3UInt64 s[])
NO(SetIntervalDecimal, REFS, const fmi3Float64 v[])
NO(SetIntervalFraction, REFS, const fmi3UInt64 v[], const fmi3UInt64 s[])
NO(SetShiftDecimal, REFS, const fmi3Float64 v[])
NO(SetShiftFraction, REFS, const fmi3UInt64 v[], const fmi3UInt64 s[])
NO(GetOutputDerivatives, REFS, const fmi3Int32 o[], fmi3Float64 v[], size_t nv)
NO(ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return not_here(c, "fmi3EnterConfigurationMode"); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return not_here(c, "fmi3ExitConfigurationMode"); }

#if CONTINUOUS
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    if (c && n) *n = 0;
    return done(c && n);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    if (c && n) *n = N_STATES;
    return done(c && n);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    if (!enough(c, "fmi3GetDirectionalDerivative", n_seed, n_knowns)) return fmi3Error;
    if (!enough(c, "fmi3GetDirectionalDerivative", n_sensitivity, n_unknowns)) return fmi3Error;
    return done(unit_directional(c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity));
}
#else
NO(GetNumberOfEventIndicators, size_t *n)
NO(GetNumberOfContinuousStates, size_t *n)
NO(GetDirectionalDerivative, REFS, const fmi3ValueReference k[], size_t nk, const fmi3Float64 s[], size_t ns,
   fmi3Float64 d[], size_t nd)
#endif

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 now, fmi3Float64 length, fmi3Boolean no_way_back, fmi3Boolean *event,
                      fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached) {
    Unit *u = c;
    double at;
    (void)no_way_back; /* states are kept by who asked for them */
    if (!unit_exchanges(u, "fmi3DoStep", false) || !in_phase(u, "fmi3DoStep", STEPPING, STEPPING)) return fmi3Error;
    int64_t before = u->s.count;
    u->return_at = INFINITY;
    Outcome outcome = unit_step(u, now, length, &at);
    bool short_of = outcome != FAILED && (double)(u->s.count - before) * SAMPLE < length - 0.5 * SAMPLE;
    if (event) *event = u->event_mode && u->s.event;
    if (end) *end = false;
    if (early) *early = short_of;
    if (reached) *reached = at;
    return statuses[outcome];
}
