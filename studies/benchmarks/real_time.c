/* Times the steps of a bounded unit of FMI 3.0: real_time LIBRARY TOKEN ROWS OUT PACED IN... OUT...

   ROWS holds six inputs a step, OUT gets six numbers a step: time of a step played once [s], the least of up to five
   plays from the same state, journal x and y [m], work in corrections, steps cut short so far. IN and OUT are value
   references; where the unit ends the run, the row is not a number and the next begins from rest. PACED 1: each step begins on a grid of its own length under SCHED_FIFO, where permitted, and the first
   column is the time from the grid's point to the end of the step; 0: as fast as it goes, in processor time. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#include "fmi3FunctionTypes.h"

enum { INPUTS = 6, OUTPUTS = 2, COUNTS = 2, COLUMNS = 6, PLAYS = 5, WARM = 200 };
#define SAMPLE 2e-4
#define SLOW 1.3 /* a play slower than so many typical ones is repeated */

#define LOAD(Name)                                            \
    fmi3##Name##TYPE *Name;                                   \
    *(void **)&Name = dlsym(library, "fmi3" #Name);           \
    if (!Name) return fprintf(stderr, "no fmi3" #Name "\n"), 1
#define CALL(call) \
    if ((call) > fmi3Warning) return fprintf(stderr, "refused: " #call "\n"), 1

static double seconds(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void report(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text) {
    (void)e, (void)category;
    if (status > fmi3Warning) fprintf(stderr, "%s\n", text);
}

/* Wait for a point of time on the monotonic clock. */
static void wait_until(double begin) {
    struct timespec t = {(time_t)begin, (long)(1e9 * (begin - (double)(time_t)begin))};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

int main(int count, char **words) {
    if (count != 6 + INPUTS + OUTPUTS + COUNTS) return fprintf(stderr, "%s\n", "wrong number of arguments"), 2;
    fmi3ValueReference in[INPUTS], out[OUTPUTS], counts[COUNTS];
    for (int k = 0; k < INPUTS; k++) in[k] = (fmi3ValueReference)atoi(words[6 + k]);
    for (int k = 0; k < OUTPUTS; k++) out[k] = (fmi3ValueReference)atoi(words[6 + INPUTS + k]);
    for (int k = 0; k < COUNTS; k++) counts[k] = (fmi3ValueReference)atoi(words[6 + INPUTS + OUTPUTS + k]);
    bool paced = atoi(words[5]) == 1;
    void *library = dlopen(words[1], RTLD_NOW);
    FILE *rows = fopen(words[3], "rb"), *table = fopen(words[4], "wb");
    if (!library || !rows || !table) return fprintf(stderr, "%s\n", "a file cannot be opened"), 1;
    LOAD(InstantiateCoSimulation);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(SetFloat64);
    LOAD(GetFloat64);
    LOAD(GetInt32);
    LOAD(DoStep);
    LOAD(GetFMUState);
    LOAD(SetFMUState);
    fmi3Instance unit = InstantiateCoSimulation("u", words[2], NULL, false, false, false, false, NULL, 0, NULL, report, NULL);
    if (!unit) return 1;
    double row[INPUTS], typical = 1.0, recent[WARM], now = 0.0, reached;
    fmi3FMUState before = NULL, rest = NULL;
    fmi3Boolean event, end, early;
    if (paced) {
        struct sched_param priority = {50};
        bool fifo = sched_setscheduler(0, SCHED_FIFO, &priority) == 0, locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
        fprintf(stderr, "%s, memory %s\n", fifo ? "SCHED_FIFO" : "no SCHED_FIFO here", locked ? "locked" : "not locked");
    }
    double begin = seconds(CLOCK_MONOTONIC) + 0.01;
    for (long k = 0; fread(row, sizeof *row, INPUTS, rows) == INPUTS; k++) {
        CALL(SetFloat64(unit, in, INPUTS, row, INPUTS));
        if (k == 0) {
            CALL(EnterInitializationMode(unit, false, 0.0, 0.0, false, 0.0));
            CALL(ExitInitializationMode(unit));
            CALL(GetFMUState(unit, &rest));
        }
        double found[COLUMNS] = {0.0, 1e9};
        if (paced) wait_until(begin + (double)k * SAMPLE);
        else CALL(GetFMUState(unit, &before));
        clockid_t clock = paced ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID;
        bool ended = false;
        for (int play = 0; play < (paced ? 1 : PLAYS) && !ended; play++) {
            if (play) CALL(SetFMUState(unit, before));
            double from = paced ? begin + (double)k * SAMPLE : seconds(clock);
            ended = DoStep(unit, now, SAMPLE, true, &event, &end, &early, &reached) > fmi3Warning;
            double length = seconds(clock) - from;
            if (play == 0) found[0] = length;
            if (length < found[1]) found[1] = length;
            if (k >= WARM && length < SLOW * typical) break;
        }
        now = ended ? 0.0 : reached;
        if (ended) {
            CALL(SetFMUState(unit, rest));
            for (int i = 0; i < COLUMNS; i++) found[i] = NAN;
            fwrite(found, sizeof *found, COLUMNS, table);
            continue;
        }
        recent[k % WARM] = found[1];
        if (k % WARM == WARM - 1) {
            typical = 0.0;
            for (int i = 0; i < WARM; i++) typical += recent[i] / WARM;
        }
        fmi3Int32 counted[COUNTS];
        CALL(GetFloat64(unit, out, OUTPUTS, found + 2, OUTPUTS));
        CALL(GetInt32(unit, counts, COUNTS, counted, COUNTS));
        for (int i = 0; i < COUNTS; i++) found[2 + OUTPUTS + i] = counted[i];
        fwrite(found, sizeof *found, COLUMNS, table);
    }
    fclose(table);
    return 0;
}
