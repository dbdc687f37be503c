/* Instances made, stepped, saved and freed in many threads at once, which share two maps: usage
   threads RESOURCES_1 RESOURCES_2 THREADS ROUNDS. All outputs and states must be those of a serial run to the bit. Meant
   to be run under sanitizers. */
#include <pthread.h>

#include "host.h"

#define MAX_THREADS 64
#define OVERLAP 3 /* instances of a thread that live at the same time */
#define STEPS 20

typedef struct {
    int number;
    char **resources;
    int rounds;
    uint64_t sum;
} Job;

static uint64_t life(const Fmu *fmu, uint64_t *seed, uint64_t sum)
{
    double input[INPUTS], output[OUTPUTS];
    uint64_t state;

    REQUIRE(set_parameter(fmu, SWITCH, next_random(seed) % 3 ? SWITCH_ON : SWITCH_OFF) == 0);
    for (int n = 0; n < STEPS; ++n) {
        random_inputs(seed, input);
        REQUIRE(set_inputs(fmu, input) == 0);
        REQUIRE(do_step(fmu, 1e-3 * n, 1e-3) == 0);
        REQUIRE(get_outputs(fmu, output) == 0);
        sum = hashed(sum, output, sizeof output);
    }
    state = state_hash(fmu);
    return hashed(sum, &state, sizeof state);
}

static void *work(void *argument)
{
    Job *job = argument;
    uint64_t seed = 88172645463325252u + 7919u * (uint64_t)job->number, sum = (uint64_t)job->number;
    Fmu fmu[OVERLAP];

    for (int round = 0; round < job->rounds; ++round) {
        const int place = round % OVERLAP;
        if (round >= OVERLAP) {
            ended(&fmu[place]);
        }
        fmu[place] = started(2 + round % 2, job->resources[next_random(&seed) % 2], 0.0, NULL);
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
