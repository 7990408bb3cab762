/* FMI 3.0, in all three interfaces: echoes of every type, y = K u with a matrix of K whose size is chosen, and counters
   of clocks: `beat` ticks every 0.3 s from 0.1 s on, `later` 0.05 s after each third beat, `hit` when somebody says so;
   `out` ticks at every other beat. Between events x falls with rate 1 from its value at the last beat, which adds 1.
   It refuses calls in the wrong mode and numbers of values that are wrong. At `ends_at` it ends the run itself. */
#include "../fmi3.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TIME, N, K, U, Y, X, ENDS_AT, F32_IN, F32, BIN_IN, BIN, WORD_IN, WORD, FLAG_IN, FLAG, KIND_IN, KIND, DER_X };
enum { I8_IN = 100, I8, U8_IN, U8, I16_IN, I16, U16_IN, U16, I32_IN, I32, U32_IN, U32, I64_IN, I64, U64_IN, U64 };
enum { BEAT = 200, LATER, HIT, OUT, BEATS, LATERS, HITS, EVENTS };
#define MOST 4
typedef enum { SET_UP, CONFIGURING, INITIALIZING, EVENT, STEP, CONTINUOUS, PARTITIONS } Mode;
typedef struct {
    Mode mode;
    char interface; /* c, m, s */
    bool events, early, ticking[3], out;
    uint64_t n;
    double time, k[MOST][MOST], u[MOST], x, ends_at, countdown;
    float f32_in;
    int64_t ints[16], kind;
    int32_t counts[4];
    bool flag;
    uint8_t bytes[64];
    size_t length;
    char word[64];
    fmi3IntervalQualifier known;
    double next; /* beat, which it knows itself to return there */
} Model;

static void defaults(Model *m) {
    *m = (Model){.interface = m->interface, .events = m->events, .early = m->early, .n = 2, .ends_at = 1e9, .kind = 1, .next = 0.1,
                 .word = "plain", .bytes = "foo", .length = 3};
    for (int i = 0; i < MOST; i++) m->k[i][i] = 1;
}
static Model *made(fmi3String token, char interface, bool events, bool early) {
    Model *m = strcmp(token, "{sampler}") ? NULL : calloc(1, sizeof(Model));
    if (m) { m->interface = interface; m->events = events; m->early = early; defaults(m); }
    return m;
}
#define WANT(condition) do { if (!(condition)) return fmi3Error; } while (0)
#define M Model *m = c

FMI fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging, bool events,
    bool early, const fmi3ValueReference vr[], size_t n, fmi3InstanceEnvironment e, fmi3LogMessageCallback log, void *update) {
    return made(token, 'c', events, early);
}
FMI fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging,
    fmi3InstanceEnvironment e, fmi3LogMessageCallback log) {
    return made(token, 'm', true, false);
}
FMI fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging,
    fmi3InstanceEnvironment e, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update, fmi3PreemptionCallback l, fmi3PreemptionCallback u) {
    return made(token, 's', false, false);
}
FMI void fmi3FreeInstance(fmi3Instance c) { free(c); }
FMI fmi3Status fmi3Reset(fmi3Instance c) { defaults(c); return fmi3OK; }
FMI fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { M; WANT(m->mode == SET_UP); m->mode = CONFIGURING; return fmi3OK; }
FMI fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { M; WANT(m->mode == CONFIGURING); m->mode = SET_UP; return fmi3OK; }
FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool told, double tolerance, double start, bool s, double stop) {
    M; WANT(m->mode == SET_UP); m->mode = INITIALIZING; m->time = start; m->next = start + 0.1; return fmi3OK;
}
FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    M; WANT(m->mode == INITIALIZING);
    m->mode = m->interface == 's' ? PARTITIONS : m->interface == 'm' || m->events ? EVENT : STEP;
    return fmi3OK;
}
FMI fmi3Status fmi3Terminate(fmi3Instance c) { M; WANT(m->mode > INITIALIZING); return fmi3OK; }
FMI fmi3Status fmi3EnterEventMode(fmi3Instance c) { M; WANT(m->mode == STEP || m->mode == CONTINUOUS); m->mode = EVENT; return fmi3OK; }
FMI fmi3Status fmi3EnterStepMode(fmi3Instance c) { M; WANT(m->mode == EVENT && m->interface == 'c'); m->mode = STEP; return fmi3OK; }
FMI fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { M; WANT(m->mode == EVENT && m->interface == 'm'); m->mode = CONTINUOUS; return fmi3OK; }

