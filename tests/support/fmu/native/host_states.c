/* A host of the native FMU that runs under sanitizers: both kinds through all states, wrong arguments, saved states
   damaged in every byte, states freed by freeInstance. Prints the number of messages; exit code 0 if all results
   are right. argv[1]: folder of the map. Compile with FMI_VERSION 2 or 3. */
#if FMI_VERSION == 2
#include "fmi2Functions.h"
#define FMI(name) fmi2##name
typedef fmi2Component Handle;
typedef fmi2FMUstate State;
typedef fmi2Byte Byte;
#define GET_STATE fmi2GetFMUstate
#define SET_STATE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate
#define STATE_SIZE fmi2SerializedFMUstateSize
#define TO_BYTES fmi2SerializeFMUstate
#define FROM_BYTES fmi2DeSerializeFMUstate
#define GET_REAL(c, vr, n, v) fmi2GetReal(c, vr, n, v)
#define SET_REAL(c, vr, n, v) fmi2SetReal(c, vr, n, v)
#define STEP(c, t, h) fmi2DoStep(c, t, h, 1)
#else
#ifdef __clang__
#pragma clang diagnostic ignored "-Wstrict-prototypes"
#endif
#include "fmi3Functions.h"
#define FMI(name) fmi3##name
typedef fmi3Instance Handle;
typedef fmi3FMUState State;
typedef fmi3Byte Byte;
#define GET_STATE fmi3GetFMUState
#define SET_STATE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState
#define STATE_SIZE fmi3SerializedFMUStateSize
#define TO_BYTES fmi3SerializeFMUState
#define FROM_BYTES fmi3DeserializeFMUState
#define GET_REAL(c, vr, n, v) fmi3GetFloat64(c, vr, n, v, n)
#define SET_REAL(c, vr, n, v) fmi3SetFloat64(c, vr, n, v, n)
#define STEP(c, t, h) fmi3DoStep(c, t, h, true, NULL, NULL, NULL, NULL)
#endif

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "variables.h"

#ifdef MONITOR
#define STATES 0
#else
#define STATES 1
#endif

enum { OK, DISCARD = 2, ERROR = 3 };

static int messages;

static void expect(int found, int expected, const char *what, int line)
{
    if (found != expected) {
        (void)fprintf(stderr, "line %d: %s gave %d, not %d\n", line, what, found, expected);
        exit(1);
    }
}
#define EXPECT(expected, call) expect((int)(call), expected, #call, __LINE__)

#if FMI_VERSION == 2
static void logger(void *environment, const char *name, fmi2Status status, const char *category, const char *message, ...)
{
    (void)environment;
    (void)status;
    messages += strlen(name) > 0 && strlen(category) > 0 && strlen(message) > 0 ? 1 : 1000000;
}

static Handle create(const char *folder, const char *token, bool exchange)
{
    const fmi2CallbackFunctions functions = {logger, calloc, free, NULL, NULL};
    return fmi2Instantiate("host", exchange ? fmi2ModelExchange : fmi2CoSimulation, token, folder, &functions, 0, 1);
}

static int enter_initialization(Handle c)
{
    const fmi2Status status = fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0);
    return (int)(status == fmi2OK ? fmi2EnterInitializationMode(c) : status);
}

static int update(Handle c)
{
    fmi2EventInfo info;
    return (int)fmi2NewDiscreteStates(c, &info);
}
#define RATES fmi2GetDerivatives
#else
static void logger(void *environment, fmi3Status status, const char *category, const char *message)
{
    (void)environment;
    (void)status;
    messages += strlen(category) > 0 && strlen(message) > 0 ? 1 : 1000000;
}

static Handle create(const char *folder, const char *token, bool exchange)
{
    return exchange ? fmi3InstantiateModelExchange("host", token, folder, false, true, NULL, logger)
                    : fmi3InstantiateCoSimulation("host", token, folder, false, true, false, false, NULL, 0, NULL,
                                                  logger, NULL);
}

static int enter_initialization(Handle c)
{
    return (int)fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0);
}

static int update(Handle c)
{
    return (int)fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL);
}
#define RATES fmi3GetContinuousStateDerivatives
#endif

static void set(Handle c, unsigned index, double value, int expected)
{
    const unsigned reference = FIRST_REFERENCE + index;
    EXPECT(expected, SET_REAL(c, &reference, 1, &value));
}

static void read_all(Handle c)
{
    for (unsigned i = 0; i < (unsigned)VARIABLE_COUNT; ++i) {
        const unsigned reference = FIRST_REFERENCE + i;
        double value;
        EXPECT(OK, GET_REAL(c, &reference, 1, &value));
    }
}

