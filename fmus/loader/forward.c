/* The binary of an FMU on Linux: it brings Python, then passes every call on to pythonfmu's own library beside it.

   What it adds on the way:
     - a process without Python gets one (python.c), and a sentence where there is none
     - the resource location is decoded as the URI it is, whatever characters the path has
     - an error that the slave logs during a call is the status of that call
     - an instance that the host frees is kept and given out again, reset: pythonfmu's library loses about 1 kB at
       every instantiation, and its states are freed with the instance
     - a state that the slave did not give out is refused, and so is every call after a fatal one
     - another GUID than that of the FMU makes no instance
     - the calls of a step go the short way where the slave has one (door.c) */
#define _GNU_SOURCE
#include "door.h"
#include "fmi2.h"
#include "python.h"

#include <ctype.h>
#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef const fmi2ValueReference *References;

/* name, parameters after the component, arguments after the component */
#define SIMPLE_FUNCTIONS(F) \
    F(SetupExperiment, (fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real s, fmi2Boolean ed, fmi2Real e), \
      (i, td, t, s, ed, e)) \
    F(EnterInitializationMode, (fmi2Component c), (i)) \
    F(ExitInitializationMode, (fmi2Component c), (i)) \
    F(Terminate, (fmi2Component c), (i)) \
    F(GetInteger, (fmi2Component c, References r, size_t n, fmi2Integer *v), (i, r, n, v)) \
    F(GetString, (fmi2Component c, References r, size_t n, fmi2String *v), (i, r, n, v)) \
    F(SetInteger, (fmi2Component c, References r, size_t n, const fmi2Integer *v), (i, r, n, v)) \
    F(SetBoolean, (fmi2Component c, References r, size_t n, const fmi2Boolean *v), (i, r, n, v)) \
    F(SetString, (fmi2Component c, References r, size_t n, const fmi2String *v), (i, r, n, v)) \
    F(GetDirectionalDerivative, (fmi2Component c, References u, size_t nu, References k, size_t nk, const fmi2Real *dk, \
                               fmi2Real *du), (i, u, nu, k, nk, dk, du)) \
    F(SetRealInputDerivatives, (fmi2Component c, References r, size_t n, const fmi2Integer *o, const fmi2Real *v), \
      (i, r, n, o, v)) \
    F(GetRealOutputDerivatives, (fmi2Component c, References r, size_t n, const fmi2Integer *o, fmi2Real *v), (i, r, n, o, v)) \
    F(CancelStep, (fmi2Component c), (i)) \
    F(GetStatus, (fmi2Component c, fmi2StatusKind k, fmi2Status *v), (i, k, v)) \
    F(GetRealStatus, (fmi2Component c, fmi2StatusKind k, fmi2Real *v), (i, k, v)) \
    F(GetIntegerStatus, (fmi2Component c, fmi2StatusKind k, fmi2Integer *v), (i, k, v)) \
    F(GetBooleanStatus, (fmi2Component c, fmi2StatusKind k, fmi2Boolean *v), (i, k, v)) \
    F(GetStringStatus, (fmi2Component c, fmi2StatusKind k, fmi2String *v), (i, k, v))

/* those that may go the short way; another condition than that of their status before them */
#define STEP_FUNCTIONS(F) \
    F(SetReal, (fmi2Component c, References r, size_t n, const fmi2Real *v), (i, r, n, v), door_set(it->door, r, n, v)) \
    F(GetReal, (fmi2Component c, References r, size_t n, fmi2Real *v), (i, r, n, v), door_get(it->door, r, n, v)) \
    F(GetBoolean, (fmi2Component c, References r, size_t n, fmi2Boolean *v), (i, r, n, v), \
      door_get_boolean(it->door, r, n, v)) \
    F(DoStep, (fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean n), (i, t, h, n), door_step(it->door, t, h))

