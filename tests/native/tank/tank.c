/* A tank after Bernoulli: level' = gain inflow - outlet sqrt(level), flow = outlet sqrt(level), in Runge-Kutta steps of a
   quarter of a step. No brim: what would spill stays in it. The sensor's reading ends at `range`. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>

enum { GAIN, OUTLET, RANGE, INFLOW, LEVEL, FLOW, READING, COUNT };
typedef struct { fmi2Real v[COUNT]; } Slave;
enum { PARTS = 4 };

static void defaults(Slave *s) { *s = (Slave){.v = {1, 0.1, 1e9, 0, 1}}; }
static double out(const fmi2Real *v, double level) { return level > 0 ? v[OUTLET] * sqrt(level) : 0; }
static void outputs(Slave *s) {
    s->v[FLOW] = out(s->v, s->v[LEVEL]);
    s->v[READING] = s->v[LEVEL] < s->v[RANGE] ? s->v[LEVEL] : s->v[RANGE];
}

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof(Slave));
    if (s) defaults(s);
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { outputs(c); return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= FLOW) return fmi2Error;
        ((Slave *)c)->v[vr[k]] = value[k];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    outputs(c);
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT) return fmi2Error;
        value[k] = ((Slave *)c)->v[vr[k]];
    }
    return fmi2OK;
}
static double rate(const fmi2Real *v, double level) { return v[GAIN] * v[INFLOW] - out(v, level); }
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    double x = s->v[LEVEL], d = h / PARTS;
    for (int k = 0; k < PARTS; k++) {
        double a = rate(s->v, x), b = rate(s->v, x + d / 2 * a), e = rate(s->v, x + d / 2 * b), f = rate(s->v, x + d * e);
        x += d / 6 * (a + 2 * b + 2 * e + f);
        if (x < 0) x = 0;
    }
    s->v[LEVEL] = x;
    outputs(s);
    return fmi2OK;
}
