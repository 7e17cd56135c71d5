/* Plays a table of inputs through a unit of FMI 3.0 in a process without Python: player LIBRARY TOKEN < numbers.
   Numbers: step, rows, inputs, outputs, references of both, then the rows. Writes the outputs after every step. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

#define LOAD(Name) fmi3##Name##TYPE *Name = (fmi3##Name##TYPE *)FIND(library, "fmi3" #Name)
#define NEED(condition) \
    if (!(condition)) { fprintf(stderr, "failed: %s\n", #condition); return 1; }

static double next(void) {
    char word[64];
    return scanf("%63s", word) == 1 ? strtod(word, NULL) : NAN;
}

static void say(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
    (void)e, (void)s, (void)category;
    fprintf(stderr, "%s\n", text);
}

int main(int n, char **words) {
    NEED(n == 3);
    void *library = OPEN(words[1]);
    NEED(library);
    LOAD(InstantiateCoSimulation);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(SetFloat64);
    LOAD(GetFloat64);
    LOAD(DoStep);
    fmi3ValueReference in[64], out[64];
    double values[64], reached = 0.0, step = next();
    int rows = (int)next(), inputs = (int)next(), outputs = (int)next();
    NEED(inputs <= 64 && outputs <= 64);
    for (int k = 0; k < inputs; k++) in[k] = (fmi3ValueReference)next();
    for (int k = 0; k < outputs; k++) out[k] = (fmi3ValueReference)next();
    fmi3Instance c = InstantiateCoSimulation("player", words[2], "", 0, 1, 0, 0, NULL, 0, NULL, say, NULL);
    NEED(c && EnterInitializationMode(c, 0, 0, 0, 0, 0) == fmi3OK && ExitInitializationMode(c) == fmi3OK);
    for (int row = 0; row <= rows; row++) {
        fmi3Boolean event, end, early;
        NEED(GetFloat64(c, out, outputs, values, outputs) == fmi3OK);
        for (int k = 0; k < outputs; k++) printf("%.17g%c", values[k], k + 1 < outputs ? ',' : '\n');
        if (row == rows) break;
        for (int k = 0; k < inputs; k++) values[k] = next();
        NEED(SetFloat64(c, in, inputs, values, inputs) == fmi3OK);
        NEED(DoStep(c, row * step, step, 1, &event, &end, &early, &reached) == fmi3OK);
    }
    return 0;
}
