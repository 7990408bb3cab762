/* One with events: a ball that bounces. A step that meets the ground is discarded there; the last successful time
   is the instant of the impact, where the ball already has its new speed. With `whole` it stays at the step's start
   instead, so that only a smaller step helps. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>

enum { HEIGHT, SPEED, GRAVITY, RESTITUTION, BOUNCES, WHOLE };
typedef struct { fmi2Real height, speed, gravity, restitution, reached; fmi2Integer bounces; fmi2Boolean whole; } Slave;

static void defaults(Slave *s) { *s = (Slave){1.0, 0.0, 9.81, 0.8, 0.0, 0, 0}; }

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof(Slave));
    if (s) defaults(s);
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] > RESTITUTION) return fmi2Error;
        (&((Slave *)c)->height)[vr[i]] = value[i];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] > RESTITUTION) return fmi2Error;
        value[i] = (&((Slave *)c)->height)[vr[i]];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++) value[i] = ((Slave *)c)->bounces;
    return fmi2OK;
}
FMI fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    for (size_t i = 0; i < n; i++) ((Slave *)c)->whole = value[i];
    return fmi2OK;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    double v = s->speed, g = s->gravity;
    double fall = (v + sqrt(v * v + 2 * g * s->height)) / g; /* until height 0 */
    if (fall < h && s->whole) { s->reached = t; return fmi2Discard; }
    if (fall < h) {
        s->height = 0;
        s->speed = s->restitution * (g * fall - v);
        s->bounces++;
        s->reached = t + fall;
        return fmi2Discard;
    }
    s->height += v * h - 0.5 * g * h * h;
    s->speed -= g * h;
    s->reached = t + h;
    return fmi2OK;
}
FMI fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Slave *)c)->reached;
    return fmi2OK;
}
FMI fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) { *value = 0; return fmi2OK; }
