/* A Python interpreter for a process that may not have one.

   In a Python process there is nothing to do. Elsewhere libpython is looked for and opened for all libraries of the
   process: the extension modules of the standard library take their symbols from there. Which one:

     1. what SELFLOCK_PYTHON names, a python executable or a libpython*.so*, and then nothing else
     2. what `python3`, `python`, /usr/bin/python3 or /usr/local/bin/python3 says of itself

   The interpreter is started as that executable would start (its prefix, its virtual environment), without signal
   handlers, and is never ended: other FMUs of the process use it too. */
#define _GNU_SOURCE
#include "python.h"

#include <dlfcn.h>
#include <errno.h>
#include <link.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <wchar.h>

extern char **environ;

static const char *QUESTION =
    "import os, sys, sysconfig as s\n"
    "v = s.get_config_var\n"
    "print('%d.%d' % sys.version_info[:2])\n"
    "print(sys.executable)\n"
    "names = [n for n in (v('INSTSONAME'), v('LDLIBRARY'), 'libpython%d.%d.so.1.0' % sys.version_info[:2]) if n and '.so' in n]\n"
    "folders = [d for d in (v('LIBDIR'), os.path.join(sys.base_prefix, 'lib'), v('LIBPL')) if d]\n"
    "found = [p for d in folders for n in names for p in [os.path.join(d, n)] if os.path.isfile(p)]\n"
    "print(found[0] if found else '')\n";

/* Standard output of `program -c QUESTION`; 0 if it cannot be run or fails. */
static int ask(const char *program, char *answer, size_t size)
{
    int ends[2], status = 0;
    size_t length = 0;
    pid_t child;
    if (pipe(ends)) return 0;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", 1 /* O_WRONLY */, 0);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addclose(&actions, ends[1]);
    char *const arguments[] = {(char *)program, "-c", (char *)QUESTION, NULL};
    int failed = posix_spawnp(&child, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    while (!failed && length + 1 < size) {
        ssize_t got = read(ends[0], answer + length, size - 1 - length);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        length += (size_t)got;
    }
    answer[length] = 0;
    close(ends[0]);
    if (failed) return 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR) return length > 0; /* the host reaps children itself */
    return length > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

static int open_library(const char *path, char *why, size_t size)
{
    if (dlopen(path, RTLD_NOW | RTLD_GLOBAL)) return 1;
    snprintf(why, size, "cannot open %s: %s", path, dlerror());
    return 0;
}

/* Open the libpython of a python executable; its full path goes to `executable`. */
static int open_of(const char *program, char *executable, size_t room, char *why, size_t size)
{
    char answer[8192], *version = answer, *path, *library, *end;
    if (!ask(program, answer, sizeof answer) || !(path = strchr(answer, '\n'))) {
        snprintf(why, size, "%s cannot be run as a Python 3", program);
        return 0;
    }
    *path++ = 0;
    if (!(library = strchr(path, '\n'))) return 0;
    *library++ = 0;
    if ((end = strchr(library, '\n'))) *end = 0;
    int major = 0, minor = 0;
    sscanf(version, "%d.%d", &major, &minor);
    if (major < 3 || (major == 3 && minor < 9)) {
        snprintf(why, size, "%s is Python %s, but 3.9 or newer is needed", path, version);
        return 0;
    }
    if (!*library) {
        snprintf(why, size, "%s has no shared library libpython%s.so (on Debian or Ubuntu: install libpython%s)", path, version,
                 version);
        return 0;
    }
    snprintf(executable, room, "%s", path);
    return open_library(library, why, size);
}

static int open_python(char *executable, size_t room, char *why, size_t size)
{
    static const char *const USUAL[] = {"python3", "python", "/usr/bin/python3", "/usr/local/bin/python3"};
    const char *named = getenv("SELFLOCK_PYTHON");
    char first[1024] = "";
    executable[0] = 0;
    if (named && *named) {
        const char *file = strrchr(named, '/');
        if (strstr(file ? file : named, ".so")) return open_library(named, why, size);
        if (open_of(named, executable, room, first, sizeof first)) return 1;
        snprintf(why, size, "SELFLOCK_PYTHON: %s", first);
        return 0;
    }
    for (size_t i = 0; i < sizeof USUAL / sizeof *USUAL; i++) {
        if (open_of(USUAL[i], executable, room, why, size)) return 1;
        if (i == 0) snprintf(first, sizeof first, "%s", why);
    }
    snprintf(why, size,
             "no Python found for this FMU: %s. Install Python 3.9 or newer with its shared library, or name a python "
             "executable or a libpython in the environment variable SELFLOCK_PYTHON", first);
    return 0;
}

/* libpython may be in the process without its symbols being there for all; then make them so. */
static int promote(struct dl_phdr_info *info, size_t size, void *unused)
{
    (void)size, (void)unused;
    const char *file = info->dlpi_name ? strrchr(info->dlpi_name, '/') : NULL;
    return file && !strncmp(file, "/libpython3.", 12) && dlopen(info->dlpi_name, RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD);
}

static void start(const char *executable)
{
    int (*is_initialized)(void) = (int (*)(void))dlsym(RTLD_DEFAULT, "Py_IsInitialized");
    void (*set_program)(const wchar_t *) = (void (*)(const wchar_t *))dlsym(RTLD_DEFAULT, "Py_SetProgramName");
    wchar_t *(*decode)(const char *, size_t *) = (wchar_t * (*)(const char *, size_t *)) dlsym(RTLD_DEFAULT, "Py_DecodeLocale");
    void (*initialize)(int) = (void (*)(int))dlsym(RTLD_DEFAULT, "Py_InitializeEx");
    void *(*save)(void) = (void *(*)(void))dlsym(RTLD_DEFAULT, "PyEval_SaveThread");
    if (is_initialized() || !initialize || !save) return;
    if (*executable && set_program && decode) set_program(decode(executable, NULL));
    initialize(0);
    save();
}

int python_ready(char *why, size_t size)
{
    char executable[4096] = "";
    int ready = 1;
    flockfile(stderr); /* the one lock that all FMUs of a process share: each has its own copy of this library */
    if (!dlsym(RTLD_DEFAULT, "Py_IsInitialized") && !dl_iterate_phdr(promote, NULL)) {
        ready = open_python(executable, sizeof executable, why, size);
        if (ready) start(executable);
    }
    funlockfile(stderr);
    return ready;
}
