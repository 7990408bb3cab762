/* The short way to a slave of ours, for the calls of a communication step.

   pythonfmu's library makes lists of references and values at each of them. A step of ours is one pure function of
   numbers, advance(parameters, state, inputs…, h) -> (state, outputs), which the slave hands out (Slave.door) together with
   what it is called with, as long as nothing stands against a step. Inputs and outputs then lie here, in C, and advance is
   called from here. Whatever is not plain goes the long way: before any other call the slave is given back what it is now
   (Slave.shut), and a step that fails is made again by the slave, which says why. Its numbers are the same to the bit.

   Where the process has the same law compiled (master/twin.py), its address comes with them, and a step does without
   Python. Python raises an error where C goes on with an infinity: so a step in which the processor saw a division by
   zero, an overflow or an invalid operation is made again by the slave. */
#include "door.h"

#include <dlfcn.h>
#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

typedef struct Object Object; /* Python's */

static struct {
    int (*Ensure)(void);
    void (*Release)(int);
    void (*IncRef)(Object *);
    void (*DecRef)(Object *);
    void (*Clear)(void);
    Object *(*Occurred)(void);
    Object *(*GetSystem)(const char *);
    unsigned long (*Thread)(void);
    Object *(*FromUnsigned)(unsigned long);
    long (*AsLong)(Object *);
    void *(*AsPlace)(Object *);
    Object *(*GetEntry)(Object *, Object *);
    int (*DropEntry)(Object *, Object *);
    Object *(*CallMethod)(Object *, const char *, const char *, ...);
    Object *(*Call)(Object *, Object *const *, size_t, Object *);
    Object *(*FromDouble)(double);
    double (*AsDouble)(Object *);
    ssize_t (*Size)(Object *);
    Object *(*Item)(Object *, ssize_t);
    Object *(*NewTuple)(ssize_t);
    int (*Put)(Object *, ssize_t, Object *);
} py;

static const struct { const char *name; void **place; } WANTED[] = {
    {"PyGILState_Ensure", (void **)&py.Ensure}, {"PyGILState_Release", (void **)&py.Release},
    {"Py_IncRef", (void **)&py.IncRef}, {"Py_DecRef", (void **)&py.DecRef}, {"PyErr_Clear", (void **)&py.Clear},
    {"PyErr_Occurred", (void **)&py.Occurred}, {"PySys_GetObject", (void **)&py.GetSystem},
    {"PyThread_get_thread_ident", (void **)&py.Thread}, {"PyLong_FromUnsignedLong", (void **)&py.FromUnsigned},
    {"PyLong_AsLong", (void **)&py.AsLong}, {"PyLong_AsVoidPtr", (void **)&py.AsPlace},
    {"PyDict_GetItemWithError", (void **)&py.GetEntry},
    {"PyDict_DelItem", (void **)&py.DropEntry}, {"PyObject_CallMethod", (void **)&py.CallMethod},
    {"PyObject_VectorcallDict", (void **)&py.Call}, {"PyFloat_FromDouble", (void **)&py.FromDouble},
    {"PyFloat_AsDouble", (void **)&py.AsDouble}, {"PyTuple_Size", (void **)&py.Size}, {"PyTuple_GetItem", (void **)&py.Item},
    {"PyTuple_New", (void **)&py.NewTuple}, {"PyTuple_SetItem", (void **)&py.Put},
};

enum { MOST = 64, RESTLESS = 16 }; /* inputs and outputs that go this way; times that it was opened for less than two steps */

/* advance, compiled: 1 where it has numbers for the next state and the outputs, which it may have begun to write where not */
typedef int Law(const double *parameters, const double *state, const double *inputs, double size, double *next, double *outputs);

enum { ODD = FE_DIVBYZERO | FE_OVERFLOW | FE_INVALID };

struct Door {
    Object *slave, *advance, *parameters, *state;
    size_t inputs, outputs, states;
    Law *law; /* NULL: advance is Python's alone; else the numbers lie in the object `state` */
    const double *known;
    double *now;
    int open, never; /* never: not this slave, or not as it is used */
    unsigned steps, restless;
    double value[MOST]; /* inputs, then outputs: as value references count */
    unsigned char boolean[MOST]; /* of these: 0 or 1 in `value` */
};

