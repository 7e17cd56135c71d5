/* A random master of a unit for libFuzzer: bytes choose calls, references and values. Built by test_unit_sanitised.py. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "unit.h"

static const uint8_t *at, *end;
static fmi3Instance unit;

static uint8_t byte(void) { return at < end ? *at++ : 0; }

static double number(void) {
    static const double usual[] = {0.0,  1.0,      -1.0,     SAMPLE,        2 * SAMPLE, 5 * SAMPLE, 0.5 * SAMPLE, 300.0,
                                   3e5,  -2e5,     1e-6,     1e300,         -1e300,     5e-324,     NAN,          INFINITY};
    uint8_t kind = byte();
    double value = 0.0;
    if (kind < 240) return usual[kind % 16];
    for (size_t k = 0; k < sizeof value; k++) ((uint8_t *)&value)[k] = byte();
    return value;
}

/* A communication step: a few samples, or one that is refused. */
static double length(void) {
    double h = number();
    return h > 5 * SAMPLE && h < 1e6 ? SAMPLE : h;
}

static fmi3ValueReference reference(void) {
    unsigned r = byte() + 256u * byte();
    return r >= 65000 ? 0xffffffffu - r : r % (N_VARIABLES + 2);
}

static void report3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
    (void)e, (void)s;
    if (!strlen(category) || !strlen(text)) abort();
}

static void report2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)s;
    if (!strlen(category) || !strlen(text)) abort();
}

/* Outputs are read within the step, and what is not allowed there is tried. */
static void between(fmi3InstanceEnvironment e, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                    fmi3Boolean can_return, fmi3Boolean *asked, fmi3Float64 *until) {
    fmi3ValueReference r = reference();
    double values[N_PRESSURE + 1] = {1.0}, reached;
    fmi3Boolean event, over, early;
    (void)e, (void)set, (void)get, (void)finished, (void)can_return;
    fmi3GetFloat64(unit, &r, 1, values, N_PRESSURE + 1);
    uint8_t what = byte();
    if (what % 8 == 0 && fmi3DoStep(unit, time, SAMPLE, true, &event, &over, &early, &reached) != fmi3Error) abort();
    if (what % 8 == 1 && fmi3Reset(unit) != fmi3Error) abort();
    if (what % 8 == 2) fmi3FreeInstance(unit);
    if (what % 8 == 3 && fmi3SetFloat64(unit, &r, 1, values, 1) != fmi3Error) abort();
    if (what & 64) *asked = true, *until = what & 128 ? time : number();
}

static void states(void) {
    fmi3FMUState state = NULL, other = NULL;
    size_t size = 0;
    if (fmi3GetFMUState(unit, &state) == fmi3OK && fmi3SerializedFMUStateSize(unit, state, &size) == fmi3OK) {
        fmi3Byte *bytes = malloc(size);
        if (fmi3SerializeFMUState(unit, state, bytes, size) != fmi3OK) abort();
        if (byte() % 2) bytes[(byte() * 256u + byte()) % size] ^= byte();
        if (fmi3DeserializeFMUState(unit, bytes, size - byte() % 2, &other) == fmi3OK) fmi3SetFMUState(unit, other);
        free(bytes);
    }
    fmi3FreeFMUState(unit, &state);
    fmi3FreeFMUState(unit, &other);
}

static void values3(void) {
    fmi3ValueReference r[2] = {reference(), reference()};
    double x[N_PRESSURE + 2] = {number(), number()};
    fmi3Int32 whole[2] = {(fmi3Int32)byte(), -1};
    fmi3Boolean flags[2] = {true, false};
    size_t n = 1 + byte() % 2, nx = byte() % 4 ? n : N_PRESSURE + 2;
    switch (byte() % 8) {
        case 0: fmi3SetFloat64(unit, r, n, x, n); break;
        case 1: fmi3GetFloat64(unit, r, n, x, nx); break;
        case 2: fmi3SetInt32(unit, r, n, whole, n); break;
        case 3: fmi3GetInt32(unit, r, n, whole, n); break;
        case 4: fmi3SetBoolean(unit, r, n, flags, n); break;
        case 5: fmi3GetBoolean(unit, r, n, flags, n); break;
        case 6: fmi3SetClock(unit, r, n, flags); break;
        default: fmi3GetClock(unit, r, n, flags); break;
    }
}

