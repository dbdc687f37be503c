/* What the C hosts of the tests share: random numbers, and co-simulation of either FMI version under one interface. */
#ifndef HOST_H
#define HOST_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes"
#endif
#include "fmi3Functions.h"
#ifdef __clang__
#pragma clang diagnostic pop
#endif
#include "variables.h"

#define INPUTS INPUT_COUNT

/* What differs between the models; MONITOR or TRANSMISSION is given to the compiler. OUTPUTS: real ones, which follow the
   inputs.
   SWITCH: a parameter of what is remembered, with a value that takes it away and one that has it. */
#ifdef MONITOR
#define OUTPUTS 4
#define SWITCH SPEED_MIN
#define SWITCH_OFF 0.0
#define SWITCH_ON 20.0
#else
#ifdef TRANSMISSION
#define OUTPUTS 25
#else
#define OUTPUTS 12
#endif
#define SWITCH PRESLIDING
#define SWITCH_OFF 0.0
#define SWITCH_ON 1.0
#endif

#define REQUIRE(condition)                                                            \
    do {                                                                              \
        if (!(condition)) {                                                           \
            (void)printf("%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);      \
            exit(1);                                                                  \
        }                                                                             \
    } while (0)

/* xorshift64 of Marsaglia */
static inline uint64_t next_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static inline double uniform(uint64_t *state, double lo, double hi)
{
    return lo + (hi - lo) * (double)(next_random(state) >> 11) / 9007199254740992.0;
}

#ifdef TRANSMISSION
/* Under loads that part the nuts, at rest, without preload, and beyond the map. */
static inline void random_inputs(uint64_t *state, double input[INPUTS])
{
    const double ratio = model_variables[LEAD].start / 6.283185307179586;
    const unsigned kind = (unsigned)(next_random(state) % 16);

    input[0] = uniform(state, -300.0, 300.0);
    input[1] = kind == 5 ? 0.0 : uniform(state, -250.0, 250.0) * (kind == 7 ? 4e-3 : 1.0);
    input[2] = ratio * input[0] + (kind % 2 ? uniform(state, -8e-6, 8e-6) : 0.0);
    input[3] = ratio * input[1] + (kind % 4 ? uniform(state, -1e-3, 1e-3) : 0.0);
    input[4] = kind == 9 ? 0.0 : uniform(state, 285.0, 350.0);
    input[5] = kind == 3 ? 0.0 : kind == 9 ? 15000.0 : uniform(state, 60.0, 8000.0);
}
#else
/* Within the map, at rest, at its ends and beyond. */
static inline void random_inputs(uint64_t *state, double input[INPUTS])
{
    const unsigned kind = (unsigned)(next_random(state) % 16);
    input[0] = uniform(state, 60.0, 8000.0);
    input[1] = uniform(state, -250.0, 250.0);
    input[2] = uniform(state, 285.0, 350.0);
    input[3] = kind % 2 ? uniform(state, -6000.0, 6000.0) : 0.0;
#ifdef MONITOR
    input[0] = uniform(state, 0.0, 4.0) * (input[1] < 0.0 ? -1.0 : 1.0); /* a torque */
#endif
    if (kind == 3) {
        input[0] = 0.0;
    } else if (kind == 5) {
        input[1] = 0.0;
    } else if (kind == 7) {
        input[1] = uniform(state, -1.0, 1.0);
    } else if (kind == 9) {
        input[0] = 15000.0;
        input[2] = 0.0;
        input[3] = 1e6;
    }
}
#endif

static inline uint64_t hashed(uint64_t sum, const void *bytes, size_t size)
{
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; ++i) {
        sum = (sum ^ at[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

/* --- one instance of either version --- */

typedef struct {
    int version;
    void *instance;
} Fmu;

static const unsigned all_references[] = {1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16,
                                          17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31};

static inline int set_values(const Fmu *fmu, const unsigned references[], size_t count, const double values[])
{
    return fmu->version == 2 ? (int)fmi2SetReal(fmu->instance, references, count, values)
                             : (int)fmi3SetFloat64(fmu->instance, references, count, values, count);
}

static inline int get_values(const Fmu *fmu, const unsigned references[], size_t count, double values[])
{
    return fmu->version == 2 ? (int)fmi2GetReal(fmu->instance, references, count, values)
                             : (int)fmi3GetFloat64(fmu->instance, references, count, values, count);
}

static inline int set_inputs(const Fmu *fmu, const double input[INPUTS])
{
    return set_values(fmu, all_references, INPUTS, input);
}

static inline int get_outputs(const Fmu *fmu, double output[OUTPUTS])
{
    return get_values(fmu, all_references + INPUTS, OUTPUTS, output);
}

static inline int set_parameter(const Fmu *fmu, unsigned index, double value)
{
    const unsigned reference = FIRST_REFERENCE + index;

#ifndef MONITOR
    if (index == PRESLIDING) {
        const fmi2Boolean on_2 = value != 0.0;
        const fmi3Boolean on_3 = value != 0.0;
        return fmu->version == 2 ? (int)fmi2SetBoolean(fmu->instance, &reference, 1, &on_2)
                                 : (int)fmi3SetBoolean(fmu->instance, &reference, 1, &on_3, 1);
    }
#endif
    return set_values(fmu, &reference, 1, &value);
}

static inline int do_step(const Fmu *fmu, double time, double step)
{
    fmi3Boolean event, terminate, early;
    double reached;
    return fmu->version == 2
               ? (int)fmi2DoStep(fmu->instance, time, step, fmi2True)
               : (int)fmi3DoStep(fmu->instance, time, step, true, &event, &terminate, &early, &reached);
}

/* resources: folder; a plain path is taken as FMI 2 location too */
static inline Fmu started(int version, const char *resources, double start, const fmi2CallbackFunctions *functions)
{
    Fmu fmu = {version, NULL};
    if (version == 2) {
        fmu.instance = fmi2Instantiate("host", fmi2CoSimulation, MODEL_TOKEN, resources, functions, 0, 0);
        REQUIRE(fmu.instance != NULL);
        REQUIRE(fmi2SetupExperiment(fmu.instance, 0, 0.0, start, 0, 0.0) == fmi2OK);
        REQUIRE(fmi2EnterInitializationMode(fmu.instance) == fmi2OK);
        REQUIRE(fmi2ExitInitializationMode(fmu.instance) == fmi2OK);
    } else {
        fmu.instance = fmi3InstantiateCoSimulation("host", MODEL_TOKEN, resources, false, false, false, false, NULL, 0,
                                                   NULL, NULL, NULL);
        REQUIRE(fmu.instance != NULL);
        REQUIRE(fmi3EnterInitializationMode(fmu.instance, false, 0.0, start, false, 0.0) == fmi3OK);
        REQUIRE(fmi3ExitInitializationMode(fmu.instance) == fmi3OK);
    }
    return fmu;
}

static inline void ended(const Fmu *fmu)
{
    if (fmu->version == 2) {
        fmi2FreeInstance(fmu->instance);
    } else {
        fmi3FreeInstance(fmu->instance);
    }
}

/* Hash of the serialized state. */
static inline uint64_t state_hash(const Fmu *fmu)
{
    uint64_t sum = UINT64_C(14695981039346656037);
    unsigned char *bytes;
    void *state = NULL;
    size_t size = 0;

    if (fmu->version == 2) {
        REQUIRE(fmi2GetFMUstate(fmu->instance, &state) == fmi2OK);
        REQUIRE(fmi2SerializedFMUstateSize(fmu->instance, state, &size) == fmi2OK);
        bytes = malloc(size);
        REQUIRE(bytes != NULL && fmi2SerializeFMUstate(fmu->instance, state, (fmi2Byte *)bytes, size) == fmi2OK);
        REQUIRE(fmi2FreeFMUstate(fmu->instance, &state) == fmi2OK);
    } else {
        REQUIRE(fmi3GetFMUState(fmu->instance, &state) == fmi3OK);
        REQUIRE(fmi3SerializedFMUStateSize(fmu->instance, state, &size) == fmi3OK);
        bytes = malloc(size);
        REQUIRE(bytes != NULL && fmi3SerializeFMUState(fmu->instance, state, bytes, size) == fmi3OK);
        REQUIRE(fmi3FreeFMUState(fmu->instance, &state) == fmi3OK);
    }
    sum = hashed(sum, bytes, size);
    free(bytes);
    return sum;
}

#endif
