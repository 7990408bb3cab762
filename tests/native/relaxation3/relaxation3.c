/* The relaxation of FMI 2.0 beside it, in FMI 3.0: dx/dt = -rate (x - u), exact for a held u at any step.
   At each whole second it tells of an event, which it has no mode for, and at `ends_at` it ends the run itself. */
#include "../fmi3.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TIME, RATE, U, X, ENDS_AT, COUNT };
typedef struct { double v[COUNT]; } Slave;

static void defaults(Slave *s) { *s = (Slave){{0, 1e6, 0, 1, 1e9}}; }

FMI fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging,
                                             bool events, bool early, const fmi3ValueReference required[], size_t n,
                                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, void *update) {
    Slave *s = strcmp(token, "{relaxation3}") ? NULL : calloc(1, sizeof(Slave));
    if (s) defaults(s);
    return s;
}
FMI void fmi3FreeInstance(fmi3Instance c) { free(c); }
FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool told, double tolerance, double start, bool ends, double stop) {
    ((Slave *)c)->v[TIME] = start;
    return fmi3OK;
}
FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
FMI fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
FMI fmi3Status fmi3Reset(fmi3Instance c) { defaults(c); return fmi3OK; }

FMI fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const double value[], size_t m) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == TIME || vr[i] >= COUNT || n != m) return fmi3Error;
        ((Slave *)c)->v[vr[i]] = value[i];
    }
    return fmi3OK;
}
FMI fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, double value[], size_t m) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= COUNT || n != m) return fmi3Error;
        value[i] = ((Slave *)c)->v[vr[i]];
    }
    return fmi3OK;
}
FMI fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, bool keep, bool *event, bool *over, bool *early, double *reached) {
    Slave *s = c;
    s->v[X] = s->v[U] + (s->v[X] - s->v[U]) * exp(-s->v[RATE] * h);
    *over = t + h >= s->v[ENDS_AT] - 1e-9;
    s->v[TIME] = *reached = *over ? s->v[ENDS_AT] : t + h;
    *event = floor(t + h + 1e-9) > floor(t + 1e-9);
    *early = false;
    return fmi3OK;
}

/* Hosts that look for all functions at once find the others here. */
#define REST(name) FMI fmi3Status name(fmi3Instance c) { return fmi3Error; }
FMI const char *fmi3GetVersion(void) { return "3.0"; }
REST(fmi3ActivateModelPartition) REST(fmi3CompletedIntegratorStep) REST(fmi3DeserializeFMUState)
REST(fmi3EnterConfigurationMode) REST(fmi3EnterContinuousTimeMode) REST(fmi3EnterEventMode)
REST(fmi3EnterStepMode) REST(fmi3EvaluateDiscreteStates) REST(fmi3ExitConfigurationMode) REST(fmi3FreeFMUState)
REST(fmi3GetAdjointDerivative) REST(fmi3GetBinary) REST(fmi3GetBoolean) REST(fmi3GetClock)
REST(fmi3GetContinuousStateDerivatives) REST(fmi3GetContinuousStates) REST(fmi3GetDirectionalDerivative)
REST(fmi3GetEventIndicators) REST(fmi3GetFMUState) REST(fmi3GetFloat32) REST(fmi3GetInt16) REST(fmi3GetInt32)
REST(fmi3GetInt64) REST(fmi3GetInt8) REST(fmi3GetIntervalDecimal) REST(fmi3GetIntervalFraction)
REST(fmi3GetNominalsOfContinuousStates) REST(fmi3GetNumberOfContinuousStates)
REST(fmi3GetNumberOfEventIndicators) REST(fmi3GetNumberOfVariableDependencies) REST(fmi3GetOutputDerivatives)
REST(fmi3GetShiftDecimal) REST(fmi3GetShiftFraction) REST(fmi3GetString) REST(fmi3GetUInt16)
REST(fmi3GetUInt32) REST(fmi3GetUInt64) REST(fmi3GetUInt8) REST(fmi3GetVariableDependencies)
REST(fmi3InstantiateModelExchange) REST(fmi3InstantiateScheduledExecution) REST(fmi3SerializeFMUState)
REST(fmi3SerializedFMUStateSize) REST(fmi3SetBinary) REST(fmi3SetBoolean) REST(fmi3SetClock)
REST(fmi3SetContinuousStates) REST(fmi3SetDebugLogging) REST(fmi3SetFMUState) REST(fmi3SetFloat32)
REST(fmi3SetInt16) REST(fmi3SetInt32) REST(fmi3SetInt64) REST(fmi3SetInt8) REST(fmi3SetIntervalDecimal)
REST(fmi3SetIntervalFraction) REST(fmi3SetShiftDecimal) REST(fmi3SetShiftFraction) REST(fmi3SetString)
REST(fmi3SetTime) REST(fmi3SetUInt16) REST(fmi3SetUInt32) REST(fmi3SetUInt64) REST(fmi3SetUInt8)
REST(fmi3UpdateDiscreteStates)
