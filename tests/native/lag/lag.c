/* x' = u - x, y = x + through u, for model exchange and for co-simulation. The latter is exact for an input that goes straight
   on with the derivative it was given. It answers with an error where y is read after u was set without a step in between, as
   FMI 2.0 forbids. `asked` counts directional derivatives. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { THROUGH, U, X, Y, RATE, ASKED, COUNT };
typedef struct { fmi2Real v[COUNT], slope; int type, running, stale; } Slave;

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof(Slave));
    if (s) s->type = type;
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
static void outputs(Slave *s) { s->v[Y] = s->v[X] + s->v[THROUGH] * s->v[U]; s->v[RATE] = s->v[U] - s->v[X]; }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { ((Slave *)c)->running = 1; return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { Slave *s = c; int type = s->type; *s = (Slave){.type = type}; return fmi2OK; }

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] > X) return fmi2Error;
        s->v[vr[k]] = value[k];
        if (vr[k] == U) { s->slope = 0; s->stale = s->running && s->type == fmi2CoSimulation; }
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Slave *s = c;
    if (!s->running || s->type == fmi2ModelExchange) outputs(s);
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT || (vr[k] == Y && s->stale)) return fmi2Error;
        value[k] = s->v[vr[k]];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n, const fmi2ValueReference known[],
                                            size_t m, const fmi2Real seed[], fmi2Real found[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < m; i++) {
            if (unknown[k] != Y || known[i] != U) return fmi2Error;
            found[k] = s->v[THROUGH] * seed[i];
        }
    s->v[ASKED]++;
    return fmi2OK;
}
FMI fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real value[]) {
    if (n != 1 || vr[0] != U || order[0] != 1) return fmi2Error;
    ((Slave *)c)->slope = value[0];
    return fmi2OK;
}
FMI fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] != Y || order[k] != 1) return fmi2Error;
        value[k] = s->v[U] - s->v[X] + s->v[THROUGH] * s->slope;
    }
    return fmi2OK;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    double d = s->slope, left = exp(-h);
    s->v[X] = s->v[U] - d + d * h + (s->v[X] - s->v[U] + d) * left;
    s->v[U] += d * h;
    s->stale = 0;
    outputs(s);
    return fmi2OK;
}
FMI fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) { return fmi2Discard; }
FMI fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) { *value = 0; return fmi2OK; }

FMI fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Slave));
    memcpy(*state, c, sizeof(Slave));
    return fmi2OK;
}
FMI fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { memcpy(c, state, sizeof(Slave)); return fmi2OK; }
FMI fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { free(*state); *state = NULL; return fmi2OK; }

FMI fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *told) { memset(told, 0, sizeof *told); return fmi2OK; }
FMI fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { return fmi2OK; }
FMI fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) { ((Slave *)c)->v[X] = x[0]; return fmi2OK; }
FMI fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { x[0] = ((Slave *)c)->v[X]; return fmi2OK; }
FMI fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { x[0] = 1; return fmi2OK; }
FMI fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real x[], size_t n) { outputs(c); x[0] = ((Slave *)c)->v[RATE]; return fmi2OK; }
FMI fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean keep, fmi2Boolean *event, fmi2Boolean *end) {
    *event = *end = 0;
    return fmi2OK;
}
FMI fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { return fmi2OK; }
