/* Does at t = 0.5 s what its parameter `deed` names; y counts steps, and is -1 once what was tried went well for it. */
#define _GNU_SOURCE
#include "../fmi2.h"
#include <arpa/inet.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct { fmi2Real r[2]; char w[2][1000]; int done; } Slave;

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *f,
                                  fmi2Boolean visible, fmi2Boolean logging) { return calloc(1, sizeof(Slave)); }
FMI void fmi2FreeInstance(fmi2Component c) { free(c); }
FMI fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2Reset(fmi2Component c) { memset(c, 0, sizeof(Slave)); return fmi2OK; }
FMI fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) ((Slave *)c)->r[vr[k]] = value[k];
    return fmi2OK;
}
FMI fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t k = 0; k < n; k++) value[k] = ((Slave *)c)->r[vr[k]];
    return fmi2OK;
}
FMI fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
    for (size_t k = 0; k < n; k++) strncpy(((Slave *)c)->w[vr[k]], value[k], 999);
    return fmi2OK;
}

/* To every descriptor that is a socket: the line to the master is among them. */
static void answer(const char *bytes, size_t size) {
    for (int d = 3; d < 256; d++) send(d, bytes, size, MSG_NOSIGNAL);
}

static int does(const char *deed, const char *text) {
    if (!strcmp(deed, "network")) {
        struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(atoi(text))};
        inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
        return !connect(socket(AF_INET, SOCK_STREAM, 0), (struct sockaddr *)&to, sizeof to);
    }
    if (!strcmp(deed, "large")) return !ftruncate(open("large", O_CREAT | O_WRONLY, 0600), 10LL << 30);
    if (!strcmp(deed, "write")) return open(text, O_CREAT | O_WRONLY, 0600) >= 0;
    if (!strcmp(deed, "memory")) for (;;) memset(malloc(16 << 20), 1, 16 << 20);
    if (!strcmp(deed, "hang")) for (;;) ;
    if (!strcmp(deed, "fork")) {
        for (int k = 0; k < 5; k++) if (!fork()) { setsid(); for (;;) sleep(1000); }
        return 0;
    }
    if (!strcmp(deed, "close")) { mkdir("closed", 0); return symlink(text, "elsewhere") != 0; }
    if (!strcmp(deed, "garbage")) { char all[100]; memset(all, 255, 100); answer(all, 100); }
    if (!strcmp(deed, "pickle")) {
        char all[1000] = "\x80\x04" "cos\nsystem\n(V";
        char whole[1004] = {0};
        strcat(all, text); strcat(all, "\ntR.");
        whole[3] = strlen(all); memcpy(whole + 4, all, strlen(all));
        answer(whole, 4 + strlen(all));
    }
    if (!strcmp(deed, "failure")) answer("\0\0\0\1!\0\0\0\7[[[[[[[", 16);
    if (!strcmp(deed, "exit")) exit(3);
    if (!strcmp(deed, "crash")) *(volatile int *)0 = 0;
    return 0;
}
FMI fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) {
    Slave *s = c;
    if (t >= 0.45 && !s->done++ && does(s->w[0], s->w[1])) s->r[1] = -100;
    else s->r[1]++;
    return fmi2OK;
}