static int ready(void)
{
    static int known; /* 1: all there, -1: not this Python */
    if (!known) {
        int whole = 1;
        for (size_t k = 0; k < sizeof WANTED / sizeof *WANTED; k++)
            whole = (*WANTED[k].place = dlsym(RTLD_DEFAULT, WANTED[k].name)) && whole;
        known = whole ? 1 : -1;
    }
    return known > 0;
}

/* The slave that this thread made last, which is taken out of where slaves put themselves (Slave.__init__). */
static Object *made(void)
{
    Object *all = py.GetSystem("_selflock_made"), *key = all ? py.FromUnsigned(py.Thread()) : NULL, *found = NULL;
    if (key) {
        if ((found = py.GetEntry(all, key))) {
            py.IncRef(found);
            py.DropEntry(all, key);
        }
        py.DecRef(key);
    }
    py.Clear();
    return found;
}

void door_before(void)
{
    if (!ready()) return;
    int lock = py.Ensure();
    Object *other = made(); /* of somebody who did not ask for it */
    if (other) py.DecRef(other);
    py.Release(lock);
}

static void let_go(Object **one)
{
    Object *gone = *one;
    *one = NULL;
    if (gone) py.DecRef(gone);
}

static void forget(Door *door)
{
    let_go(&door->advance), let_go(&door->parameters), let_go(&door->state);
    door->open = 0, door->law = NULL;
}

void door_close(Door *door, int lost)
{
    if (!door) return;
    if (!lost) {
        int lock = py.Ensure();
        forget(door);
        let_go(&door->slave);
        py.Release(lock);
    }
    free(door);
}

Door *door_of(Door *old)
{
    door_close(old, 0);
    if (!ready()) return NULL;
    Door *door = calloc(1, sizeof *door);
    if (!door) return NULL;
    int lock = py.Ensure();
    door->slave = made();
    py.Release(lock);
    if (door->slave) return door;
    free(door);
    return NULL;
}

/* Ask the slave for all that a step needs. The lock is held. */
static int opened(Door *door)
{
    Object *told = py.CallMethod(door->slave, "door", NULL);
    if (door->steps < 2 && ++door->restless > RESTLESS) door->never = 1;
    door->steps = 0;
    ssize_t size = told ? py.Size(told) : 0;
    if (size != 7 && size != 11) { /* None: not now */
        py.Clear();
        if (told) py.DecRef(told);
        return 0;
    }
    door->inputs = (size_t)py.AsLong(py.Item(told, 3)), door->outputs = (size_t)py.AsLong(py.Item(told, 4));
    Object *values = py.Item(told, 5);
    if (!door->outputs || door->inputs + door->outputs > MOST) door->never = 1;
    else {
        for (size_t k = 0; k < door->inputs + door->outputs; k++) {
            door->value[k] = py.AsDouble(py.Item(values, (ssize_t)k));
            door->boolean[k] = 0;
        }
        Object *booleans = py.Item(told, 6);
        for (ssize_t k = py.Size(booleans); k-- > 0;) door->boolean[py.AsLong(py.Item(booleans, k))] = 1;
        door->advance = py.Item(told, 0), door->parameters = py.Item(told, 1), door->state = py.Item(told, 2);
        py.IncRef(door->advance), py.IncRef(door->parameters), py.IncRef(door->state);
        if (size == 11) {
            void *law = py.AsPlace(py.Item(told, 7));
            memcpy(&door->law, &law, sizeof law);
            door->known = py.AsPlace(py.Item(told, 8)), door->now = py.AsPlace(py.Item(told, 9));
            door->states = (size_t)py.AsLong(py.Item(told, 10));
            if (door->states > MOST) door->never = 1;
        }
        door->open = !py.Occurred() && !door->never;
    }
    py.Clear();
    py.DecRef(told);
    if (!door->open) forget(door);
    return door->open;
}

