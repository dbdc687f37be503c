/* Instances made, stepped and freed in eight threads at once, which share two maps: threads RESOURCES_1 RESOURCES_2.
   Their outputs are those of a serial run to the bit. Meant to be run under the thread sanitizer. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"
#include "variables.h"

enum { THREADS = 8, ROUNDS = 60, STEPS = 20 };

typedef struct {
    int number;
    char **resources;
    double sum; /* of all torques */
} Job;

static void require(int good)
{
    if (!good) {
        (void)printf("a call fails\n");
        exit(1);
    }
}

static void *work(void *argument)
{
    static const fmi2ValueReference all[] = {1, 2, 3, 4, 5, 6};
    Job *job = argument;
    fmi2Component fmu[2] = {NULL, NULL}; /* that live at the same time */

    for (int round = 0; round < ROUNDS; ++round) {
        const int kind = job->number + round;
        fmi2Component *one = &fmu[round % 2];
        fmi2FreeInstance(*one); /* NULL at first: nothing */
        *one = fmi2Instantiate("host", fmi2CoSimulation, TOKEN, job->resources[kind / 2 % 2], NULL, 0, 0);
        require(*one != NULL && fmi2SetupExperiment(*one, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
        require(fmi2EnterInitializationMode(*one) == fmi2OK && fmi2ExitInitializationMode(*one) == fmi2OK);
        for (int n = 0; n < STEPS; ++n) {
            const double x = sin(1.0 + n + 0.7 * kind), y = cos(2.0 * n + kind);
            const double input[INPUT_COUNT] = {4000.0 + 4000.0 * x, 250.0 * y, 318.0 + 32.0 * x * y, 6000.0 * (x - y), 5.0 * y};
            double torque = 0.0;
            require(fmi2SetReal(*one, all, INPUT_COUNT, input) == fmi2OK);
            require(fmi2DoStep(*one, 1e-3 * n, 1e-3, fmi2True) == fmi2OK);
            require(fmi2GetReal(*one, all + INPUT_COUNT, 1, &torque) == fmi2OK);
            job->sum += torque;
        }
    }
    fmi2FreeInstance(fmu[0]);
    fmi2FreeInstance(fmu[1]);
    return NULL;
}

int main(int argc, char **argv)
{
    Job serial[THREADS], parallel[THREADS];
    pthread_t thread[THREADS];

    require(argc == 3);
    for (int n = 0; n < THREADS; ++n) {
        const Job job = {n, argv + 1, 0.0};
        serial[n] = parallel[n] = job;
        (void)work(&serial[n]);
    }
    for (int n = 0; n < THREADS; ++n) {
        require(pthread_create(&thread[n], NULL, work, &parallel[n]) == 0);
    }
    for (int n = 0; n < THREADS; ++n) {
        require(pthread_join(thread[n], NULL) == 0);
        require(parallel[n].sum == serial[n].sum && serial[n].sum != 0.0);
    }
    return 0;
}
