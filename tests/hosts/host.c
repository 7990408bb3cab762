/* A host for FMI 2.0 co-simulation that is not Python. It reads commands from standard input and answers each with a line:

     load A FILE                      open an FMU's library
     new i A NAME URI GUID            instantiate                         enter i · exit i · terminate i · reset i · free i
     setup i                          start time 0
     real i VR VALUE                  set (values as strtod reads them)   bool i VR VALUE
     get i VR…                        reals, as exact hexadecimal         getb i VR · geti i VR · gets i VR
     step i T H                       a communication step                steps i T H COUNT VR    many, with a get after each
     save i K · restore i K · drop i K · pack i K    states; pack: to bytes, freed, and back from the bytes
     spoil i K PLACE                  as pack, with another byte at PLACE from the end
     together A URI B URI N GUID GUID two threads at once, each instantiates, makes N steps and frees; answers with both statuses
     cycles A NAME URI N GUID         instantiate and free N times; answers with the growth of resident memory in kB

   What an FMU logs comes as lines that begin with "log ". */
#define _GNU_SOURCE
#include "../../fmus/loader/fmi2.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MANY = 16 };
static void *library[128], *state[MANY];
static fmi2Component component[MANY];
static void *of[MANY];

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String text, ...)
{
    va_list arguments;
    (void)environment;
    printf("log %s %d %s ", name, status, category);
    va_start(arguments, text);
    vprintf(text, arguments);
    va_end(arguments);
    printf("\n");
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static void *function(void *from, const char *name)
{
    void *found = dlsym(from, name);
    if (!found) printf("missing %s\n", name), exit(1);
    return found;
}

static fmi2Component instantiate(void *from, const char *name, const char *uri, const char *guid)
{
    fmi2Component (*make)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean) =
        function(from, "fmi2Instantiate");
    return make(name, fmi2CoSimulation, guid, uri, &callbacks, 0, 0);
}

static void release(void *from, fmi2Component c) { ((void (*)(fmi2Component))function(from, "fmi2FreeInstance"))(c); }

static long resident(void)
{
    long size = 0, pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &size, &pages) != 2) pages = 0;
    if (file) fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

typedef struct {
    void *from;
    const char *uri, *guid;
    int steps;
    fmi2Status worst;
} Work;

static void *life(void *given)
{
    Work *work = given;
    fmi2Component c = instantiate(work->from, "thread", work->uri, work->guid);
    fmi2Status (*step)(fmi2Component, double, double, int) = function(work->from, "fmi2DoStep");
    fmi2Status (*enter)(fmi2Component) = function(work->from, "fmi2EnterInitializationMode");
    fmi2Status (*leave)(fmi2Component) = function(work->from, "fmi2ExitInitializationMode");
    work->worst = c ? enter(c) + leave(c) : fmi2Fatal;
    for (int n = 0; c && n < work->steps; n++) {
        fmi2Status status = step(c, n * 1e-3, 1e-3, 0);
        if (status > work->worst) work->worst = status;
    }
    if (c) release(work->from, c);
    return NULL;
}

