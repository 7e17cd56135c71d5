/* A program that runs a unit of FMI 3.0 without Python: a run-up with a hit on the disc, as a table on standard output.

   rotorsim fmu export dtu_gas_bearing --out rig.fmu && unzip -q rig.fmu -d rig
   gcc -std=c99 -I HEADERS fmu_host.c -o fmu_host -ldl -lm
   ./fmu_host rig/binaries/x86_64-linux/dtu_gas_bearing_plant.so rig/modelDescription.xml 0.1

   HEADERS is the folder of the standard's headers, fmi3FunctionTypes.h and what it includes; FMPy carries them in
   fmpy/c-code. On Windows, LoadLibrary and GetProcAddress take the places of dlopen and dlsym. */
#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"

#define SAMPLE 2e-4 /* [s], fixedInternalStepSize in modelDescription.xml */
#define SPEED 300.0 /* [rad/s] at the start, from which it rises by 50 rad/s in a second */
#define HIT 20.0    /* [N], held over one sample */

/* A function of the unit's library, under its name in the standard. */
#define LOAD(Name)                                                         \
    fmi3##Name##TYPE *Name;                                                \
    *(void **)&Name = dlsym(library, "fmi3" #Name);                        \
    if (!Name) return complain("the library has no function fmi3" #Name)

#define CALL(call) \
    if ((call) > fmi3Warning) return complain("the unit refused: " #call)

static int complain(const char *text) {
    fprintf(stderr, "%s\n", text);
    return EXIT_FAILURE;
}

/* What the unit reports: why it refuses a call, or what it warns of. */
static void report(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text) {
    (void)environment, (void)category;
    fprintf(stderr, "%s: %s\n", status <= fmi3Warning ? "note" : "error", text);
}

static char *read_file(const char *path) {
    FILE *file = fopen(path, "rb");
    if (!file) return NULL;
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    rewind(file);
    char *text = calloc((size_t)size + 1, 1);
    if (text && fread(text, 1, (size_t)size, file) != (size_t)size) text[0] = 0;
    fclose(file);
    return text;
}

/* The value of an attribute behind `from`, as a new text. */
static char *attribute(const char *from, const char *name) {
    char key[64];
    snprintf(key, sizeof key, "%s=\"", name);
    const char *begin = from ? strstr(from, key) : NULL;
    if (!begin) return NULL;
    begin += strlen(key);
    size_t length = strcspn(begin, "\"");
    char *value = calloc(length + 1, 1);
    return value ? memcpy(value, begin, length) : NULL;
}

/* Value reference of a variable, 0 (the time) for one that is not there. */
static fmi3ValueReference reference(const char *xml, const char *name) {
    char key[96];
    snprintf(key, sizeof key, "name=\"%s\" valueReference", name);
    char *text = attribute(strstr(xml, key), "valueReference");
    fmi3ValueReference found = text ? (fmi3ValueReference)atoi(text) : 0;
    free(text);
    return found;
}

int main(int count, char **words) {
    if (count != 4) return complain("give the library, modelDescription.xml and the seconds to run");
    char *xml = read_file(words[2]), *token = attribute(xml, "instantiationToken");
    void *library = dlopen(words[1], RTLD_NOW);
    if (!xml || !token || !library) return complain("the library or the description cannot be read");
    LOAD(InstantiateCoSimulation);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(SetFloat64);
    LOAD(GetFloat64);
    LOAD(DoStep);
    LOAD(Terminate);
    LOAD(FreeInstance);
    const fmi3ValueReference in[] = {reference(xml, "shaft.speed_ref"), reference(xml, "disc.force_x")};
    const fmi3ValueReference out[] = {reference(xml, "disc.x"), reference(xml, "disc.y"), reference(xml, "shaft.speed")};
    fmi3Instance unit = InstantiateCoSimulation("unit", token, NULL, false, true, false, false, NULL, 0, NULL, report, NULL);
    if (!unit) return complain("the unit cannot be made");
    double inputs[2] = {SPEED, 0.0}, seen[3], reached;
    CALL(SetFloat64(unit, in, 2, inputs, 2)); /* it rests in equilibrium at this speed */
    CALL(EnterInitializationMode(unit, false, 0.0, 0.0, false, 0.0));
    CALL(ExitInitializationMode(unit));
    puts("time,disc.x,disc.y,shaft.speed");
    for (long k = 0, n = lround(atof(words[3]) / SAMPLE); k <= n; k++) {
        fmi3Boolean event, end, early;
        CALL(GetFloat64(unit, out, 3, seen, 3));
        printf("%.17g,%.17g,%.17g,%.17g\n", (double)k * SAMPLE, seen[0], seen[1], seen[2]);
        inputs[0] = SPEED + 50.0 * SAMPLE * (double)(k + 1);
        inputs[1] = k == n / 2 ? HIT : 0.0;
        CALL(SetFloat64(unit, in, 2, inputs, 2));
        if (k < n) CALL(DoStep(unit, (double)k * SAMPLE, SAMPLE, true, &event, &end, &early, &reached));
    }
    CALL(Terminate(unit));
    FreeInstance(unit);
    return EXIT_SUCCESS;
}
