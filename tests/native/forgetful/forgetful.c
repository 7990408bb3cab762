/* One that takes its defaults back at fmi2SetupExperiment and at fmi2EnterInitializationMode.
   y = gain t + offset. It never takes more than 1 for `limit` and does not tell `secret`. At `ends_at` it ends the run
   itself: the step is discarded, "terminated", with the last successful time there. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GAIN, LIMIT, SECRET, ENDS_AT, Y, TOLERANCE, OFFSET, AT_ENTRY, REALS };
enum { COUNT, COUNT_IN, INTEGERS };
typedef struct {
    fmi2Real r[REALS], reached;
    fmi2Integer i[INTEGERS];
    fmi2Boolean flag, over;
    char word[100];
} Slave;

static void defaults(Slave *s) {
    double tolerance = s->r[TOLERANCE], entry = s->r[AT_ENTRY];
    *s = (Slave){.r = {1, 1, 0, 1e9, 0, tolerance, 0, entry}, .i = {1, 0}, .word = "plain"};
}

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof(Slave));
    if (s) defaults(s);
    return s;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }
FMI fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean told, fmi2Real tolerance, fmi2Real start, fmi2Boolean s, fmi2Real stop) {
    ((Slave *)c)->r[TOLERANCE] = told ? tolerance : -1;
    defaults(c);
    return fmi2OK;
}
FMI fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ((Slave *)c)->r[AT_ENTRY] = ((Slave *)c)->r[GAIN];
    defaults(c);
    return fmi2OK;
}
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { ((Slave *)c)->r[Y] = ((Slave *)c)->r[OFFSET]; return fmi2OK; }

FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Slave *s = c;
    for (size_t k = 0; k < n; k++) s->r[vr[k]] = vr[k] == LIMIT ? fmin(value[k], 1) : vr[k] == GAIN ? (float)value[k] : value[k];
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] == SECRET) return fmi2Error;
        value[k] = ((Slave *)c)->r[vr[k]];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    for (size_t k = 0; k < n; k++) ((Slave *)c)->i[vr[k]] = value[k];
    return fmi2OK;
}
FMI fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->i[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    for (size_t k = 0; k < n; k++) ((Slave *)c)->flag = value[k];
    return fmi2OK;
}
FMI fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->flag;
    return fmi2OK;
}
FMI fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
    for (size_t k = 0; k < n; k++) strncpy(((Slave *)c)->word, value[k], 99);
    return fmi2OK;
}
FMI fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->word;
    return fmi2OK;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    if (s->over) return fmi2Error;
    s->over = t + h >= s->r[ENDS_AT] - 1e-9;
    s->reached = s->over ? s->r[ENDS_AT] : t + h;
    s->r[Y] = s->r[GAIN] * s->reached + s->r[OFFSET];
    return s->over ? fmi2Discard : fmi2OK;
}
FMI fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) { *value = ((Slave *)c)->reached; return fmi2OK; }
FMI fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) { *value = ((Slave *)c)->over; return fmi2OK; }
