/* Instances made, stepped and freed in many threads at once, which share two maps: usage
   sharing RESOURCES_1 RESOURCES_2 THREADS ROUNDS. All outputs must be those of a serial run to the bit. Meant to be
   run under ThreadSanitizer and AddressSanitizer. THREADS 1: in the thread of main alone. */
#include <pthread.h>

#include "host.h"

#define MOST 64
#define OVERLAP 3 /* instances of a thread that live at the same time */

typedef struct {
    int number;
    char **resources;
    int rounds;
    uint64_t sum;
} Job;

static uint64_t life(const Fmu *fmu, uint64_t *seed, uint64_t sum)
{
    double input[INPUTS], output[OUTPUTS];

    random_inputs(seed, input);
    REQUIRE(set_inputs(fmu, input) == 0);
    REQUIRE(do_step(fmu, 0.0, 1e-3) == 0);
    REQUIRE(get_outputs(fmu, output) == 0);
    return hashed(sum, output, sizeof output);
}

static void *work(void *argument)
{
    Job *job = argument;
    uint64_t seed = 88172645463325252u + 7919u * (uint64_t)job->number, sum = (uint64_t)job->number;
    Fmu fmu[OVERLAP];

    for (int round = 0; round < job->rounds; ++round) {
        const int place = round % OVERLAP;
        const unsigned which = (unsigned)(next_random(&seed) % 2);
        if (round >= OVERLAP) {
            ended(&fmu[place]);
        }
        fmu[place] = started(2 + round % 2, job->resources[which], 0.0, NULL);
        sum = life(&fmu[place], &seed, sum);
    }
    for (int n = 0; n < OVERLAP && n < job->rounds; ++n) {
        ended(&fmu[n]);
    }
    job->sum = sum;
    return NULL;
}

int main(int argc, char **argv)
{
    static Job serial[MOST], parallel[MOST];
    static pthread_t thread[MOST];
    int count, rounds, differ = 0;

    if (argc != 5) {
        return 2;
    }
    count = (int)strtol(argv[3], NULL, 10);
    rounds = (int)strtol(argv[4], NULL, 10);
    if (count < 1 || count > MOST || rounds < 1) {
        return 2;
    }
    for (int n = 0; n < count; ++n) {
        const Job job = {n, argv + 1, rounds, 0};
        serial[n] = parallel[n] = job;
        (void)work(&serial[n]);
    }
    for (int n = 0; n < count; ++n) {
        if (count == 1) {
            (void)work(&parallel[n]);
        } else {
            REQUIRE(pthread_create(&thread[n], NULL, work, &parallel[n]) == 0);
        }
    }
    for (int n = 0; n < count; ++n) {
        REQUIRE(count == 1 || pthread_join(thread[n], NULL) == 0);
        differ += parallel[n].sum != serial[n].sum;
    }
    (void)printf("%d threads, %d instances each: %d differ from the serial run\n", count, rounds, differ);
    return differ != 0;
}