#define STATE_FUNCTIONS(F) \
    F(GetFMUstate, (fmi2Component c, fmi2FMUstate *s), ) \
    F(SetFMUstate, (fmi2Component c, fmi2FMUstate s), ) \
    F(FreeFMUstate, (fmi2Component c, fmi2FMUstate *s), ) \
    F(SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate s, size_t *n), ) \
    F(SerializeFMUstate, (fmi2Component c, fmi2FMUstate s, fmi2Byte *b, size_t n), ) \
    F(DeSerializeFMUstate, (fmi2Component c, const fmi2Byte *b, size_t n, fmi2FMUstate *s), )

static struct { /* pythonfmu's functions */
    void *library;
    fmi2Component (*Instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean,
                                 fmi2Boolean);
    void (*FreeInstance)(fmi2Component);
    fmi2Status (*Reset)(fmi2Component);
#define DECLARE(name, parameters, ...) fmi2Status(*name) parameters;
    SIMPLE_FUNCTIONS(DECLARE)
    STEP_FUNCTIONS(DECLARE)
    STATE_FUNCTIONS(DECLARE)
} to;

typedef struct Instance {
    fmi2Component slave; /* pythonfmu's component */
    Door *door;          /* the short way to it, where it has one */
    fmi2CallbackFunctions own, host;
    char *name, *resources, *link; /* link: folder in the temporary folder that holds a plain path to the resources */
    char content[128];             /* of slavemodule.txt, which names the content of the FMU */
    fmi2Boolean talkative, dead; /* dead: after a fatal status pythonfmu's component must not be touched again */
    fmi2Status said; /* the worst that the slave logged during the present call */
    fmi2FMUstate *states;
    size_t count, room;
    int spare; /* freed by the host, to be given out again */
    struct Instance *next;
} Instance;

enum { SPARE = 16 }; /* that many are kept */
static Instance *every;
static int spare_count;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

/* Pass a text on to the host, which takes it as a format: '%' is doubled. */
static void tell(const fmi2CallbackFunctions *host, fmi2String name, fmi2Status status, fmi2String category, fmi2String text)
{
    char *plain = host->logger ? malloc(2 * strlen(text) + 1) : NULL, *end = plain;
    if (!plain) return;
    while (*text)
        if ((*end++ = *text++) == '%') *end++ = '%';
    *end = 0;
    host->logger(host->componentEnvironment, name, status, category, plain);
    free(plain);
}

/* What the slave says goes to the host under the host's name for the instance. */
static void heard(fmi2ComponentEnvironment environment, fmi2String unused, fmi2Status status, fmi2String category,
                  fmi2String text, ...)
{
    Instance *it = environment;
    (void)unused;
    if (!it) return;
    if (status >= fmi2Error && status <= fmi2Fatal && status > it->said) it->said = status;
    if (!category || !*category) category = "logAll";
    if (status != fmi2OK || it->talkative) tell(&it->host, it->name, status, category, text ? text : "");
}

/* The instance behind a component, at the beginning of a call; NULL if it cannot take any. */
static Instance *called(fmi2Component c)
{
    Instance *it = c;
    if (!it || it->dead) return NULL;
    door_shut(it->door);
    it->said = fmi2OK;
    return it;
}

/* The status of the call: at least what the slave logged. */
static fmi2Status judged(Instance *it, fmi2Status status)
{
    if (status == fmi2Pending || it->said > status) status = it->said;
    it->dead = status == fmi2Fatal;
    return status;
}

#define FORWARD(name, parameters, arguments) \
    FMI2_EXPORT fmi2Status fmi2##name parameters \
    { \
        Instance *it = called(c); \
        if (!it) return fmi2Fatal; \
        fmi2Component i = it->slave; \
        return judged(it, to.name arguments); \
    }
SIMPLE_FUNCTIONS(FORWARD)

#define FORWARD_STEP(name, parameters, arguments, done) \
    FMI2_EXPORT fmi2Status fmi2##name parameters \
    { \
        Instance *it = c; \
        if (it && !it->dead && done) return fmi2OK; \
        if (!(it = called(c))) return fmi2Fatal; \
        fmi2Component i = it->slave; \
        return judged(it, to.name arguments); \
    }
STEP_FUNCTIONS(FORWARD_STEP)

/* pythonfmu makes another slave. */
static fmi2Status begun_anew(Instance *it)
{
    door_before();
    fmi2Status status = to.Reset(it->slave);
    it->door = door_of(it->door);
    return status;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    Instance *it = called(c);
    return it ? judged(it, begun_anew(it)) : fmi2Fatal;
}

