/* Loads the library of a native FMU of either FMI version, steps 100 points and prints all outputs as hexadecimal
   doubles: to compare platforms. Usage: host LIBRARY RESOURCES TOKEN; resources as URI for FMI 2, as path for FMI 3.

   Compile with FMI_VERSION and the value references defined: OUTPUTS (a list), FLAG (Boolean), STIFFNESS; inputs are 0
   to 3. All inputs are made by one multiplication and one addition of exact numbers, alike on every platform. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define FUNCTION(library, name) ((void *)GetProcAddress(library, name))
#else
#include <dlfcn.h>
#define FUNCTION(library, name) dlsym(library, name)
#endif

#if FMI_VERSION == 2
#include "fmi2Functions.h"
#define FMI(name) fmi2##name
#define PREFIX "fmi2"
#else
#include "fmi3Functions.h"
#define FMI(name) fmi3##name
#define PREFIX "fmi3"
#endif

#define POINTS 100
#define STEP 0.001
#define INPUTS 4

static const unsigned inputs[INPUTS] = {0, 1, 2, 3}, outputs[] = {OUTPUTS}, flag[] = {FLAG}, stiffness[] = {STIFFNESS};
enum { OUTPUT_COUNT = sizeof outputs / sizeof outputs[0] };

static void check(int good, const char *what)
{
    if (!good) {
        fprintf(stderr, "%s failed\n", what);
        exit(1);
    }
}

#define LOAD(name)                                                \
    FMI(name##TYPE) *name;                                        \
    do {                                                          \
        void *found = FUNCTION(library, PREFIX #name);            \
        check(found != NULL, PREFIX #name ": loading");           \
        memcpy(&name, &found, sizeof found);                      \
    } while (0)
#define CALL(call) check((call) == 0, #call)

#if FMI_VERSION == 2
static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...)
{
    (void)environment, (void)name, (void)category;
    fprintf(stderr, "%d: %s\n", status, message);
}
#else
static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)category;
    fprintf(stderr, "%d: %s\n", status, message);
}
#endif

int main(int count, char **arguments)
{
    void *c;
#ifdef _WIN32
    HMODULE library = count == 4 ? LoadLibraryA(arguments[1]) : NULL;
#else
    void *library = count == 4 ? dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL) : NULL;
#endif
    check(library != NULL, "loading the library");
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(DoStep);
    LOAD(GetBoolean);
    LOAD(Terminate);
    LOAD(FreeInstance);
#if FMI_VERSION == 2
    LOAD(Instantiate);
    LOAD(SetupExperiment);
    LOAD(SetReal);
    LOAD(GetReal);
    const fmi2CallbackFunctions functions = {log_message, calloc, free, NULL, NULL};
    c = Instantiate("one", fmi2CoSimulation, arguments[3], arguments[2], &functions, fmi2False, fmi2False);
    check(c != NULL, "instantiation");
    CALL(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    CALL(EnterInitializationMode(c));
#else
    LOAD(InstantiateCoSimulation);
    LOAD(SetFloat64);
    LOAD(GetFloat64);
    c = InstantiateCoSimulation("one", arguments[3], arguments[2], fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0,
                                NULL, log_message, NULL);
    check(c != NULL, "instantiation");
    CALL(EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0));
#endif
    CALL(ExitInitializationMode(c));
    for (int n = 0; n < POINTS; ++n) {
        /* half of the points slow, for the law at standstill; stiffness of the bristle from the screw in the first half */
        const double speed = n % 2 ? 6.5 * (n - 40) : 0.0625 * (n - 40), wound = n < POINTS / 2 ? 0.0 : 400.0;
        const double in[INPUTS] = {60.0 * n, speed, 280.0 + 0.75 * n, n % 4 == 3 ? 25.0 * (n - 50) : 0.0};
        double out[OUTPUT_COUNT];
#if FMI_VERSION == 2
        fmi2Boolean inside;
        CALL(SetReal(c, inputs, INPUTS, in));
        CALL(SetReal(c, stiffness, 1, &wound));
        CALL(DoStep(c, n * STEP, STEP, fmi2True));
        CALL(GetReal(c, outputs, OUTPUT_COUNT, out));
        CALL(GetBoolean(c, flag, 1, &inside));
#else
        fmi3Boolean inside, event, terminate, early;
        fmi3Float64 last;
        CALL(SetFloat64(c, inputs, INPUTS, in, INPUTS));
        CALL(SetFloat64(c, stiffness, 1, &wound, 1));
        CALL(DoStep(c, n * STEP, STEP, fmi3True, &event, &terminate, &early, &last));
        CALL(GetFloat64(c, outputs, OUTPUT_COUNT, out, OUTPUT_COUNT));
        CALL(GetBoolean(c, flag, 1, &inside, 1));
#endif
        for (int i = 0; i < OUTPUT_COUNT; ++i) {
            uint64_t bits;
            memcpy(&bits, &out[i], sizeof bits);
            printf("%08lx%08lx ", (unsigned long)(bits >> 32), (unsigned long)(bits & 0xffffffffU));
        }
        printf("%d\n", inside ? 1 : 0);
    }
    CALL(Terminate(c));
    FreeInstance(c);
    return 0;
}
