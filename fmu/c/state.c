/* States as bytes: saved, restored, and checked to be of this model. */
#include <stdlib.h>
#include <string.h>

#include "unit.h"

static uint64_t fingerprint(const State *s) {
    const unsigned char *bytes = (const unsigned char *)&s->count;
    size_t n = sizeof *s - offsetof(State, count);
    uint64_t hash = 1469598103934665603u;
    for (size_t k = 0; k < n; k++) hash = (hash ^ bytes[k]) * 1099511628211u;
    return hash;
}

static bool belongs(Unit *u, const State *s) {
    if (memcmp(s->magic, MAGIC, sizeof s->magic) != 0) {
        unit_fail(u, FAILED, "state: is not one that this software saved; give one of fmi GetFMUState");
        return false;
    }
    if (s->size != sizeof *s || strncmp(s->hash, MODEL_HASH, sizeof s->hash) != 0) {
        unit_fail(u, FAILED, "state: belongs to model %.32s, this is %s; give a state of this model", s->hash, MODEL_HASH);
        return false;
    }
    return true;
}

bool unit_save(Unit *u, void **state) {
    if (!u || !state || !unit_allows(u, "GetFMUState")) return false;
    if (!*state) *state = malloc(sizeof u->s);
    if (!*state) {
        unit_fail(u, FAILED, "state: no memory for %lu bytes; free other states", (unsigned long)sizeof u->s);
        return false;
    }
    memcpy(*state, &u->s, sizeof u->s);
    return true;
}

bool unit_drop(Unit *u, void **state) {
    if (!u || !state) return false;
    free(*state);
    *state = NULL;
    return true;
}

bool unit_state_size(Unit *u, size_t *size) {
    if (!u || !size) return false;
    *size = sizeof u->s;
    return true;
}

bool unit_restore(Unit *u, const State *from) {
    if (!u || !from || !unit_allows(u, "SetFMUState") || !belongs(u, from)) return false;
    memcpy(&u->s, from, sizeof u->s);
    u->has_refused = u->has_gathered = false;
    return true;
}

bool unit_serialise(Unit *u, const State *from, void *bytes, size_t size) {
    if (!u || !from || !belongs(u, from)) return false;
    if (!bytes || size < sizeof *from) {
        unit_fail(u, FAILED, "state: %lu bytes are too few; give %lu", (unsigned long)size, (unsigned long)sizeof *from);
        return false;
    }
    memcpy(bytes, from, sizeof *from);
    uint64_t check = fingerprint(from);
    memcpy((char *)bytes + offsetof(State, check), &check, sizeof check);
    return true;
}

bool unit_deserialise(Unit *u, const void *bytes, size_t size, void **state) {
    if (!u || !state) return false;
    if (!bytes || size != sizeof(State)) {
        unit_fail(u, FAILED, "state: %lu bytes, a state of this model has %lu; give all of them", (unsigned long)size,
                  (unsigned long)sizeof(State));
        return false;
    }
    State *s = malloc(sizeof *s);
    if (!s) return false;
    memcpy(s, bytes, sizeof *s);
    bool good = belongs(u, s);
    if (good && s->check != fingerprint(s)) {
        unit_fail(u, FAILED, "state: its bytes are damaged; save it again");
        good = false;
    }
    if (!good) {
        free(s);
        return false;
    }
    s->check = 0;
    free(*state);
    *state = s;
    return true;
}