FMI2_EXPORT const int selflock_python = 1; /* its calls need Python's lock; our master holds it over many of them */

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *categories)
{
    (void)n, (void)categories;
    if (!c) return fmi2Error;
    ((Instance *)c)->talkative = on;
    return fmi2OK;
}

/* States. */

static fmi2FMUstate *place_of(Instance *it, fmi2FMUstate state)
{
    for (size_t n = 0; n < it->count; n++)
        if (it->states[n] == state) return it->states + n;
    return NULL;
}

static fmi2Status remember(Instance *it, fmi2Status status, fmi2FMUstate fresh, fmi2FMUstate *given)
{
    status = judged(it, status);
    if (status > fmi2Warning || !fresh) return status == fmi2OK ? fmi2Error : status;
    fmi2FMUstate *place = *given ? place_of(it, *given) : NULL; /* a state that is given back is used again */
    if (place) {
        to.FreeFMUstate(it->slave, place);
    } else {
        if (it->count == it->room) {
            size_t room = it->room ? 2 * it->room : 8;
            fmi2FMUstate *more = realloc(it->states, room * sizeof *more);
            if (!more) return fmi2Error;
            it->states = more, it->room = room;
        }
        place = it->states + it->count++;
    }
    return *given = *place = fresh, status;
}

static fmi2Status not_ours(Instance *it)
{
    heard(it, NULL, fmi2Error, "logStatusError", "this state was not given out by this instance, or has been freed");
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *it = called(c);
    fmi2FMUstate fresh = NULL;
    if (!it || !state) return it ? fmi2Error : fmi2Fatal;
    fmi2Status status = to.GetFMUstate(it->slave, &fresh);
    return remember(it, status, fresh, state);
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte *bytes, size_t size, fmi2FMUstate *state)
{
    Instance *it = called(c);
    fmi2FMUstate fresh = NULL;
    if (!it || !state) return it ? fmi2Error : fmi2Fatal;
    fmi2Status status = to.DeSerializeFMUstate(it->slave, bytes, size, &fresh);
    return remember(it, status, fresh, state);
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Instance *it = called(c);
    if (!it) return fmi2Fatal;
    return place_of(it, state) ? judged(it, to.SetFMUstate(it->slave, state)) : not_ours(it);
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    Instance *it = called(c);
    if (!it) return fmi2Fatal;
    return place_of(it, state) ? judged(it, to.SerializedFMUstateSize(it->slave, state, size)) : not_ours(it);
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte *bytes, size_t size)
{
    Instance *it = called(c);
    if (!it) return fmi2Fatal;
    return place_of(it, state) ? judged(it, to.SerializeFMUstate(it->slave, state, bytes, size)) : not_ours(it);
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *it = called(c);
    if (!it) return fmi2Fatal;
    if (!state || !*state) return fmi2OK;
    fmi2FMUstate *place = place_of(it, *state);
    if (!place) return not_ours(it);
    fmi2Status status = to.FreeFMUstate(it->slave, place);
    *place = it->states[--it->count];
    *state = NULL;
    return judged(it, status);
}

/* The resource location: a URI, in practice also a plain path. */

static void decode(const char *uri, char *path)
{
    if (!strncmp(uri, "file:", 5)) {
        uri += 5;
        if (uri[0] == '/' && uri[1] == '/') { /* an authority: empty or a host, of which only this one can be meant */
            const char *slash = strchr(uri + 2, '/');
            uri = slash ? slash : uri + strlen(uri);
        }
    }
    for (; *uri; uri++) {
        unsigned byte;
        int escaped = *uri == '%' && isxdigit((unsigned char)uri[1]) && isxdigit((unsigned char)uri[2]);
        if (escaped && sscanf(uri + 1, "%2x", &byte) == 1 && byte) {
            *path++ = (char)byte;
            uri += 2;
        } else {
            *path++ = *uri;
        }
    }
    *path = 0;
}

