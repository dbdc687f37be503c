/* Loads the library of an FMU on another platform and steps it. Reads host.in in its folder: a line each for library,
   location of the resources and token, then numbers of inputs, outputs and rows, value references, step [s], inputs by
   rows. Writes outputs by rows to host.out, messages to host.log. Windows has all functions used, so that there is no C
   library to compile. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#define OPEN(path) LoadLibraryA(path)
#define FUNCTION(library, name) GetProcAddress(library, name)
typedef HMODULE Library;
typedef FARPROC Function;
#define main start /* the compiler calls a C library in main */
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FUNCTION(library, name) dlsym(library, name)
typedef void *Library, *Function;
#endif

enum { MOST = 200, PATH = 1000 };

static void say(const char *text)
{
    FILE *log = fopen("host.log", "ab");
    fwrite(text, 1, strlen(text), log);
    fwrite("\n", 1, 1, log);
    fclose(log);
}

static void check(int good, const char *what)
{
    if (!good) {
        say(what);
        exit(1);
    }
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...)
{
    (void)environment, (void)name, (void)status, (void)category;
    say(message);
}

static void line(FILE *in, char *text)
{
    check(fgets(text, PATH, in) != NULL, "no line");
    text[strcspn(text, "\n")] = '\0';
}

#define LOAD(name)                                                    \
    fmi2##name##TYPE *name;                                           \
    do {                                                              \
        const Function found = FUNCTION(library, "fmi2" #name);       \
        check(found != NULL, #name " not found");                     \
        memcpy(&name, &found, sizeof name);                           \
    } while (0)
#define CALL(call) check((call) == fmi2OK, #call)
#define READ(to, count) check(fread(to, sizeof *(to), (size_t)(count), in) == (size_t)(count), "host.in is short")

int main(void)
{
    static const fmi2CallbackFunctions functions = {log_message, NULL, NULL, NULL, NULL};
    static char path[PATH], resources[PATH], token[PATH];
    static fmi2ValueReference inputs[MOST], outputs[MOST];
    static double values[MOST], found[MOST];
    FILE *in = fopen("host.in", "rb"), *out = fopen("host.out", "wb");
    int counts[3];
    double step;
    Library library;
    fmi2Component c;

    line(in, path);
    line(in, resources);
    line(in, token);
    READ(counts, 3);
    READ(inputs, counts[0]);
    READ(outputs, counts[1]);
    READ(&step, 1);
    library = OPEN(path);
    check(library != NULL, "library not loaded");
    LOAD(Instantiate);
    LOAD(SetupExperiment);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(SetReal);
    LOAD(GetReal);
    LOAD(DoStep);
    LOAD(FreeInstance);
    c = Instantiate("one", fmi2CoSimulation, token, resources, &functions, fmi2False, fmi2False);
    check(c != NULL, "no instance");
    CALL(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    CALL(EnterInitializationMode(c));
    CALL(ExitInitializationMode(c));
    for (int n = 0; n < counts[2]; ++n) {
        READ(values, counts[0]);
        CALL(SetReal(c, inputs, (size_t)counts[0], values));
        CALL(DoStep(c, n * step, step, fmi2True));
        CALL(GetReal(c, outputs, (size_t)counts[1], found));
        fwrite(found, sizeof *found, (size_t)counts[1], out);
    }
    FreeInstance(c);
    fclose(out);
    exit(0);
}