/* a stretch of simulation, the time from 0 on */
static void run(Handle c, bool exchange)
{
    for (int i = 0; i < 20; ++i) {
        const double time = 1e-3 * i;
        set(c, SPEED, i % 7 - 3.0, OK);
        set(c, AXIAL_LOAD, 1000.0 * (i % 3), OK);
        if (exchange) {
            double state = 0.0, rate = 0.0, indicators[2];
            EXPECT(OK, FMI(EnterContinuousTimeMode)(c));
            EXPECT(OK, FMI(GetContinuousStates)(c, &state, STATES));
            EXPECT(OK, RATES(c, &rate, STATES));
            state += 1e-3 * rate;
            EXPECT(OK, FMI(SetTime)(c, time));
            EXPECT(OK, FMI(SetContinuousStates)(c, &state, STATES));
            EXPECT(OK, FMI(GetEventIndicators)(c, indicators, 2));
            EXPECT(OK, FMI(CompletedIntegratorStep)(c, 1, NULL, NULL));
            EXPECT(OK, FMI(EnterEventMode)(c));
            EXPECT(OK, update(c));
        } else {
            EXPECT(OK, STEP(c, time, 1e-3));
        }
        read_all(c);
    }
}

static void damage(Handle c, State state)
{
    size_t size;
    Byte *good, *bad;

    EXPECT(OK, STATE_SIZE(c, state, &size));
    good = malloc(size);
    EXPECT(OK, TO_BYTES(c, state, good, size));
    for (size_t i = 0; i < size; ++i) {
        State found = NULL;
        bad = malloc(size); /* exact blocks, so that the sanitizer sees each byte too many */
        memcpy(bad, good, size);
        bad[i] = (Byte)(bad[i] ^ 0x10);
        EXPECT(ERROR, FROM_BYTES(c, bad, size, &found));
        free(bad);
        bad = malloc(i > 0 ? i : 1);
        memcpy(bad, good, i);
        EXPECT(ERROR, FROM_BYTES(c, bad, i, &found));
        free(bad);
        EXPECT(1, found == NULL);
    }
    bad = malloc(size);
    EXPECT(ERROR, TO_BYTES(c, state, bad, size - 1));
    free(bad);
    {
        State found = NULL;
        EXPECT(OK, FROM_BYTES(c, good, size, &found));
        EXPECT(OK, SET_STATE(c, found)); /* not freed here */
    }
    free(good);
}

/* A state with an invalid input is saved, read and discards steps as well. */
static void damage_invalid(Handle c)
{
    State state = NULL;

    EXPECT(OK, GET_STATE(c, &state));
    damage(c, state); /* restores it from its bytes */
    EXPECT(DISCARD, STEP(c, 0.02, 1e-3));
    EXPECT(OK, FREE_STATE(c, &state));
}

static void lifecycle(const char *folder, bool exchange)
{
    Handle c = create(folder, MODEL_TOKEN, exchange), other = create(folder, MODEL_TOKEN, exchange);
    State state = NULL;
    unsigned wrong = 12345;
    double value = 0.0;

    EXPECT(1, c != NULL && other != NULL);
#ifdef MONITOR
    set(c, TORQUE, 0.5, OK);
#else
    set(c, PRESLIDING_STIFFNESS, 400.0, OK);
    set(c, PRELOAD, 0.0, OK);
#endif
    EXPECT(OK, enter_initialization(c));
    read_all(c);
    EXPECT(OK, FMI(ExitInitializationMode)(c));
    EXPECT(OK, GET_STATE(c, &state));
    run(c, exchange);
    damage(c, state);
    run(c, exchange);
    set(c, SPEED, 1e35, exchange ? DISCARD : OK);
    if (!exchange) {
        EXPECT(DISCARD, STEP(c, 0.02, 1e-3));
        damage_invalid(c);
    }
    EXPECT(OK, SET_STATE(c, state));
    run(c, exchange);
    EXPECT(OK, GET_STATE(c, &state));
    EXPECT(OK, FREE_STATE(c, &state));
    EXPECT(OK, FMI(Terminate)(c));
    read_all(c);
    EXPECT(ERROR, GET_REAL(c, &wrong, 1, &value));
    EXPECT(OK, FMI(Reset)(c));
    EXPECT(OK, enter_initialization(c));
    EXPECT(OK, FMI(ExitInitializationMode)(c));
    run(c, exchange);
    EXPECT(ERROR, FMI(ExitInitializationMode)(c));
    EXPECT(OK, GET_STATE(other, &state));
    FMI(FreeInstance)(c);
    EXPECT(OK, enter_initialization(other)); /* has a map of its own */
    read_all(other);
    FMI(FreeInstance)(other); /* and a state that was not freed */
}

int main(int count, char **arguments)
{
    if (count != 2) {
        return 2;
    }
    for (int exchange = 0; exchange < 2; ++exchange) {
        EXPECT(1, create(arguments[1], "another", exchange != 0) == NULL);
        EXPECT(1, create("/no/such/folder", MODEL_TOKEN, exchange != 0) == NULL);
        EXPECT(1, create(NULL, NULL, exchange != 0) == NULL);
        lifecycle(arguments[1], exchange != 0);
    }
    (void)printf("%d messages\n", messages);
    return 0;
}
