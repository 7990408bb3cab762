/* A stiff one: dx/dt = -rate (x - u), rate 1e6 1/s, exact for a held u at any step. Reals only; saves its state. */
#include "../fmi2.h"
#include <math.h>

enum { RATE, U, X, FLOW, COUNT };
typedef struct { fmi2Real v[COUNT]; const fmi2CallbackFunctions *f; } Slave;

static void defaults(Slave *s) { s->v[RATE] = 1e6; s->v[U] = 0; s->v[X] = 1; s->v[FLOW] = 0; }
static void outputs(Slave *s) { s->v[FLOW] = s->v[RATE] * (s->v[U] - s->v[X]); }

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2CoSimulation) return NULL;
    Slave *s = f->allocateMemory(1, sizeof(Slave));
    if (s) { s->f = f; defaults(s); }
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { if (c) ((Slave *)c)->f->freeMemory(c); }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { outputs(c); return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Slave *s = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= FLOW) return fmi2Error;
        s->v[vr[i]] = value[i];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= COUNT) return fmi2Error;
        value[i] = ((Slave *)c)->v[vr[i]];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    s->v[X] = s->v[U] + (s->v[X] - s->v[U]) * exp(-s->v[RATE] * h);
    outputs(s);
    return fmi2OK;
}
FMI fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Slave *s = c;
    if (!*state) *state = s->f->allocateMemory(1, sizeof(Slave));
    if (!*state) return fmi2Error;
    *(Slave *)*state = *s;
    return fmi2OK;
}
FMI fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { *(Slave *)c = *(Slave *)state; return fmi2OK; }
FMI fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (*state) ((Slave *)c)->f->freeMemory(*state);
    *state = NULL;
    return fmi2OK;
}
