/* dx/dt = u by ten steps of its own, u taken at the middle of each; before each it asks for u by then (intermediate update).
   It is asked to return early by nobody, and counts how often it asked. */
#include "../fmi3.h"
#include <stdlib.h>
#include <string.h>

enum { TIME, U, X, ASKED, SLOPE, COUNT };
typedef void (*Update)(fmi3InstanceEnvironment, double time, bool set, bool get, bool finished, bool can, bool *early, double *when);
typedef struct { double v[COUNT]; Update update; fmi3InstanceEnvironment environment; bool stepping, between, known; } Slave;
#define M Slave *m = c

FMI fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging,
                                             bool events, bool early, const fmi3ValueReference required[], size_t n,
                                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, Update update) {
    Slave *m = strcmp(token, "{integral3}") ? NULL : calloc(1, sizeof(Slave));
    if (!m) return NULL;
    m->update = update;
    m->environment = environment;
    m->known = n == 1 && required[0] == U;
    return m;
}
FMI void fmi3FreeInstance(fmi3Instance c) { free(c); }
FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool told, double tolerance, double start, bool ends, double stop) { return fmi3OK; }
FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
FMI fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
FMI fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const double value[], size_t k) {
    M;
    if (n != 1 || k != 1 || vr[0] != U || (m->stepping && !m->between)) return fmi3Error;
    m->v[U] = value[0];
    return fmi3OK;
}
FMI fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, double value[], size_t k) {
    M;
    for (size_t i = 0; i < n; i++) value[i] = m->v[vr[i]];
    return fmi3OK;
}
FMI fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, bool keep, bool *event, bool *over, bool *early, double *reached) {
    M;
    enum { STEPS = 10 };
    m->stepping = true;
    for (int k = 0; k < STEPS; k++) {
        bool wish = true; /* whatever was there: the importer says */
        double when = 0;
        m->between = true;
        if (m->update) m->update(m->environment, t + (k + 0.5) * h / STEPS, m->known, true, false, true, &wish, &when), m->v[ASKED]++;
        m->between = false;
        if (m->update && wish) return fmi3Error;
        m->v[X] += m->v[U] * h / STEPS;
    }
    m->stepping = false;
    m->v[TIME] = *reached = t + h;
    *event = *over = *early = false;
    return fmi3OK;
}