/* --- clocks */
static void beat(Model *m) {
    m->counts[0]++; m->x += 1; m->next += 0.3;
    m->out = m->counts[0] % 2 == 0;
    if (m->counts[0] % 3 == 0) { m->known = fmi3IntervalChanged; m->countdown = 0.05; }
}
FMI fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const bool value[]) {
    M; WANT(m->mode == EVENT);
    for (size_t k = 0; k < n; k++) {
        WANT(vr[k] >= BEAT && vr[k] <= HIT);
        m->ticking[vr[k] - BEAT] = value[k];
        if (vr[k] == BEAT && value[k]) m->out = (m->counts[0] + 1) % 2 == 0;
    }
    return fmi3OK;
}
FMI fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, bool value[]) {
    M; for (size_t k = 0; k < n; k++) { WANT(vr[k] == OUT); value[k] = m->out; }
    return fmi3OK;
}
FMI fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, double interval[], fmi3IntervalQualifier q[]) {
    M; for (size_t k = 0; k < n; k++) {
        WANT(vr[k] == LATER);
        q[k] = m->known; interval[k] = m->countdown;
        if (m->known == fmi3IntervalChanged) m->known = fmi3IntervalUnchanged;
    }
    return fmi3OK;
}
FMI fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, bool *again, bool *end, bool *nominals, bool *states, bool *timed, double *next) {
    M; WANT(m->mode == EVENT);
    m->counts[3]++;
    *states = m->ticking[0];
    if (m->ticking[0]) beat(m);
    if (m->ticking[1]) m->counts[1]++;
    if (m->ticking[2]) m->counts[2]++;
    m->out = m->ticking[0] = m->ticking[1] = m->ticking[2] = false;
    *again = *nominals = *timed = false;
    if (m->interface == 'm' && m->time < m->ends_at) { *timed = m->ends_at < 1e9; *next = m->ends_at; }
    *end = m->time >= m->ends_at - 1e-9;
    return fmi3OK;
}
FMI fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, double time) {
    M; WANT(m->mode == PARTITIONS && time >= m->time);
    m->x *= exp(m->time - time);
    m->time = time;
    m->out = false;
    if (clock == BEAT) beat(m);
    if (clock == LATER) m->counts[1]++;
    if (clock == HIT) m->counts[2]++;
    return fmi3OK;
}

/* --- steps: it cannot go past a beat that has not ticked, and returns at the event of its end */
FMI fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, bool keep, bool *event, bool *end, bool *early, double *reached) {
    M; WANT(m->mode == STEP && fabs(t - m->time) < 1e-9 && (!m->events || t + h < m->next + 1e-9));
    double goal = t + h;
    *event = *end = *early = false;
    if (m->early && m->ends_at > t && m->ends_at < goal) { goal = m->ends_at; *event = *early = true; }
    if (!m->events && goal >= m->ends_at) { goal = m->ends_at; *end = true; }
    m->x *= exp(m->time - goal);
    m->time = *reached = goal;
    return fmi3OK;
}
FMI fmi3Status fmi3SetTime(fmi3Instance c, double t) { M; WANT(m->mode == CONTINUOUS); m->time = t; return fmi3OK; }
FMI fmi3Status fmi3GetContinuousStates(fmi3Instance c, double x[], size_t n) { M; WANT(n == 1); x[0] = m->x; return fmi3OK; }
FMI fmi3Status fmi3SetContinuousStates(fmi3Instance c, const double x[], size_t n) { M; WANT(n == 1 && m->mode == CONTINUOUS); m->x = x[0]; return fmi3OK; }
FMI fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, double dx[], size_t n) { M; WANT(n == 1); dx[0] = -m->x; return fmi3OK; }

