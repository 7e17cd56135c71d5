/* FMI 2.0 on top of unit.h: co-simulation, and model exchange of what has continuous states. */
#include "fmi2Functions.h"

typedef fmi2Component Component;
typedef fmi2Real Real;
#define VERSION fmi2
#define DERIVATIVES GetDerivatives
#define fmi2FMUState fmi2FMUstate
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#include "face.h"

/* The text is the format itself, because some importers show that and nothing else. */
static void log_message(Unit *u, Outcome outcome, const char *category, const char *text) {
    const fmi2CallbackFunctions *f = u->callback;
    char format[1000], *at = format;
    for (; *text && at < format + sizeof format - 3; text++) {
        if (*text == '%') *at++ = '%';
        *at++ = *text;
    }
    *at = 0;
    if (f && f->logger) f->logger(u->environment, u->name, statuses[outcome], category, format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources, (void)visible; /* it reads no files and has no window */
    if (type != fmi2CoSimulation && !CONTINUOUS) {
        if (functions && functions->logger)
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError",
                              "model exchange: this unit is for co-simulation only; use that");
        return NULL;
    }
    Unit *u = unit_create(name, guid, logging, functions ? functions->componentEnvironment : NULL, (void *)functions, log_message);
    if (u) u->model_exchange = type == fmi2ModelExchange;
    return u;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance; /* the steps of the unit are fixed */
    if (!in_phase(c, "fmi2SetupExperiment", CREATED, CREATED)) return fmi2Error;
    return statuses[unit_run(c, start, has_stop ? stop : INFINITY)];
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return go(c, "fmi2EnterInitializationMode", CREATED, INITIALISING);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    if (!in_phase(c, "fmi2ExitInitializationMode", INITIALISING, INITIALISING) || !unit_initialise(c)) return fmi2Error;
    ((Unit *)c)->s.phase = ((Unit *)c)->model_exchange ? IN_EVENT : STEPPING;
    return fmi2OK;
}

#define ACCESS(Name, type, kind)                                                                            \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference r[], size_t n, type value[]) {       \
        double v;                                                                                           \
        if (!c) return fmi2Error;                                                                           \
        for (size_t k = 0; k < n; k++) {                                                                    \
            if (!unit_get(c, r[k], kind, &v)) return fmi2Error;                                             \
            value[k] = (type)v;                                                                             \
        }                                                                                                   \
        return fmi2OK;                                                                                      \
    }                                                                                                       \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference r[], size_t n, const type value[]) { \
        if (!c) return fmi2Error;                                                                           \
        for (size_t k = 0; k < n; k++)                                                                      \
            if (!unit_set(c, r[k], kind, (double)value[k])) return fmi2Error;                               \
        return fmi2OK;                                                                                      \
    }

ACCESS(Real, fmi2Real, REAL)
ACCESS(Integer, fmi2Integer, INTEGER)
ACCESS(Boolean, fmi2Boolean, BOOLEAN)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String value[]) {
    (void)r, (void)value;
    return n ? not_here(c, "fmi2GetString") : fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String value[]) {
    (void)r, (void)value;
    return n ? not_here(c, "fmi2SetString") : fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
                                       const fmi2Real v[]) {
    (void)r, (void)n, (void)o, (void)v;
    return not_here(c, "fmi2SetRealInputDerivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
                                        fmi2Real v[]) {
    (void)r, (void)n, (void)o, (void)v;
    return not_here(c, "fmi2GetRealOutputDerivatives");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real length, fmi2Boolean no_way_back) {
    double reached;
    (void)no_way_back; /* states are kept by who asked for them */
    if (!unit_exchanges(c, "fmi2DoStep", false) || !in_phase(c, "fmi2DoStep", STEPPING, STEPPING)) return fmi2Error;
    return statuses[unit_step(c, now, length, &reached)];
}

fmi2Status fmi2CancelStep(fmi2Component c) { return not_here(c, "fmi2CancelStep"); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return not_here(c, "fmi2GetStatus");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (!c || !value || kind != fmi2LastSuccessfulTime) return not_here(c, "fmi2GetRealStatus");
    *value = unit_time(c);
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return not_here(c, "fmi2GetIntegerStatus");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (!c || !value || kind != fmi2Terminated) return not_here(c, "fmi2GetBooleanStatus");
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return not_here(c, "fmi2GetStringStatus");
}

#if CONTINUOUS
fmi2Status fmi2EnterEventMode(fmi2Component c) {
    return unit_exchanges(c, "fmi2EnterEventMode", true) ? go(c, "fmi2EnterEventMode", STEPPING, IN_EVENT) : fmi2Error;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    if (!unit_exchanges(c, "fmi2NewDiscreteStates", true) || !info) return fmi2Error;
    if (!in_phase(c, "fmi2NewDiscreteStates", IN_EVENT, IN_EVENT)) return fmi2Error;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    return done(c && unit_directional(c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity));
}
#else
fmi2Status fmi2EnterEventMode(fmi2Component c) { return not_here(c, "fmi2EnterEventMode"); }
NO(NewDiscreteStates, fmi2EventInfo *info)
NO(GetDirectionalDerivative, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[], size_t nk,
   const fmi2Real in[], fmi2Real out[])
#endif
