/* Model exchange: a ball that bounces, h'' = push - g, with a state event at the ground, one of an input (`alarm` while
   push > 0.5), time events every 0.25 s (`ticks`) and a step event where the ball first falls faster than `fast`. It
   refuses calls in the wrong mode. At `ends_at` it ends the run itself. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { H, V, DER_V, G, E, PUSH, FAST, ENDS_AT, TOLERANCE, REALS };
enum { TICKS, GEAR_IN, GEAR, BOUNCES, INTEGERS };
enum { ALARM, WAS_FAST, BOOLEANS };
typedef enum { SET_UP, INITIALIZING, EVENTS, CONTINUOUS } Mode;
typedef struct { double r[REALS], time, next; int i[INTEGERS], b[BOOLEANS], resting; Mode mode; } Model;

static void defaults(Model *m) { *m = (Model){.r = {[H] = 1, [G] = 9.81, [E] = 0.7, [FAST] = 1e9, [ENDS_AT] = 1e9}, .next = 0.25}; }
static double acceleration(Model *m) { return m->resting ? 0 : m->r[PUSH] - m->r[G]; }
#define WANT(mode_) if (((Model *)c)->mode != (mode_)) return fmi2Error

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    Model *m = type == fmi2ModelExchange && !strcmp(guid, "{drop}") ? calloc(1, sizeof(Model)) : NULL;
    if (m) defaults(m);
    return m;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }
FMI fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean told, fmi2Real tolerance, fmi2Real start, fmi2Boolean s, fmi2Real stop) {
    Model *m = c;
    m->r[TOLERANCE] = told ? tolerance : -1;
    m->time = start;
    m->next = start + 0.25;
    return fmi2OK;
}
FMI fmi2Status fmi2EnterInitializationMode(fmi2Component c) { WANT(SET_UP); ((Model *)c)->mode = INITIALIZING; return fmi2OK; }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { WANT(INITIALIZING); ((Model *)c)->mode = EVENTS; return fmi2OK; }
FMI fmi2Status fmi2EnterEventMode(fmi2Component c) { WANT(CONTINUOUS); ((Model *)c)->mode = EVENTS; return fmi2OK; }
FMI fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { WANT(EVENTS); ((Model *)c)->mode = CONTINUOUS; return fmi2OK; }
FMI fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    Model *m = c;
    int changed = 0;
    WANT(EVENTS);
    if (m->r[H] <= 0 && m->r[V] < 0 && !m->resting) {
        m->r[H] = 0;
        m->r[V] *= -m->r[E];
        m->i[BOUNCES]++;
        if (m->r[V] < 1e-3) m->r[V] = 0, m->resting = 1;
        changed = 1;
    }
    while (m->time >= m->next) { m->i[TICKS]++; m->next += 0.25; }
    m->b[ALARM] = m->r[PUSH] > 0.5;
    m->i[GEAR] = m->i[GEAR_IN];
    if (m->r[V] < -m->r[FAST]) m->b[WAS_FAST] = 1;
    *info = (fmi2EventInfo){.newDiscreteStatesNeeded = changed, .terminateSimulation = m->time >= m->r[ENDS_AT],
        .valuesOfContinuousStatesChanged = changed, .nextEventTimeDefined = 1, .nextEventTime = fmin(m->next, m->r[ENDS_AT])};
    return fmi2OK;
}
FMI fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean keep, fmi2Boolean *event, fmi2Boolean *end) {
    Model *m = c;
    WANT(CONTINUOUS);
    *event = m->r[V] < -m->r[FAST] && !m->b[WAS_FAST];
    *end = 0;
    return fmi2OK;
}
FMI fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { WANT(CONTINUOUS); ((Model *)c)->time = time; return fmi2OK; }
FMI fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    WANT(CONTINUOUS);
    memcpy(((Model *)c)->r, x, n * sizeof(double));
    return n == 2 ? fmi2OK : fmi2Error;
}
FMI fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { memcpy(x, ((Model *)c)->r, n * sizeof(double)); return fmi2OK; }
FMI fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    dx[0] = ((Model *)c)->r[V];
    dx[1] = acceleration(c);
    return fmi2OK;
}
FMI fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    Model *m = c;
    z[0] = m->resting ? 1 : m->r[H];
    z[1] = m->r[PUSH] - 0.5;
    return fmi2OK;
}
FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Model *m = c;
    for (size_t k = 0; k < n; k++) {
        if (m->mode > INITIALIZING && vr[k] != PUSH) return fmi2Error;
        m->r[vr[k]] = value[k];
    }
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Model *m = c;
    m->r[DER_V] = acceleration(m);
    for (size_t k = 0; k < n; k++) value[k] = m->r[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    if (((Model *)c)->mode == CONTINUOUS) return fmi2Error; /* discrete */
    for (size_t k = 0; k < n; k++) ((Model *)c)->i[vr[k]] = value[k];
    return fmi2OK;
}
FMI fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Model *)c)->i[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Model *)c)->b[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return fmi2OK;
}
FMI fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { memcpy(c, state, sizeof(Model)); return fmi2OK; }
FMI fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { free(*state); *state = NULL; return fmi2OK; }
