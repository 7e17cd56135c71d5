/* Plays samples of doubles from the standard input (x, y, speed, pressure, angle) through a law, and writes what it
   gives (x, y, alarm); first the result of its self test. */
#include <stdio.h>

#include "law.h"

int main(void) {
    static law_memory law;
    double row[5], out[3] = {law_self_test(&law), 0, 0};
    fwrite(out, sizeof out, 1, stdout);
    law_reset(&law);
    while (fread(row, sizeof row, 1, stdin) == 1) {
        law_real measured[2] = {(law_real)row[0], (law_real)row[1]}, reference[2];
        out[2] = law_step(&law, measured, (law_real)row[2], (law_real)row[3], (law_real)row[4],
                          reference);
        out[0] = reference[0];
        out[1] = reference[1];
        fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