/* --- values */
static double *floats(Model *m, fmi3ValueReference vr, size_t *count) {
    *count = 1;
    switch (vr) {
        case TIME: return &m->time;
        case X: return &m->x;
        case ENDS_AT: return &m->ends_at;
        case U: *count = m->n; return m->u;
        default: *count = 0; return NULL;
    }
}
FMI fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, double value[], size_t count) {
    M; size_t at = 0, own;
    for (size_t k = 0; k < n; k++) {
        double *from = floats(m, vr[k], &own);
        for (size_t i = 0; from && i < own; i++) value[at++] = from[i];
        if (vr[k] == DER_X) value[at++] = -m->x;
        for (size_t i = 0; vr[k] == K && i < m->n * m->n; i++) value[at++] = m->k[i / m->n][i % m->n];
        for (size_t i = 0; vr[k] == Y && i < m->n; i++) {
            value[at] = 0;
            for (size_t j = 0; j < m->n; j++) value[at] += m->k[i][j] * m->u[j];
            at++;
        }
    }
    return at == count ? fmi3OK : fmi3Error;
}
FMI fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const double value[], size_t count) {
    M; size_t at = 0, own;
    for (size_t k = 0; k < n; k++) {
        WANT(vr[k] == U || m->mode <= INITIALIZING);
        double *to = floats(m, vr[k], &own);
        for (size_t i = 0; to && i < own; i++) to[i] = value[at++];
        for (size_t i = 0; vr[k] == K && i < m->n * m->n; i++) m->k[i / m->n][i % m->n] = value[at++];
    }
    return at == count ? fmi3OK : fmi3Error;
}
#define DISCRETE WANT(n == count && m->mode != CONTINUOUS && !(m->mode == STEP && m->events))
#define INTEGER(name, type) \
    FMI fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, type value[], size_t count) { \
        M; WANT(n == count); \
        for (size_t k = 0; k < n; k++) value[k] = vr[k] == N ? (type)m->n : vr[k] == KIND || vr[k] == KIND_IN ? (type)m->kind \
            : vr[k] >= BEATS ? (type)m->counts[vr[k] - BEATS] : (type)m->ints[(vr[k] - I8_IN) / 2 * 2]; \
        return fmi3OK; \
    } \
    FMI fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const type value[], size_t count) { \
        M; DISCRETE; \
        for (size_t k = 0; k < n; k++) { \
            WANT(vr[k] != N || (m->mode == CONFIGURING && value[k] <= MOST)); \
            if (vr[k] == N) m->n = value[k]; \
            else if (vr[k] == KIND_IN) m->kind = value[k]; \
            else m->ints[vr[k] - I8_IN] = value[k]; \
        } \
        return fmi3OK; \
    }
INTEGER(Int8, int8_t) INTEGER(UInt8, uint8_t) INTEGER(Int16, int16_t) INTEGER(UInt16, uint16_t)
INTEGER(Int32, int32_t) INTEGER(UInt32, uint32_t) INTEGER(Int64, int64_t) INTEGER(UInt64, uint64_t)

#define ECHO(name, type, field) \
    FMI fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, type value[], size_t count) { \
        M; WANT(n == count); for (size_t k = 0; k < n; k++) value[k] = m->field; return fmi3OK; \
    }
ECHO(Float32, float, f32_in) ECHO(Boolean, bool, flag) ECHO(String, fmi3String, word)
FMI fmi3Status fmi3SetFloat32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const float value[], size_t count) {
    M; WANT(n == count); for (size_t k = 0; k < n; k++) m->f32_in = value[k]; return fmi3OK;
}
FMI fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const bool value[], size_t count) {
    M; DISCRETE; for (size_t k = 0; k < n; k++) m->flag = value[k]; return fmi3OK;
}
FMI fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3String value[], size_t count) {
    M; DISCRETE; for (size_t k = 0; k < n; k++) strncpy(m->word, value[k], 63); return fmi3OK;
}
FMI fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary value[], size_t count) {
    M; DISCRETE;
    for (size_t k = 0; k < n; k++) { WANT(sizes[k] <= 64); memcpy(m->bytes, value[k], m->length = sizes[k]); }
    return fmi3OK;
}
FMI fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary value[], size_t count) {
    M; WANT(n == count);
    for (size_t k = 0; k < n; k++) { sizes[k] = m->length; value[k] = m->bytes; }
    return fmi3OK;
}
FMI fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return fmi3OK;
}
FMI fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { memcpy(c, state, sizeof(Model)); return fmi3OK; }
FMI fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { free(*state); *state = NULL; return fmi3OK; }
