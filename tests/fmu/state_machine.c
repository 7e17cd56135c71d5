/* The state machines of FMI 2.0 and 3.0: what is allowed in a state is done, anything else is an error with one sentence
   in the log and leaves the instance usable. Built and run by test_unit_sanitised.py. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "unit.h"

static int sentences = 0;
static char last[1000];

static void heard(const char *text) {
    sentences++;
    snprintf(last, sizeof last, "%s", text);
}

static void say3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
    (void)e, (void)category;
    if (s == fmi3Error) heard(text);
}

static void say2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)category;
    if (s == fmi2Error) heard(text);
}

static void need(int condition, const char *what) {
    if (condition) return;
    printf("FAILED: %s; last sentence: %s\n", what, last);
    exit(1);
}

#define GOOD(call) need((int)(call) == 0, #call)
#define BAD(call)                                                 \
    do {                                                          \
        int before = sentences;                                   \
        need((int)(call) == (int)fmi3Error, #call " is an error"); \
        need(sentences == before + 1, #call " logs one sentence"); \
    } while (0)
#define STATES(words) need(strstr(last, words) != NULL, "the sentence has: " words)

static fmi3Boolean event, end, early, again;
static fmi3Float64 reached, value;
static const fmi3ValueReference clock_of_unit = 0, unknown = N_VARIABLES;

static fmi3ValueReference first(Store store) {
    for (fmi3ValueReference r = 0; r < N_VARIABLES; r++)
        if (variables[r].store == store) return r;
    return 0;
}

#define STEP3(at, length) fmi3DoStep(c, at, length, true, &event, &end, &early, &reached)
#define GET3(r) fmi3GetFloat64(c, &(r), 1, &value, 1)
#define SET3(r, v) fmi3SetFloat64(c, &(r), 1, (double[]){v}, 1)

static void values3(fmi3Instance c, fmi3ValueReference output) {
    fmi3ValueReference input = first(INPUT);
    fmi3Int32 whole;
    GOOD(GET3(clock_of_unit));
    GOOD(GET3(output));
    GOOD(SET3(input, variables[input].value));
    BAD(SET3(output, 1.0));
    STATES("cannot be set");
    BAD(GET3(unknown));
    STATES("there is no such variable");
    BAD(fmi3GetInt32(c, &output, 1, &whole, 1));
    STATES("use the function of that type");
    BAD(fmi3GetFloat64(c, &output, 1, &value, 0));
    STATES("0 values; give 1");
    BAD(fmi3SetFloat64(c, &input, 1, &value, 0));
}

static void cosimulation3(void) {
    fmi3ValueReference output = first(OUTPUT);
    fmi3Instance c = fmi3InstantiateCoSimulation("c", TOKEN, NULL, false, true, false, true, NULL, 0, NULL, say3, NULL);
    need(c != NULL, "an instance");
    BAD(GET3(output));
    STATES("not known before initialisation");
    BAD(STEP3(0.0, SAMPLE));
    BAD(fmi3ExitInitializationMode(c));
    BAD(fmi3EnterStepMode(c));
    BAD(fmi3Terminate(c));
    BAD(fmi3EnterInitializationMode(c, false, 0.0, 1.0, true, 0.5));
    STATES("not after the start");
    BAD(fmi3EnterInitializationMode(c, false, 0.0, NAN, false, 0.0));
    GOOD(fmi3EnterInitializationMode(c, true, 1e-6, 1.0, true, 1.0 + 4 * SAMPLE));
    BAD(fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0));
    BAD(STEP3(1.0, SAMPLE));
    values3(c, output);
    GOOD(fmi3ExitInitializationMode(c));
    values3(c, output);
    GOOD(STEP3(1.0, SAMPLE));
    BAD(STEP3(1.0, SAMPLE));
    STATES("the unit is at");
    BAD(STEP3(1.0 + SAMPLE, 0.5 * SAMPLE));
    STATES("not a multiple");
    BAD(STEP3(1.0 + SAMPLE, 4 * SAMPLE));
    STATES("beyond the stop time");
    GOOD(STEP3(1.0 + SAMPLE, 3 * SAMPLE));
    BAD(fmi3EnterEventMode(c));
    STATES("without event mode");
    BAD(fmi3UpdateDiscreteStates(c, &again, &end, &again, &again, &again, &reached));
    BAD(fmi3SetTime(c, 0.0));
    BAD(fmi3EnterContinuousTimeMode(c));
    BAD(fmi3SetContinuousStates(c, &value, 1));
    BAD(fmi3GetContinuousStates(c, &value, 1));
    BAD(fmi3GetContinuousStateDerivatives(c, &value, 1));
    BAD(fmi3CompletedIntegratorStep(c, true, &again, &again));
    BAD(fmi3EnterConfigurationMode(c));
    BAD(fmi3ActivateModelPartition(c, 0, 0.0));
    GOOD(fmi3SetDebugLogging(c, true, 2, (fmi3String[]){"logEvents", "logStatusError"}));
    BAD(fmi3SetDebugLogging(c, true, 1, (fmi3String[]){"logAll"}));
    GOOD(fmi3Terminate(c));
    GOOD(GET3(output));
    BAD(STEP3(1.0 + 4 * SAMPLE, SAMPLE));
    BAD(fmi3Terminate(c));
    GOOD(fmi3Reset(c));
    GOOD(fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0));
    GOOD(fmi3ExitInitializationMode(c));
    GOOD(STEP3(0.0, 10 * SAMPLE));
    fmi3FreeInstance(c);
}

static void events3(void) {
    fmi3Instance c = fmi3InstantiateCoSimulation("e", TOKEN, NULL, false, true, true, true, NULL, 0, NULL, say3, NULL);
    GOOD(fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0));
    GOOD(fmi3ExitInitializationMode(c));
    BAD(STEP3(0.0, SAMPLE));
    GOOD(fmi3UpdateDiscreteStates(c, &again, &end, &again, &again, &again, &reached));
    GOOD(fmi3EnterStepMode(c));
    GOOD(STEP3(0.0, SAMPLE));
    GOOD(fmi3EnterEventMode(c));
    GOOD(fmi3EnterStepMode(c));
    GOOD(STEP3(SAMPLE, SAMPLE));
    GOOD(fmi3Terminate(c));
    fmi3FreeInstance(c);
}

static void exchange3(void) {
    fmi3Instance c = fmi3InstantiateModelExchange("x", TOKEN, NULL, false, true, NULL, say3);
    need((c != NULL) == CONTINUOUS, "an instance for model exchange where there are states");
    if (!c) {
        STATES("co-simulation only");
        return;
    }
    double x[N_STATES + 1];
    GOOD(fmi3EnterInitializationMode(c, false, 0.0, 0.0, true, 1.0));
    GOOD(fmi3ExitInitializationMode(c));
    BAD(fmi3EnterStepMode(c));
    GOOD(fmi3EnterContinuousTimeMode(c));
    BAD(STEP3(0.0, SAMPLE));
    STATES("for model exchange; make one for co-simulation");
    GOOD(fmi3GetContinuousStates(c, x, N_STATES));
    BAD(fmi3GetContinuousStates(c, x, N_STATES + 1));
    BAD(fmi3SetContinuousStates(c, x, N_STATES + 1));
    BAD(fmi3GetContinuousStateDerivatives(c, x, N_STATES + 1));
    BAD(fmi3GetNominalsOfContinuousStates(c, x, N_STATES + 1));
    BAD(fmi3GetEventIndicators(c, x, 1));
    BAD(fmi3SetTime(c, NAN));
    GOOD(fmi3SetTime(c, 1.1));
    BAD(fmi3CompletedIntegratorStep(c, true, &again, &end));
    STATES("beyond the stop time");
    GOOD(fmi3SetTime(c, 1.0));
    GOOD(fmi3CompletedIntegratorStep(c, true, &again, &end));
    GOOD(fmi3EnterEventMode(c));
    GOOD(fmi3Terminate(c));
    fmi3FreeInstance(c);
}

#define GET2(r) fmi2GetReal(c, &(r), 1, &value)
#define SET2(r, v) fmi2SetReal(c, &(r), 1, (double[]){v})

static void cosimulation2(void) {
    fmi2CallbackFunctions f = {say2, NULL, NULL, NULL, NULL};
    fmi3ValueReference output = first(OUTPUT), input = first(INPUT);
    fmi2EventInfo info;
    fmi2Boolean flag;
    fmi2Status status;
    fmi2Component c = fmi2Instantiate("c", fmi2CoSimulation, TOKEN, "", &f, fmi2False, fmi2True);
    need(c != NULL, "an instance of FMI 2.0");
    BAD(GET2(output));
    BAD(fmi2DoStep(c, 0.0, SAMPLE, fmi2True));
    BAD(fmi2ExitInitializationMode(c));
    BAD(fmi2Terminate(c));
    BAD(fmi2SetupExperiment(c, fmi2False, 0.0, 1.0, fmi2True, 0.5));
    GOOD(fmi2SetupExperiment(c, fmi2True, 1e-6, 1.0, fmi2True, 1.0 + 4 * SAMPLE));
    GOOD(SET2(input, variables[input].value));
    GOOD(fmi2EnterInitializationMode(c));
    BAD(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    GOOD(GET2(output));
    BAD(fmi2DoStep(c, 1.0, SAMPLE, fmi2True));
    GOOD(fmi2ExitInitializationMode(c));
    GOOD(fmi2DoStep(c, 1.0, SAMPLE, fmi2True));
    BAD(fmi2DoStep(c, 1.0 + SAMPLE, 0.5 * SAMPLE, fmi2True));
    BAD(fmi2DoStep(c, 1.0 + SAMPLE, 4 * SAMPLE, fmi2True));
    STATES("beyond the stop time");
    GOOD(fmi2DoStep(c, 1.0 + SAMPLE, 3 * SAMPLE, fmi2True));
    GOOD(GET2(output));
    BAD(SET2(output, 1.0));
    BAD(GET2(unknown));
    BAD(fmi2SetTime(c, 0.0));
    BAD(fmi2EnterEventMode(c));
    BAD(fmi2EnterContinuousTimeMode(c));
    BAD(fmi2NewDiscreteStates(c, &info));
    BAD(fmi2CompletedIntegratorStep(c, fmi2True, &flag, &flag));
    BAD(fmi2SetContinuousStates(c, &value, 1));
    BAD(fmi2GetContinuousStates(c, &value, 1));
    BAD(fmi2GetDerivatives(c, &value, 1));
    BAD(fmi2CancelStep(c));
    BAD(fmi2GetStatus(c, fmi2DoStepStatus, &status));
    GOOD(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &value));
    need(fabs(value - 1.0 - 4 * SAMPLE) < 1e-9, "the last successful time");
    GOOD(fmi2GetBooleanStatus(c, fmi2Terminated, &flag));
    GOOD(fmi2SetDebugLogging(c, fmi2True, 0, NULL));
    BAD(fmi2SetDebugLogging(c, fmi2True, 1, (fmi2String[]){"logAll"}));
    GOOD(fmi2Terminate(c));
    BAD(fmi2DoStep(c, 1.0 + 4 * SAMPLE, SAMPLE, fmi2True));
    GOOD(fmi2Reset(c));
    GOOD(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    GOOD(fmi2EnterInitializationMode(c));
    GOOD(fmi2ExitInitializationMode(c));
    GOOD(fmi2DoStep(c, 0.0, 10 * SAMPLE, fmi2True));
    fmi2FreeInstance(c);
}

static void exchange2(void) {
    fmi2CallbackFunctions f = {say2, NULL, NULL, NULL, NULL};
    fmi2EventInfo info;
    fmi2Boolean flag;
    int before = sentences;
    fmi2Component c = fmi2Instantiate("x", fmi2ModelExchange, TOKEN, "", &f, fmi2False, fmi2True);
    need((c != NULL) == CONTINUOUS, "an instance of FMI 2.0 for model exchange where there are states");
    if (!c) {
        need(sentences == before + 1, "why there is none is logged");
        STATES("co-simulation only");
        return;
    }
    double x[N_STATES + 1];
    GOOD(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2True, 1.0));
    GOOD(fmi2EnterInitializationMode(c));
    GOOD(fmi2ExitInitializationMode(c));
    GOOD(fmi2NewDiscreteStates(c, &info));
    GOOD(fmi2EnterContinuousTimeMode(c));
    BAD(fmi2NewDiscreteStates(c, &info));
    BAD(fmi2DoStep(c, 0.0, SAMPLE, fmi2True));
    GOOD(fmi2GetContinuousStates(c, x, N_STATES));
    BAD(fmi2GetContinuousStates(c, x, N_STATES + 1));
    BAD(fmi2SetContinuousStates(c, x, N_STATES + 1));
    BAD(fmi2GetDerivatives(c, x, N_STATES + 1));
    BAD(fmi2GetNominalsOfContinuousStates(c, x, N_STATES + 1));
    BAD(fmi2GetEventIndicators(c, x, 1));
    GOOD(fmi2SetTime(c, 1.1));
    BAD(fmi2CompletedIntegratorStep(c, fmi2True, &flag, &flag));
    GOOD(fmi2SetTime(c, 1.0));
    GOOD(fmi2CompletedIntegratorStep(c, fmi2True, &flag, &flag));
    GOOD(fmi2EnterEventMode(c));
    GOOD(fmi2Terminate(c));
    fmi2FreeInstance(c);
}

int main(void) {
    cosimulation3();
    events3();
    exchange3();
    cosimulation2();
    exchange2();
    printf("clean\n");
    return 0;
}