int door_set(Door *door, const fmi2ValueReference *references, size_t count, const fmi2Real *values)
{
    if (!door || !door->open) return 0;
    for (size_t k = 0; k < count; k++)
        if (references[k] >= door->inputs || !isfinite(values[k])) return 0;
    for (size_t k = 0; k < count; k++) door->value[references[k]] = values[k];
    return 1;
}

int door_get(Door *door, const fmi2ValueReference *references, size_t count, fmi2Real *values)
{
    if (!door || !door->open) return 0;
    for (size_t k = 0; k < count; k++)
        if (references[k] >= door->inputs + door->outputs || door->boolean[references[k]]) return 0;
    for (size_t k = 0; k < count; k++) values[k] = door->value[references[k]];
    return 1;
}

int door_get_boolean(Door *door, const fmi2ValueReference *references, size_t count, fmi2Boolean *values)
{
    if (!door || !door->open) return 0;
    for (size_t k = 0; k < count; k++)
        if (references[k] >= door->inputs + door->outputs || !door->boolean[references[k]]) return 0;
    for (size_t k = 0; k < count; k++) values[k] = door->value[references[k]] != 0.0;
    return 1;
}

/* The outputs of a step, all finite, in their places. */
static int taken(Door *door, Object *result)
{
    double out[MOST];
    if (py.Size(result) != 2) return 0;
    Object *told = py.Item(result, 1);
    if (py.Size(told) != (ssize_t)door->outputs) return 0;
    for (size_t k = 0; k < door->outputs; k++) {
        out[k] = py.AsDouble(py.Item(told, (ssize_t)k));
        if (!isfinite(out[k]) || (out[k] == -1.0 && py.Occurred())) return 0;
    }
    memcpy(door->value + door->inputs, out, door->outputs * sizeof *out);
    Object *before = door->state;
    door->state = py.Item(result, 0);
    py.IncRef(door->state);
    py.DecRef(before);
    return 1;
}

/* A step by the compiled law: all or nothing. */
static int made_alone(Door *door, double size)
{
    double next[MOST], out[MOST];
    if (fetestexcept(ODD)) feclearexcept(ODD); /* others' */
    int done = door->law(door->known, door->now, door->value, size, next, out) == 1;
    if (!done || fetestexcept(ODD)) return 0;
    for (size_t k = 0; k < door->outputs; k++)
        if (!isfinite(out[k])) return 0;
    memcpy(door->now, next, door->states * sizeof *next);
    memcpy(door->value + door->inputs, out, door->outputs * sizeof *out);
    door->steps++;
    return 1;
}

int door_step(Door *door, fmi2Real time, fmi2Real size)
{
    if (!door || door->never || !isfinite(time) || !isfinite(size) || !(size > 0.0)) return 0;
    if (door->open && door->law) return made_alone(door, size);
    int lock = py.Ensure(), done = 0;
    if (door->open || opened(door)) {
        if (door->law) {
            py.Release(lock);
            return made_alone(door, size);
        }
        Object *given[MOST + 3] = {door->parameters, door->state};
        size_t count = 2;
        for (size_t k = 0; k <= door->inputs; k++) {
            Object *one = py.FromDouble(k < door->inputs ? door->value[k] : size);
            if (!one) break;
            given[count++] = one;
        }
        Object *result = count == door->inputs + 3 ? py.Call(door->advance, given, count, NULL) : NULL;
        while (count > 2) py.DecRef(given[--count]);
        done = result && taken(door, result);
        if (result) py.DecRef(result);
        if (done) door->steps++;
        else py.Clear();
    }
    py.Release(lock);
    return done;
}

void door_shut(Door *door)
{
    if (!door || !door->open) return;
    int lock = py.Ensure();
    size_t count = door->inputs + door->outputs;
    Object *values = py.NewTuple((ssize_t)count);
    for (size_t k = 0; values && k < count; k++) py.Put(values, (ssize_t)k, py.FromDouble(door->value[k]));
    Object *done = values ? py.CallMethod(door->slave, "shut", "OO", door->state, values) : NULL;
    if (values) py.DecRef(values);
    if (done) py.DecRef(done);
    py.Clear();
    forget(door);
    py.Release(lock);
}
