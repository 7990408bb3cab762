/* Model exchange of FMI 1.0: a ball that bounces, and counts quarters of a second. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FMI __attribute__((visibility("default")))
#define NAME(x) fall_##x
typedef enum { fmiOK, fmiWarning, fmiDiscard, fmiError, fmiFatal } fmiStatus;
typedef void *fmiComponent;
typedef unsigned int fmiValueReference;
typedef char fmiBoolean;
typedef struct { void *logger, *allocate, *free; } fmiCallbackFunctions;
typedef struct { fmiBoolean converged, references, changed, end, timed; double next; } fmiEventInfo;
enum { H, V, G, E, ENDS_AT, REALS };
typedef struct { double r[REALS], time, next; int ticks, bounces, initialized; } Model;

FMI fmiComponent NAME(fmiInstantiateModel)(const char *name, const char *guid, fmiCallbackFunctions f, fmiBoolean logging) {
    Model *m = strcmp(guid, "{fall}") ? NULL : calloc(1, sizeof(Model));
    if (m) *m = (Model){.r = {1, 0, 9.81, 0.7, 1e9}};
    return m;
}
FMI void NAME(fmiFreeModelInstance)(fmiComponent c) { free(c); }
FMI fmiStatus NAME(fmiTerminate)(fmiComponent c) { return fmiOK; }
FMI fmiStatus NAME(fmiSetTime)(fmiComponent c, double time) { ((Model *)c)->time = time; return fmiOK; }
static void tell(Model *m, fmiEventInfo *info) {
    *info = (fmiEventInfo){.converged = 1, .end = m->time >= m->r[ENDS_AT], .timed = 1, .next = fmin(m->next, m->r[ENDS_AT])};
}
FMI fmiStatus NAME(fmiInitialize)(fmiComponent c, fmiBoolean told, double tolerance, fmiEventInfo *info) {
    Model *m = c;
    if (m->initialized++) return fmiError;
    m->next = m->time + 0.25;
    tell(m, info);
    return fmiOK;
}
FMI fmiStatus NAME(fmiEventUpdate)(fmiComponent c, fmiBoolean between, fmiEventInfo *info) {
    Model *m = c;
    if (m->r[H] <= 0 && m->r[V] < 0) { m->r[H] = 0; m->r[V] *= -m->r[E]; m->bounces++; }
    while (m->time >= m->next) { m->ticks++; m->next += 0.25; }
    tell(m, info);
    return fmiOK;
}
FMI fmiStatus NAME(fmiCompletedIntegratorStep)(fmiComponent c, fmiBoolean *event) { *event = 0; return fmiOK; }
FMI fmiStatus NAME(fmiSetContinuousStates)(fmiComponent c, const double x[], size_t n) { memcpy(((Model *)c)->r, x, n * 8); return fmiOK; }
FMI fmiStatus NAME(fmiGetContinuousStates)(fmiComponent c, double x[], size_t n) { memcpy(x, ((Model *)c)->r, n * 8); return fmiOK; }
FMI fmiStatus NAME(fmiGetNominalContinuousStates)(fmiComponent c, double x[], size_t n) { x[0] = x[1] = 1; return fmiOK; }
FMI fmiStatus NAME(fmiGetDerivatives)(fmiComponent c, double dx[], size_t n) {
    Model *m = c;
    dx[0] = m->r[V];
    dx[1] = -m->r[G];
    return fmiOK;
}
FMI fmiStatus NAME(fmiGetEventIndicators)(fmiComponent c, double z[], size_t n) { z[0] = ((Model *)c)->r[H]; return fmiOK; }
FMI fmiStatus NAME(fmiSetReal)(fmiComponent c, const fmiValueReference vr[], size_t n, const double value[]) {
    for (size_t k = 0; k < n; k++) ((Model *)c)->r[vr[k]] = value[k];
    return fmiOK;
}
FMI fmiStatus NAME(fmiGetReal)(fmiComponent c, const fmiValueReference vr[], size_t n, double value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Model *)c)->r[vr[k]];
    return fmiOK;
}
FMI fmiStatus NAME(fmiGetInteger)(fmiComponent c, const fmiValueReference vr[], size_t n, int value[]) {
    for (size_t k = 0; k < n; k++) value[k] = vr[k] ? ((Model *)c)->bounces : ((Model *)c)->ticks;
    return fmiOK;
}
