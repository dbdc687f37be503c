/* Instances in threads: usage threads RESOURCES THREADS STEPS. Each thread makes its own instance of either version,
   steps it with its own inputs and saves and restores states on the way; outputs must be those of a serial run to the
   bit. Meant to be run under ThreadSanitizer too. */
#include <pthread.h>

#include "host.h"

#define MOST 1000

typedef struct {
    int number;
    const char *resources;
    long steps;
    uint64_t sum;
} Job;

static void *work(void *argument)
{
    Job *job = argument;
    const Fmu fmu = started(2 + job->number % 2, job->resources, 0.0, NULL);
    uint64_t seed = 88172645463325252u + 7919u * (uint64_t)job->number, sum = (uint64_t)job->number;
    double input[INPUTS], output[OUTPUTS];

    REQUIRE(set_parameter(&fmu, SWITCH, job->number % 3 ? SWITCH_ON : SWITCH_OFF) == 0);
    for (long n = 0; n < job->steps; ++n) {
        random_inputs(&seed, input);
        REQUIRE(set_inputs(&fmu, input) == 0);
        REQUIRE(do_step(&fmu, 1e-3 * (double)n, 1e-3) == 0);
        REQUIRE(get_outputs(&fmu, output) == 0);
        sum = hashed(sum, output, sizeof output);
        if (n % 100 == 0) {
            const uint64_t state = state_hash(&fmu);
            sum = hashed(sum, &state, sizeof state);
        }
    }
    ended(&fmu);
    job->sum = sum;
    return NULL;
}

int main(int argc, char **argv)
{
    static Job serial[MOST], parallel[MOST];
    static pthread_t thread[MOST];
    int count, differ = 0;
    long steps;

    if (argc != 4) {
        return 2;
    }
    count = (int)strtol(argv[2], NULL, 10);
    steps = strtol(argv[3], NULL, 10);
    if (count < 1 || count > MOST || steps < 1) {
        return 2;
    }
    for (int n = 0; n < count; ++n) {
        const Job job = {n, argv[1], steps, 0};
        serial[n] = parallel[n] = job;
        (void)work(&serial[n]);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_create(&thread[n], NULL, work, &parallel[n]) == 0);
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(pthread_join(thread[n], NULL) == 0);
        differ += parallel[n].sum != serial[n].sum;
    }
    (void)printf("%d threads, %ld steps each: %d differ from the serial run\n", count, steps, differ);
    return differ != 0;
}