int main(void)
{
    char line[8192], *word[64];
    setvbuf(stdout, NULL, _IOLBF, 0);
    while (fgets(line, sizeof line, stdin)) {
        int n = 0;
        for (char *part = strtok(line, "\t\n"); part && n < 64; part = strtok(NULL, "\t\n")) word[n++] = part;
        if (n < 2) continue;
        const char *what = word[0];
        int i = word[1][0] - '0';
        if (!strcmp(what, "load")) {
            library[(int)word[1][0]] = dlopen(word[2], RTLD_NOW | RTLD_LOCAL);
            printf("%s\n", library[(int)word[1][0]] ? "0" : dlerror());
            continue;
        }
        if (!strcmp(what, "cycles")) {
            void *from = library[(int)word[1][0]];
            long before = 0;
            int count = atoi(word[4]), made = 0;
            for (int k = 0; k < count + 100; k++) {
                fmi2Component c = instantiate(from, word[2], word[3], word[5]);
                if (k == 100) before = resident();
                if (c) made++, release(from, c);
            }
            printf("%d %ld\n", made - 100, resident() - before);
            continue;
        }
        if (!strcmp(what, "together")) {
            Work one = {library[(int)word[1][0]], word[2], word[6], atoi(word[5]), 0};
            Work two = {library[(int)word[3][0]], word[4], word[7], atoi(word[5]), 0};
            pthread_t first, second;
            pthread_create(&first, NULL, life, &one);
            pthread_create(&second, NULL, life, &two);
            pthread_join(first, NULL);
            pthread_join(second, NULL);
            printf("%d %d\n", one.worst, two.worst);
            continue;
        }
        if (!strcmp(what, "new")) {
            of[i] = library[(int)word[2][0]];
            component[i] = instantiate(of[i], word[3], word[4], word[5]);
            printf("%s\n", component[i] ? "0" : "null");
            continue;
        }
        fmi2Component c = component[i];
        unsigned vr = n > 2 ? (unsigned)atoi(word[2]) : 0;
        if (!strcmp(what, "free")) {
            release(of[i], c);
            printf("0\n");
        } else if (!strcmp(what, "setup")) {
            fmi2Status (*call)(fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean, fmi2Real) =
                function(of[i], "fmi2SetupExperiment");
            printf("%d\n", call(c, 0, 0.0, 0.0, 0, 0.0));
        } else if (!strcmp(what, "enter") || !strcmp(what, "exit") || !strcmp(what, "terminate") || !strcmp(what, "reset")) {
            const char *name = !strcmp(what, "enter")  ? "fmi2EnterInitializationMode"
                               : !strcmp(what, "exit") ? "fmi2ExitInitializationMode"
                               : what[0] == 't'        ? "fmi2Terminate"
                                                       : "fmi2Reset";
            printf("%d\n", ((fmi2Status(*)(fmi2Component))function(of[i], name))(c));
        } else if (!strcmp(what, "real")) {
            double value = strtod(word[3], NULL);
            fmi2Status (*call)(fmi2Component, const unsigned *, size_t, const double *) = function(of[i], "fmi2SetReal");
            printf("%d\n", call(c, &vr, 1, &value));
        } else if (!strcmp(what, "bool")) {
            int value = atoi(word[3]);
            fmi2Status (*call)(fmi2Component, const unsigned *, size_t, const int *) = function(of[i], "fmi2SetBoolean");
            printf("%d\n", call(c, &vr, 1, &value));
        } else if (!strcmp(what, "gets")) {
            const char *value = "";
            fmi2Status (*call)(fmi2Component, const unsigned *, size_t, const char **) = function(of[i], "fmi2GetString");
            fmi2Status status = call(c, &vr, 1, &value);
            printf("%d %s\n", status, value);
        } else if (!strcmp(what, "getb") || !strcmp(what, "geti")) {
            int value = -1;
            fmi2Status (*call)(fmi2Component, const unsigned *, size_t, int *) =
                function(of[i], what[3] == 'b' ? "fmi2GetBoolean" : "fmi2GetInteger");
            fmi2Status status = call(c, &vr, 1, &value);
            printf("%d %d\n", status, value);
        } else if (!strcmp(what, "get")) {
            unsigned vrs[64];
            double values[64];
            for (int k = 2; k < n; k++) vrs[k - 2] = (unsigned)atoi(word[k]);
            fmi2Status (*call)(fmi2Component, const unsigned *, size_t, double *) = function(of[i], "fmi2GetReal");
            printf("%d", call(c, vrs, (size_t)(n - 2), values));
            for (int k = 0; k < n - 2; k++) printf(" %a", values[k]);
            printf("\n");
        } else if (!strcmp(what, "step")) {
            fmi2Status (*call)(fmi2Component, double, double, int) = function(of[i], "fmi2DoStep");
            printf("%d\n", call(c, strtod(word[2], NULL), strtod(word[3], NULL), 0));
        } else if (!strcmp(what, "steps")) {
            fmi2Status (*call)(fmi2Component, double, double, int) = function(of[i], "fmi2DoStep");
            fmi2Status (*get)(fmi2Component, const unsigned *, size_t, double *) = function(of[i], "fmi2GetReal");
            double h = strtod(word[3], NULL), value, start = strtod(word[2], NULL);
            unsigned seen = (unsigned)atoi(word[5]);
            fmi2Status worst = fmi2OK;
            char *sign = "";
            for (int k = 0; k < atoi(word[4]); k++) {
                fmi2Status status = call(c, start + k * h, h, 0);
                if (status > worst) worst = status;
                get(c, &seen, 1, &value);
                printf("%s%a", sign, value);
                sign = " ";
            }
            printf(" status %d\n", worst);
        } else if (!strcmp(what, "save")) {
            fmi2Status (*call)(fmi2Component, void **) = function(of[i], "fmi2GetFMUstate");
            printf("%d\n", call(c, &state[vr]));
        } else if (!strcmp(what, "restore")) {
            fmi2Status (*call)(fmi2Component, void *) = function(of[i], "fmi2SetFMUstate");
            printf("%d\n", call(c, state[vr]));
        } else if (!strcmp(what, "drop")) {
            fmi2Status (*call)(fmi2Component, void **) = function(of[i], "fmi2FreeFMUstate");
            printf("%d\n", call(c, &state[vr]));
        } else if (!strcmp(what, "pack") || !strcmp(what, "spoil")) {
            size_t size = 0;
            fmi2Status (*measure)(fmi2Component, void *, size_t *) = function(of[i], "fmi2SerializedFMUstateSize");
            fmi2Status (*write)(fmi2Component, void *, char *, size_t) = function(of[i], "fmi2SerializeFMUstate");
            fmi2Status (*drop)(fmi2Component, void **) = function(of[i], "fmi2FreeFMUstate");
            fmi2Status (*read)(fmi2Component, const char *, size_t, void **) = function(of[i], "fmi2DeSerializeFMUstate");
            int status = measure(c, state[vr], &size);
            char *bytes = malloc(size);
            status += write(c, state[vr], bytes, size);
            status += drop(c, &state[vr]);
            if (n > 3) bytes[size - (size_t)atoi(word[3])] ^= 1;
            status += read(c, bytes, size, &state[vr]);
            free(bytes);
            printf("%d\n", status);
        } else {
            printf("unknown command %s\n", what);
        }
    }
    return 0;
}
