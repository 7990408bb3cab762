/* capacity v' = current - conductance v: exact for held inputs. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>

enum { CONDUCTANCE, CAPACITY, CURRENT, VOLTAGE, COUNT };
typedef struct { fmi2Real v[COUNT]; } Slave;

static void defaults(Slave *s) { *s = (Slave){.v = {0.5, 0.1, 0, 0}}; }

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
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    fmi2Real *v = ((Slave *)c)->v;
    double ends = v[CURRENT] / v[CONDUCTANCE];
    v[VOLTAGE] = ends + (v[VOLTAGE] - ends) * exp(-h * v[CONDUCTANCE] / v[CAPACITY]);
    return fmi2OK;
}