static void exchange(void) {
#if CONTINUOUS
    double x[N_STATES + 1], s[2] = {number(), number()};
    fmi3Boolean event, over;
    fmi3ValueReference a[2] = {reference(), reference()}, b[2] = {reference(), reference()};
    for (int k = 0; k < N_STATES; k++) x[k] = number();
    switch (byte() % 6) {
        case 0: fmi3EnterContinuousTimeMode(unit); break;
        case 1: fmi3SetTime(unit, number()); break;
        case 2: fmi3SetContinuousStates(unit, x, N_STATES + byte() % 2); break;
        case 3: fmi3GetContinuousStateDerivatives(unit, x, N_STATES); break;
        case 4: fmi3CompletedIntegratorStep(unit, true, &event, &over); break;
        default: fmi3GetDirectionalDerivative(unit, a, 2, b, 2, s, 2, x, N_STATES < 2 ? N_STATES : 2); break;
    }
#endif
}

static void play3(void) {
    uint8_t how = byte();
    double reached = 0.0;
    fmi3Boolean event, over, early, flags[5];
    unit = how & 8 ? fmi3InstantiateModelExchange("x", TOKEN, NULL, false, how & 1, NULL, report3)
                   : fmi3InstantiateCoSimulation("x", TOKEN, NULL, false, how & 1, how & 2, how & 4, NULL, 0, NULL, report3,
                                                 how & 16 ? between : NULL);
    while (unit && at < end) {
        switch (byte() % 12) {
            case 0: fmi3EnterInitializationMode(unit, false, 0.0, number(), byte() % 2, number()); break;
            case 1: fmi3ExitInitializationMode(unit); break;
            case 2:
            case 3: values3(); break;
            case 4:
            case 5: fmi3DoStep(unit, byte() % 8 ? reached : number(), length(), true, &event, &over, &early, &reached); break;
            case 6: states(); break;
            case 7: byte() % 4 ? fmi3EnterEventMode(unit) : fmi3Reset(unit); break;
            case 8: fmi3UpdateDiscreteStates(unit, flags, flags + 1, flags + 2, flags + 3, flags + 4, &reached); break;
            case 9: fmi3EnterStepMode(unit); break;
            case 10: byte() % 8 ? fmi3EvaluateDiscreteStates(unit) : fmi3Terminate(unit); break;
            default: exchange(); break;
        }
    }
    fmi3FreeInstance(unit);
}

static void play2(void) {
    fmi2CallbackFunctions calls = {report2, NULL, NULL, NULL, NULL};
    fmi2Component c = fmi2Instantiate("x", byte() % 2 ? fmi2CoSimulation : fmi2ModelExchange, TOKEN, "", &calls, 0, 1);
    double now = 0.0;
    while (c && at < end) {
        fmi2ValueReference r = reference();
        double x = number();
        fmi2Integer whole = byte();
        switch (byte() % 10) {
            case 0: fmi2SetupExperiment(c, 0, 0.0, number(), byte() % 2, x); break;
            case 1: fmi2EnterInitializationMode(c); break;
            case 2: fmi2ExitInitializationMode(c); break;
            case 3: fmi2SetReal(c, &r, 1, &x); break;
            case 4: fmi2GetReal(c, &r, 1, &x); break;
            case 5: fmi2SetInteger(c, &r, 1, &whole); break;
            case 6: fmi2GetBoolean(c, &r, 1, &whole); break;
            case 7: fmi2Reset(c); break;
            default:
                x = length();
                if (fmi2DoStep(c, now, x, fmi2True) <= fmi2Warning) now += x;
                break;
        }
    }
    fmi2FreeInstance(c);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    at = data, end = data + (size < 600 ? size : 600);
    if (byte() % 4) play3();
    else play2();
    return 0;
}