/* The text of a small file in a folder; 0 where there is none, and then `content` stays as it is. */
static int text_of(const char *folder, const char *name, char *content, size_t size)
{
    char file[PATH_MAX];
    if (snprintf(file, sizeof file, "%s/%s", folder, name) >= (int)sizeof file) return 0;
    FILE *stream = fopen(file, "r");
    if (!stream) return 0;
    content[fread(content, 1, size - 1, stream)] = 0;
    fclose(stream);
    return 1;
}

/* Whether the host means this FMU: by the GUID in its resources, where there is one. */
static int meant(const char *resources, const char *given, char *own, size_t size)
{
    *own = 0;
    return !text_of(resources, "guid.txt", own, size) || (given && !strcmp(given, own));
}

/* The resources folder as the host says it (decoded, then as it is), else beside this library. */
static char *find_resources(const char *uri, const char *here, char *content, size_t size)
{
    char path[PATH_MAX];
    if (uri && strlen(uri) < sizeof path) {
        decode(uri, path);
        if (text_of(path, "slavemodule.txt", content, size)) return strdup(path);
        const char *plain = !strncmp(uri, "file://", 7) ? uri + 7 : uri;
        if (text_of(plain, "slavemodule.txt", content, size)) return strdup(plain);
    }
    int length = snprintf(path, sizeof path, "%s/../../resources", here);
    return length < (int)sizeof path && text_of(path, "slavemodule.txt", content, size) ? realpath(path, NULL) : NULL;
}

