/* One with strings, integers, booleans and an enumeration, that ends as told at `ends_at`: 1 Warning, 2 Discard,
   3 Error, 4 Fatal, 5 a crash of the process (below 0 at initialization), 6 a value that is not a number, 7 Error to
   fmi2Terminate. With `slow` its steps are pending for
   a while. Only one instance per process; only steps of one size. */
#include "../fmi2.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ENDS_AT, VALUE };
enum { END, COUNT_IN, COUNT_OUT, MOOD };
enum { SLOW, FLAG_IN, FLAG_OUT };
enum { WORD_IN, WORD_OUT, WORDS };
typedef struct {
    fmi2Real r[2];
    fmi2Integer i[4];
    fmi2Boolean b[3];
    char w[WORDS][200];
    double size;
    int pending;
    const fmi2CallbackFunctions *f;
} Slave;
static Slave *only = NULL;

static void defaults(Slave *s) {
    const fmi2CallbackFunctions *f = s->f;
    *s = (Slave){.r = {1e9, 0}, .i = {3, 0, 0, 1}, .w = {"nothing", ""}, .f = f};
}
#define LOG(s, status, ...) (s)->f->logger((s)->f->componentEnvironment, "teller", status, "all", __VA_ARGS__)

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) {
    if (only) {
        f->logger(f->componentEnvironment, name, fmi2Error, "all", "%s: one teller per process is enough", name);
        return NULL;
    }
    only = calloc(1, sizeof(Slave));
    only->f = f;
    defaults(only);
    return only;
}
FMI void fmi2FreeInstance(fmi2Component c) { free(c); only = NULL; }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Slave *s = c;
    if (s->i[END] == 5 && s->r[ENDS_AT] < 0) *(volatile int *)0 = 0;
    LOG(s, fmi2OK, "begins with %s, %d and %.3f", s->w[WORD_IN], s->i[COUNT_IN], s->r[ENDS_AT]);
    return fmi2OK;
}
FMI fmi2Status fmi2Terminate(fmi2Component c) { return ((Slave *)c)->i[END] == 7 ? fmi2Error : fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }

#define ACCESS(Name, Type, field)                                                                                              \
    FMI fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const Type value[]) {               \
        for (size_t k = 0; k < n; k++) ((Slave *)c)->field[vr[k]] = value[k];                                                  \
        return fmi2OK;                                                                                                         \
    }                                                                                                                          \
    FMI fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, Type value[]) {                     \
        for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->field[vr[k]];                                                  \
        return fmi2OK;                                                                                                         \
    }
ACCESS(Real, fmi2Real, r)
ACCESS(Integer, fmi2Integer, i)
ACCESS(Boolean, fmi2Boolean, b)

FMI fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
    for (size_t k = 0; k < n; k++) strncpy(((Slave *)c)->w[vr[k]], value[k], 199);
    return fmi2OK;
}
FMI fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->w[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    if (s->size > 0 && fabs(h - s->size) > 1e-9) { LOG(s, fmi2Error, "my steps are of %g s, not of %g s", s->size, h); return fmi2Error; }
    s->size = h;
    if (t + h > s->r[ENDS_AT]) {
        LOG(s, s->i[END], "told to end at %g s, 100%% on purpose", s->r[ENDS_AT]);
        if (s->i[END] == 5) *(volatile int *)0 = 0;
        if (s->i[END] == 6) s->r[VALUE] = NAN;
        else if (s->i[END] != 1) return s->i[END];
    }
    s->i[COUNT_OUT] = s->i[COUNT_IN] + 1;
    s->b[FLAG_OUT] = !s->b[FLAG_IN];
    strcpy(s->w[WORD_OUT], s->w[WORD_IN]);
    strncat(s->w[WORD_OUT], "!", 199 - strlen(s->w[WORD_OUT]));
    if (s->b[SLOW]) { s->pending = 3; return fmi2Pending; }
    return t + h > s->r[ENDS_AT] && s->i[END] == 1 ? fmi2Warning : fmi2OK;
}
FMI fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
    Slave *s = c;
    *value = s->pending > 0 ? fmi2Pending : fmi2OK;
    s->pending--;
    return fmi2OK;
}
FMI fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) { return fmi2Discard; }
FMI fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) { *value = fmi2True; return fmi2OK; }
