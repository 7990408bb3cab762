#ifndef SELFLOCK_DOOR_H
#define SELFLOCK_DOOR_H

#include "fmi2.h"

typedef struct Door Door;

/* Before and after pythonfmu makes a slave, on the same thread: the door to it, or NULL where it has none. Each call of
   door_of ends what `old` was. */
void door_before(void);
Door *door_of(Door *old);
void door_close(Door *door, int lost); /* lost: what it holds of Python's is not touched any more */

/* The calls of a communication step, without pythonfmu. 1: done; 0: not this way, call pythonfmu's function. */
int door_set(Door *door, const fmi2ValueReference *references, size_t count, const fmi2Real *values);
int door_get(Door *door, const fmi2ValueReference *references, size_t count, fmi2Real *values);
int door_get_boolean(Door *door, const fmi2ValueReference *references, size_t count, fmi2Boolean *values);
int door_step(Door *door, fmi2Real time, fmi2Real size);

/* Before any other call: the slave knows again what was done without it. */
void door_shut(Door *door);

#endif
