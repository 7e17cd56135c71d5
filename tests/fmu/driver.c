/* Runs a unit under the sanitisers: every kind of call, good and bad. Built by test_unit_sanitised.py. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "unit.h"

static int errors = 0;

static void say3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
    (void)e, (void)category;
    errors += s == fmi3Error;
    printf("%s\n", text);
}

static void say2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)category;
    errors += s == fmi2Error;
    printf("%s\n", text);
}

static void need(int condition, const char *what) {
    if (condition) return;
    printf("FAILED: %s\n", what);
    exit(1);
}

/* A communication step; where the unit has a clock, it ticks in event mode before. */
static fmi3Status step3(fmi3Instance c, double now, double length, double *reached) {
    fmi3Boolean event, end, early;
#if CLOCKED
    fmi3Boolean flags[5];
    for (fmi3ValueReference r = 0; r < N_VARIABLES; r++)
        if (variables[r].kind == CLOCK) need(fmi3SetClock(c, &r, 1, (fmi3Boolean[]){true}) == fmi3OK, "tick");
    need(fmi3UpdateDiscreteStates(c, flags, flags + 1, flags + 2, flags + 3, flags + 4, reached) == fmi3OK, "update");
    need(fmi3EnterStepMode(c) == fmi3OK, "step mode");
#endif
    fmi3Status status = fmi3DoStep(c, now, length, true, &event, &end, &early, reached);
    if (CLOCKED) need(fmi3EnterEventMode(c) == fmi3OK, "event mode");
    return status;
}

static void run3(void) {
    double values[N_PRESSURE + N_VARIABLES], reached;
    fmi3FMUState state = NULL, other = NULL;
    size_t size;
    fmi3Instance c = fmi3InstantiateCoSimulation("a % b", TOKEN, NULL, false, true, CLOCKED, false, NULL, 0, NULL, say3, NULL);
    need(c != NULL, "instance");
    need(fmi3InstantiateCoSimulation("b", "foreign %s", NULL, 0, 0, 0, 0, NULL, 0, NULL, say3, NULL) == NULL, "foreign token");
    need(fmi3EnterInitializationMode(c, false, 0, 0, false, 0) == fmi3OK, "enter");
    need(fmi3ExitInitializationMode(c) == fmi3OK, "exit");
    for (fmi3ValueReference r = 0; r < N_VARIABLES + 2; r++) {
        size_t n = r < N_VARIABLES && variables[r].store == PRESSURE ? N_PRESSURE : 1;
        fmi3GetFloat64(c, &r, 1, values, n);
        fmi3SetFloat64(c, &r, 1, (double[]){NAN}, 1);
        fmi3Reset(c);
        fmi3EnterInitializationMode(c, false, 0, 0, false, 0);
        fmi3ExitInitializationMode(c);
    }
    need(fmi3Reset(c) == fmi3OK && fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) == fmi3OK, "reset");
    need(fmi3ExitInitializationMode(c) == fmi3OK, "exit again");
    for (int k = 0; k < 200; k++) need(step3(c, k * SAMPLE, SAMPLE, &reached) == fmi3OK, "step");
    need(step3(c, reached, -1.0, &reached) == fmi3Error, "negative step");
    need(fmi3GetFMUState(c, &state) == fmi3OK && fmi3SerializedFMUStateSize(c, state, &size) == fmi3OK, "state");
    fmi3Byte *bytes = malloc(size);
    need(fmi3SerializeFMUState(c, state, bytes, size) == fmi3OK, "serialise");
    need(fmi3DeserializeFMUState(c, bytes, size - 1, &other) == fmi3Error, "truncated");
    bytes[size / 2] ^= 1;
    need(fmi3DeserializeFMUState(c, bytes, size, &other) == fmi3Error, "damaged");
    bytes[size / 2] ^= 1;
    need(fmi3DeserializeFMUState(c, bytes, size, &other) == fmi3OK && fmi3SetFMUState(c, other) == fmi3OK, "restore");
    need(step3(c, reached, (CLOCKED ? 1 : 10) * SAMPLE, &reached) == fmi3OK, "long step");
    free(bytes);
    fmi3FreeFMUState(c, &state);
    fmi3FreeFMUState(c, &other);
    need(fmi3Terminate(c) == fmi3OK, "terminate");
    fmi3FreeInstance(c);
    fmi3FreeInstance(NULL);
}

static void run2(void) {
    fmi2CallbackFunctions f = {say2, NULL, NULL, NULL, NULL};
    double value;
    fmi2Component c = fmi2Instantiate("two", fmi2CoSimulation, TOKEN, "", &f, 0, 1);
    need(c != NULL && fmi2SetupExperiment(c, 0, 0, 0, 0, 0) == fmi2OK, "instance 2");
    need(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK, "initialise 2");
    for (fmi2ValueReference r = 0; r < N_VARIABLES; r++) fmi2GetReal(c, &r, 1, &value);
    for (int k = 0; k < 50; k++) need(fmi2DoStep(c, k * SAMPLE, SAMPLE, fmi2True) == fmi2OK, "step 2");
    need(fmi2DoStep(c, 0.5, SAMPLE, fmi2True) == fmi2Error, "elsewhere");
    need(fmi2Terminate(c) == fmi2OK, "terminate 2");
    fmi2FreeInstance(c);
}

static void exchange(void) {
#if CONTINUOUS
    double x[N_STATES], derivatives[N_STATES], sensitivity;
    fmi3Instance c = fmi3InstantiateModelExchange("x", TOKEN, NULL, false, true, NULL, say3);
    need(c != NULL && fmi3EnterInitializationMode(c, false, 0, 0, false, 0) == fmi3OK, "instance for exchange");
    need(fmi3ExitInitializationMode(c) == fmi3OK && fmi3EnterContinuousTimeMode(c) == fmi3OK, "continuous time");
    need(fmi3GetContinuousStates(c, x, N_STATES) == fmi3OK && fmi3SetTime(c, 1.0) == fmi3OK, "states");
    x[0] = 1e-6;
    need(fmi3SetContinuousStates(c, x, N_STATES) == fmi3OK, "set states");
    need(fmi3GetContinuousStateDerivatives(c, derivatives, N_STATES) == fmi3OK, "derivatives");
    for (uint32_t a = 0; a < N_VARIABLES + 1; a++)
        for (uint32_t b = 0; b < N_VARIABLES + 1; b++)
            fmi3GetDirectionalDerivative(c, &a, 1, &b, 1, (double[]){1.0}, 1, &sensitivity, 1);
    x[0] = NAN;
    need(fmi3SetContinuousStates(c, x, N_STATES) == fmi3Error, "states that are none");
    need(fmi3Terminate(c) == fmi3OK, "terminate exchange");
    fmi3FreeInstance(c);
#endif
}

int main(void) {
    run3();
    if (!CLOCKED) run2(); /* FMI 2.0 has no clocks */
    exchange();
    need(errors > 0, "sentences");
    printf("clean\n");
    return 0;
}