/* pythonfmu's library and some Pythons stumble over characters in paths; such a path gets a plain name that leads to it. */
static char *plain_path(const char *path, char **link)
{
    const char *folder = getenv("TMPDIR");
    char made[PATH_MAX];
    *link = NULL;
    if (path[strspn(path, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-")] == 0) return strdup(path);
    if (!folder || folder[strspn(folder, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-")]) folder = "/tmp";
    snprintf(made, sizeof made, "%s/selflock-XXXXXX", folder);
    if (!mkdtemp(made)) return strdup(path);
    char *full = realpath(path, NULL), *name = NULL;
    if (asprintf(&name, "%s/resources", made) < 0 || !full || symlink(full, name)) {
        rmdir(made);
        free(name), free(full);
        return strdup(path);
    }
    free(full);
    *link = strdup(made);
    return name;
}

/* Life. */

static int here(char *folder, size_t size)
{
    Dl_info info;
    if (!dladdr((void *)&lock, &info) || !info.dli_fname || strlen(info.dli_fname) >= size) return 0;
    strcpy(folder, info.dli_fname);
    char *slash = strrchr(folder, '/');
    if (slash) *slash = 0;
    else strcpy(folder, ".");
    return 1;
}

/* pythonfmu's library ends its hold on Python twice at the end of a process, the second time through freed memory.
   Ended here before, both find nothing left to do. */
static void (*let_go_of_python)(void);

static void before_exit(void) { let_go_of_python(); }

static int opened(const char *folder, char *why, size_t size)
{
    char path[PATH_MAX];
    if (!python_ready(why, size)) return 0;
    snprintf(path, sizeof path, "%s/libpythonfmu-export.so", folder);
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        snprintf(why, size, "cannot open pythonfmu's library: %s", dlerror());
        return 0;
    }
    int whole = 1;
#define FIND(name, ...) whole = (to.name = dlsym(library, "fmi2" #name)) && whole;
    FIND(Instantiate, , )
    FIND(FreeInstance, , )
    FIND(Reset, , )
    SIMPLE_FUNCTIONS(FIND)
    STEP_FUNCTIONS(FIND)
    STATE_FUNCTIONS(FIND)
    if (whole) {
        to.library = library;
        let_go_of_python = (void (*)(void))dlsym(library, "finalizePythonInterpreter");
        if (let_go_of_python) atexit(before_exit);
    } else snprintf(why, size, "%s lacks functions of FMI 2.0", path);
    return whole;
}

static int open_library(const char *folder, char *why, size_t size)
{
    pthread_mutex_lock(&lock);
    int done = to.library || opened(folder, why, size);
    pthread_mutex_unlock(&lock);
    return done;
}

static void unlink_path(Instance *it)
{
    char name[PATH_MAX];
    if (!it->link) return;
    snprintf(name, sizeof name, "%s/resources", it->link);
    unlink(name);
    rmdir(it->link);
}

__attribute__((destructor)) static void at_exit(void)
{
    for (Instance *it = every; it; it = it->next) unlink_path(it);
}

static void discard(Instance *it)
{
    pthread_mutex_lock(&lock);
    for (Instance **place = &every; *place; place = &(*place)->next)
        if (*place == it) {
            *place = it->next;
            break;
        }
    pthread_mutex_unlock(&lock);
    unlink_path(it);
    door_close(it->door, it->dead); /* a dead one's Python objects are lost */
    free(it->name), free(it->resources), free(it->link), free(it->states), free(it);
}

/* A spare instance of the same content, or a new one without a slave. */
static Instance *taken(const char *resources, const char *content)
{
    pthread_mutex_lock(&lock);
    Instance *it = every;
    while (it && !(it->spare && !strcmp(it->resources, resources) && !strcmp(it->content, content))) it = it->next;
    if (it) {
        it->spare = 0;
        spare_count--;
    } else if ((it = calloc(1, sizeof *it))) {
        it->next = every, every = it;
    }
    pthread_mutex_unlock(&lock);
    return it;
}

/* Give an instance its slave: the one it had, reset, or a new one. The lock is not held here: Python may wait for others. */
static int quicken(Instance *it, fmi2String guid, fmi2Boolean visible)
{
    it->own = it->host, it->own.logger = heard, it->own.componentEnvironment = it;
    it->said = fmi2OK;
    if (it->slave) return begun_anew(it) == fmi2OK;
    char *plain = plain_path(it->resources, &it->link);
    door_before();
    if (plain) it->slave = to.Instantiate(it->name, fmi2CoSimulation, guid ? guid : "", plain, &it->own, visible, 1);
    if (it->slave) it->door = door_of(it->door); /* of none there is nothing to close later */
    free(plain);
    return it->slave != NULL;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String uri,
                                          const fmi2CallbackFunctions *host, fmi2Boolean visible, fmi2Boolean talkative)
{
    char folder[PATH_MAX] = ".", why[2048] = "", content[sizeof ((Instance *)0)->content] = "", own[128];
    char *resources = NULL;
    Instance *it = NULL;
    if (!host) return NULL;
    if (!name || !*name) snprintf(why, sizeof why, "an instance needs a name");
    else if (type != fmi2CoSimulation) snprintf(why, sizeof why, "this FMU is for co-simulation, not for model exchange");
    else if (!here(folder, sizeof folder)) snprintf(why, sizeof why, "cannot tell where this library lies");
    else if (!(resources = find_resources(uri, folder, content, sizeof content)))
        snprintf(why, sizeof why, "no resources of this FMU at %.1500s", uri ? uri : "(null)");
    else if (!meant(resources, guid, own, sizeof own))
        snprintf(why, sizeof why, "the GUID %.200s is not that of this FMU, %s: its modelDescription.xml is of another build",
                 guid ? guid : "(null)", own);
    else if (open_library(folder, why, sizeof why) && (it = taken(resources, content))) {
        free(it->name), free(it->resources);
        it->name = strdup(name), it->resources = resources, resources = NULL;
        it->host = *host, it->talkative = talkative;
        strcpy(it->content, content);
        if (!quicken(it, guid, visible)) {
            discard(it);
            it = NULL;
            snprintf(why, sizeof why, "Python could not make the slave");
        }
    }
    free(resources);
    if (!it) tell(host, name ? name : "", fmi2Error, "logStatusError", why);
    return it;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    Instance *it = c;
    if (!it) return;
    if (!it->dead) door_shut(it->door);
    while (it->count && !it->dead) to.FreeFMUstate(it->slave, &it->states[--it->count]);
    it->host.logger = NULL;
    pthread_mutex_lock(&lock);
    int keep = !it->dead && spare_count < SPARE;
    it->spare = keep;
    spare_count += keep;
    pthread_mutex_unlock(&lock);
    if (keep) return;
    if (!it->dead) to.FreeInstance(it->slave);
    discard(it);
}
