/* Instances made, stepped, saved and freed in many threads at once, which share two maps: usage
   threads RESOURCES_1 RESOURCES_2 THREADS ROUNDS. All outputs and states must be those of a serial run to the bit. Meant
   to be run under sanitizers. */
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"
#include "variables.h"

#define OUTPUTS 12
#define MAX_THREADS 64
#define OVERLAP 3 /* instances of a thread that live at the same time */
#define STEPS 20

#define REQUIRE(condition)                                                            \
    do {                                                                              \
        if (!(condition)) {                                                           \
            (void)printf("%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);      \
            exit(1);                                                                  \
        }                                                                             \
    } while (0)

/* xorshift64 of Marsaglia */
static uint64_t next_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static double uniform(uint64_t *state, double lo, double hi)
{
    return lo + (hi - lo) * (double)(next_random(state) >> 11) / 9007199254740992.0;
}

static uint64_t hashed(uint64_t sum, const void *bytes, size_t size)
{
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; ++i) {
        sum = (sum ^ at[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

typedef struct {
    int number;
    char **resources;
    int rounds;
    uint64_t sum;
} Job;

/* An instance, stepped with presliding or without; a plain path is taken as location too. */
static fmi2Component begun(const char *resources, uint64_t *seed, uint64_t *sum)
{
    static const fmi2ValueReference all[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    const fmi2ValueReference presliding = FIRST_REFERENCE + PRESLIDING;
    const fmi2Boolean on = next_random(seed) % 3 != 0;
    fmi2Component fmu = fmi2Instantiate("host", fmi2CoSimulation, MODEL_TOKEN, resources, NULL, 0, 0);
    fmi2FMUstate state = NULL;
    fmi2Byte *bytes;
    size_t size = 0;

    REQUIRE(fmu != NULL);
    REQUIRE(fmi2SetupExperiment(fmu, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
    REQUIRE(fmi2EnterInitializationMode(fmu) == fmi2OK && fmi2ExitInitializationMode(fmu) == fmi2OK);
    REQUIRE(fmi2SetBoolean(fmu, &presliding, 1, &on) == fmi2OK);
    for (int n = 0; n < STEPS; ++n) {
        const double input[INPUT_COUNT] = {uniform(seed, 0.0, 8000.0), uniform(seed, -250.0, 250.0),
                                           uniform(seed, 285.0, 350.0), uniform(seed, -6000.0, 6000.0)};
        double output[OUTPUTS];
        REQUIRE(fmi2SetReal(fmu, all, INPUT_COUNT, input) == fmi2OK);
        REQUIRE(fmi2DoStep(fmu, 1e-3 * n, 1e-3, fmi2True) == fmi2OK);
        REQUIRE(fmi2GetReal(fmu, all + INPUT_COUNT, OUTPUTS, output) == fmi2OK);
        *sum = hashed(*sum, output, sizeof output);
    }
    REQUIRE(fmi2GetFMUstate(fmu, &state) == fmi2OK && fmi2SerializedFMUstateSize(fmu, state, &size) == fmi2OK);
    bytes = malloc(size);
    REQUIRE(bytes != NULL && fmi2SerializeFMUstate(fmu, state, bytes, size) == fmi2OK);
    REQUIRE(fmi2FreeFMUstate(fmu, &state) == fmi2OK);
    *sum = hashed(*sum, bytes, size);
    free(bytes);
    return fmu;
}

static void *work(void *argument)
{
    Job *job = argument;
    uint64_t seed = 88172645463325252u + 7919u * (uint64_t)job->number;
    fmi2Component fmu[OVERLAP] = {NULL};

    job->sum = (uint64_t)job->number;
    for (int round = 0; round < job->rounds; ++round) {
        fmi2FreeInstance(fmu[round % OVERLAP]); /* NULL at first: nothing */
        fmu[round % OVERLAP] = begun(job->resources[next_random(&seed) % 2], &seed, &job->sum);
    }
    for (int n = 0; n < OVERLAP; ++n) {
        fmi2FreeInstance(fmu[n]);
    }
    return NULL;
}

int main(int argc, char **argv)
{
    static Job serial[MAX_THREADS], parallel[MAX_THREADS];
    static pthread_t thread[MAX_THREADS];
    const int count = argc == 5 ? (int)strtol(argv[3], NULL, 10) : 0;

    REQUIRE(count >= 1 && count <= MAX_THREADS);
    for (int n = 0; n < count; ++n) {
        const Job job = {n, argv + 1, (int)strtol(argv[4], NULL, 10), 0};
        serial[n] = parallel[n] = job;
        (void)work(&serial[n]);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_create(&thread[n], NULL, work, &parallel[n]) == 0);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_join(thread[n], NULL) == 0);
        REQUIRE(parallel[n].sum == serial[n].sum);
    }
    (void)printf("all as in a serial run\n");
    return 0;
}
