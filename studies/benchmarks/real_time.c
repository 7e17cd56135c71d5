/* Times the steps of a bounded unit of FMI 3.0: real_time LIBRARY TOKEN ROWS OUT PACED IN... OUT...

   ROWS holds six inputs a step, OUT gets seven numbers a step: time of a step played once [s], the least of up to five
   plays from the same state, journal x and y [m], work in corrections, steps cut short so far, and how often the system
   took the processor away during the least play. IN and OUT are value references; where the unit ends the run, the row
   is not a number and the next begins from rest.

   PACED 1: each step begins on a grid of its own length under SCHED_FIFO, where permitted, and the first column is the
   time from the grid's point to the end of the step; 0: as fast as it goes, in processor time. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#include "fmi3FunctionTypes.h"

enum { INPUTS = 6, OUTPUTS = 2, COUNTS = 2, COLUMNS = 7, PLAYS = 5, WARM = 200 };
#define SAMPLE 2e-4
#define SLOW 1.3 /* a play slower than so many typical ones is repeated */

#define EACH(DO)                                                                                  \
    DO(InstantiateCoSimulation) DO(EnterInitializationMode) DO(ExitInitializationMode) DO(DoStep) \
        DO(SetFloat64) DO(GetFloat64) DO(GetInt32) DO(GetFMUState) DO(SetFMUState)
#define DECLARE(Name) static fmi3##Name##TYPE *Name;
#define LOAD(Name)                              \
    *(void **)&Name = dlsym(library, "fmi3" #Name); \
    if (!Name) return fprintf(stderr, "no fmi3" #Name "\n"), false;
#define CALL(call) \
    if ((call) > fmi3Warning) return fprintf(stderr, "refused: " #call "\n"), false
EACH(DECLARE)

static fmi3Instance unit;
static fmi3ValueReference in[INPUTS], out[OUTPUTS], counts[COUNTS];
static fmi3FMUState before, rest;
static bool paced;
static double now, begin; /* time of the unit, and of the clock at the first step [s] */
static struct {
    double recent[WARM], mean;
    long count;
} typical = {.mean = 1.0}; /* least times of the last steps that were not ended */

static double seconds(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* How often the system took the processor away from this program. */
static long taken(void) {
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    return used.ru_nivcsw;
}

static void report(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text) {
    (void)e, (void)category;
    if (status > fmi3Warning) fprintf(stderr, "%s\n", text);
}

/* Wait for a point of time on the monotonic clock. */
static void wait_until(double point) {
    struct timespec t = {(time_t)point, (long)(1e9 * (point - (double)(time_t)point))};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

static void keep_typical(double length) {
    typical.recent[typical.count % WARM] = length;
    if (++typical.count % WARM) return;
    typical.mean = 0.0;
    for (int i = 0; i < WARM; i++) typical.mean += typical.recent[i] / WARM;
}

static void read_references(char **words, fmi3ValueReference *found, int count) {
    for (int k = 0; k < count; k++) found[k] = (fmi3ValueReference)atoi(words[k]);
}

static bool make(const char *file, const char *token) {
    void *library = dlopen(file, RTLD_NOW);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), false;
    EACH(LOAD)
    unit = InstantiateCoSimulation("u", token, NULL, false, false, false, false, NULL, 0, NULL, report, NULL);
    return unit != NULL;
}

static bool initialise(void) {
    CALL(EnterInitializationMode(unit, false, 0.0, 0.0, false, 0.0));
    CALL(ExitInitializationMode(unit));
    CALL(GetFMUState(unit, &rest));
    return true;
}

static void take_priority(void) {
    struct sched_param priority = {50};
    bool fifo = sched_setscheduler(0, SCHED_FIFO, &priority) == 0, locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    fprintf(stderr, "%s, memory %s\n", fifo ? "SCHED_FIFO" : "no SCHED_FIFO here", locked ? "locked" : "not locked");
}

/* Play step k, in turns from one state where it is not paced; the row is not a number where the unit ends the run. */
static bool play(long k, double *row) {
    clockid_t clock = paced ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID;
    bool ended = false, event, end, early;
    double reached = now;
    row[1] = 1e9;
    if (paced) wait_until(begin + (double)k * SAMPLE);
    else CALL(GetFMUState(unit, &before));
    for (int turn = 0; turn < (paced ? 1 : PLAYS) && !ended; turn++) {
        if (turn) CALL(SetFMUState(unit, before));
        long switches = taken();
        double from = paced ? begin + (double)k * SAMPLE : seconds(clock);
        ended = DoStep(unit, now, SAMPLE, true, &event, &end, &early, &reached) > fmi3Warning;
        double length = seconds(clock) - from;
        if (turn == 0) row[0] = length;
        if (length < row[1]) row[1] = length, row[6] = (double)(taken() - switches);
        if (typical.count >= WARM && length < SLOW * typical.mean) break;
    }
    now = ended ? 0.0 : reached;
    if (!ended) return keep_typical(row[1]), true;
    CALL(SetFMUState(unit, rest));
    for (int i = 0; i < COLUMNS; i++) row[i] = NAN;
    return true;
}

static bool read_answer(double *row) {
    fmi3Int32 counted[COUNTS];
    CALL(GetFloat64(unit, out, OUTPUTS, row + 2, OUTPUTS));
    CALL(GetInt32(unit, counts, COUNTS, counted, COUNTS));
    for (int i = 0; i < COUNTS; i++) row[2 + OUTPUTS + i] = counted[i];
    return true;
}

static bool play_all(FILE *rows, FILE *table) {
    double given[INPUTS];
    if (paced) take_priority();
    begin = seconds(CLOCK_MONOTONIC) + 0.01;
    for (long k = 0; fread(given, sizeof *given, INPUTS, rows) == INPUTS; k++) {
        double row[COLUMNS] = {0.0};
        CALL(SetFloat64(unit, in, INPUTS, given, INPUTS));
        if (k == 0 && !initialise()) return false;
        if (!play(k, row)) return false;
        if (!isnan(row[0]) && !read_answer(row)) return false;
        fwrite(row, sizeof *row, COLUMNS, table);
    }
    return true;
}

int main(int count, char **words) {
    if (count != 6 + INPUTS + OUTPUTS + COUNTS) return fprintf(stderr, "%s\n", "wrong number of arguments"), 2;
    FILE *rows = fopen(words[3], "rb"), *table = fopen(words[4], "wb");
    if (!rows || !table) return fprintf(stderr, "%s\n", "a file cannot be opened"), 1;
    paced = atoi(words[5]) == 1;
    read_references(words + 6, in, INPUTS);
    read_references(words + 6 + INPUTS, out, OUTPUTS);
    read_references(words + 6 + INPUTS + OUTPUTS, counts, COUNTS);
    bool played = make(words[1], words[2]) && play_all(rows, table);
    return fclose(table) || !played;
}
