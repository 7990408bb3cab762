/* One to be calibrated: mass x'' + damping x' + stiffness x = gain force + offset, in Runge-Kutta steps of a quarter of
   a step. `nothing` changes nothing. Beyond `limit` it ends as told by `end`: 2 Discard, 3 Error, 6 a value that is not a
   number. After fmi2Reset it is as it is new; with `reset` 1 its state stays, with 2 it answers with an error, with 3 it crashes. */
#include "../fmi2.h"
#include <math.h>
#include <signal.h>
#include <stdlib.h>

enum { MASS, STIFFNESS, DAMPING, GAIN, OFFSET, LIMIT, NOTHING, FORCE, POSITION, SPEED, COUNT };
enum { END, RESET };
typedef struct { fmi2Real v[COUNT]; fmi2Integer i[2]; } Slave;
enum { PARTS = 4 };

static void defaults(Slave *s) { *s = (Slave){.v = {1, 100, 1, 1, 0, 1e9, 1}, .i = {3, 0}}; }

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof(Slave));
    if (s) defaults(s);
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) {
    Slave *s = c, old = *s;
    if (old.i[RESET] == 2) return fmi2Error;
    if (old.i[RESET] == 3) raise(SIGSEGV);
    defaults(s);
    if (old.i[RESET] == 1) { s->v[POSITION] = old.v[POSITION]; s->v[SPEED] = old.v[SPEED]; }
    return fmi2OK;
}

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT) return fmi2Error;
        ((Slave *)c)->v[vr[k]] = value[k];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT) return fmi2Error;
        value[k] = ((Slave *)c)->v[vr[k]];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    for (size_t k = 0; k < n; k++) ((Slave *)c)->i[vr[k]] = value[k];
    return fmi2OK;
}

static double pull(const fmi2Real *v, double x, double w) {
    return (v[GAIN] * v[FORCE] + v[OFFSET] - v[DAMPING] * w - v[STIFFNESS] * x) / v[MASS];
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    double x = s->v[POSITION], w = s->v[SPEED], d = h / PARTS;
    for (int k = 0; k < PARTS; k++) {
        double a1 = pull(s->v, x, w), w2 = w + d / 2 * a1;
        double a2 = pull(s->v, x + d / 2 * w, w2), w3 = w + d / 2 * a2;
        double a3 = pull(s->v, x + d / 2 * w2, w3), w4 = w + d * a3;
        double a4 = pull(s->v, x + d * w3, w4);
        x += d / 6 * (w + 2 * w2 + 2 * w3 + w4);
        w += d / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    s->v[POSITION] = x;
    s->v[SPEED] = w;
    if (!(fabs(x) <= s->v[LIMIT])) {
        if (s->i[END] == 6) s->v[POSITION] = NAN;
        else return s->i[END];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) { return fmi2Discard; }
FMI fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) { *value = 0; return fmi2OK; }
