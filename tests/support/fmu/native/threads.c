/* Instances made, stepped and freed in many threads at once, which share two maps: usage
   threads RESOURCES_1 RESOURCES_2 THREADS ROUNDS. All outputs must be those of a serial run to the bit. Meant
   to be run under sanitizers. */
#include <math.h>
#include <pthread.h>
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

typedef struct {
    int number;
    char **resources;
    int rounds;
    double sum; /* of all outputs */
} Job;

/* An instance, stepped with presliding or without; a plain path is taken as location too. */
static fmi2Component begun(Job *job, int round)
{
    static const fmi2ValueReference all[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    const fmi2ValueReference presliding = FIRST_REFERENCE + PRESLIDING;
    const int kind = job->number + round;
    const fmi2Boolean on = kind % 3 != 0;
    fmi2Component fmu =
        fmi2Instantiate("host", fmi2CoSimulation, TOKEN, job->resources[kind / 2 % 2], NULL, 0, 0);

    REQUIRE(fmu != NULL);
    REQUIRE(fmi2SetupExperiment(fmu, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
    REQUIRE(fmi2EnterInitializationMode(fmu) == fmi2OK && fmi2ExitInitializationMode(fmu) == fmi2OK);
    REQUIRE(fmi2SetBoolean(fmu, &presliding, 1, &on) == fmi2OK);
    for (int n = 0; n < STEPS; ++n) {
        const double x = sin(1.0 + n + 0.7 * kind), y = cos(2.0 * n + kind);
        const double input[INPUT_COUNT] = {4000.0 + 4000.0 * x, 250.0 * y, 318.0 + 32.0 * x * y, 6000.0 * (x - y)};
        double output[OUTPUTS];
        REQUIRE(fmi2SetReal(fmu, all, INPUT_COUNT, input) == fmi2OK);
        REQUIRE(fmi2DoStep(fmu, 1e-3 * n, 1e-3, fmi2True) == fmi2OK);
        REQUIRE(fmi2GetReal(fmu, all + INPUT_COUNT, OUTPUTS, output) == fmi2OK);
        for (int i = 0; i < OUTPUTS; ++i) {
            job->sum += output[i];
        }
    }
    return fmu;
}

static void *work(void *argument)
{
    Job *job = argument;
    fmi2Component fmu[OVERLAP] = {NULL};

    for (int round = 0; round < job->rounds; ++round) {
        fmi2FreeInstance(fmu[round % OVERLAP]); /* NULL at first: nothing */
        fmu[round % OVERLAP] = begun(job, round);
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
        const Job job = {n, argv + 1, (int)strtol(argv[4], NULL, 10), 0.0};
        serial[n] = parallel[n] = job;
        (void)work(&serial[n]);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_create(&thread[n], NULL, work, &parallel[n]) == 0);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_join(thread[n], NULL) == 0);
        REQUIRE(parallel[n].sum == serial[n].sum && serial[n].sum != 0.0);
    }
    (void)printf("all as in a serial run\n");
    return 0;
}
