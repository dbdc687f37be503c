/* Random calls of all functions of both FMI versions, in legal and illegal orders, with good and bad arguments, and
   serialized states with damaged fields: usage walk RESOURCES CALLS. For sanitizers. It checks
   that every status is valid, that an error state lasts until reset or restored, that values read are finite, and that
   every function was called and succeeded where it can. */
#include <float.h>
#include <math.h>

#include "host.h"

#define MOST_STATES 8
#define ROOM 16384
#define LINES 600

static uint64_t seed = 88172645463325252u;
static long succeeded[LINES], called[LINES]; /* by line of the call */
static const char *names[LINES];

static unsigned choose(unsigned count)
{
    return (unsigned)(next_random(&seed) % count);
}

static double any_number(void)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e30, -1e300, -1.0, 0.0, 5e-324, 1e29, DBL_MAX};
    return choose(8) == 0 ? odd[choose(sizeof odd / sizeof odd[0])] : uniform(&seed, 0.0, 400.0);
}

/* Arguments of a call, mostly valid. */
typedef struct {
    unsigned reference[64];
    double number[64], result[64];
    size_t count;
    unsigned *references;
    double *numbers, *results;
} Values;

static void make_values(Values *v, unsigned first, unsigned many)
{
    v->count = choose(16) == 0 ? choose(60) : choose(4);
    for (int i = 0; i < 64; ++i) {
        v->reference[i] = FIRST_REFERENCE + first + choose(many);
        v->number[i] = any_number();
        v->result[i] = 0.0;
        if (choose(200) == 0) {
            v->reference[i] = choose(2) ? (unsigned)next_random(&seed) : 0;
        }
    }
    v->references = choose(100) ? v->reference : NULL;
    v->numbers = choose(100) ? v->number : NULL;
    v->results = choose(100) ? v->result : NULL;
}

/* Whether an importer can have set it to NaN: co-simulation stores what it cannot use and discards steps. */
static int is_as_set(unsigned reference)
{
    const unsigned index = reference - FIRST_REFERENCE;
    const enum Causality causality = index < VARIABLE_COUNT ? model_variables[index].causality : CAUSALITY_OUTPUT;

    return causality == CAUSALITY_INPUT || causality == CAUSALITY_PARAMETER || causality == CAUSALITY_STATE;
}

static void check_finite(const Values *v, int co_simulation)
{
    for (size_t i = 0; i < v->count; ++i) {
        if (!isfinite(v->result[i]) && !(co_simulation && is_as_set(v->reference[i]))) {
            (void)printf("value reference %u is %g\n", v->reference[i], v->result[i]);
            exit(1);
        }
    }
}

/* One instance and what the importer holds of it. */
typedef struct {
    void *instance;
    int version, co_simulation, event_mode;
    int failed; /* the last status was an error, without reset or restore since */
    void *state[MOST_STATES];
    unsigned char bytes[ROOM];
    size_t size;
    double time;
} World;

static int record(World *w, int line, const char *name, int status)
{
    names[line] = name;
    ++called[line];
    succeeded[line] += status <= 1;
    REQUIRE(status >= 0 && status <= 3); /* never fatal, never pending */
    w->failed = w->failed || status == 3;
    return status;
}

#define DO(name, arguments) status = record(w, __LINE__, #name, (int)name arguments)

static double any_step(void)
{
    return choose(20) ? 1e-3 : any_number();
}

/* --- serialized states --- */

static void seal(unsigned char *bytes, size_t size)
{
    const uint64_t sum = hashed(UINT64_C(14695981039346656037), bytes + 16, size - 16);
    for (int i = 0; i < 8; ++i) {
        bytes[8 + i] = (unsigned char)(sum >> 8 * i);
    }
}

/* Another eight bytes somewhere; the checksum right again, so that the reader looks further. */
static void damage(unsigned char *bytes, size_t size)
{
    static const uint64_t odd[] = {0, UINT64_MAX, 1, UINT64_C(0x7FF8000000000000), UINT64_C(0x7FF0000000000000),
                                   UINT64_C(0xFFF0000000000000), UINT64_C(0x46293E5939A08CEA)}; /* nan, inf, 1e30 */
    const size_t at = 16 + choose((unsigned)(size - 24));
    const uint64_t bits = choose(2) ? odd[choose(sizeof odd / sizeof odd[0])] : next_random(&seed);
    const int width = choose(2) ? 8 : 4;

    for (int i = 0; i < width; ++i) {
        bytes[at + (size_t)i] = (unsigned char)(bits >> 8 * i);
    }
    seal(bytes, size);
}

/* --- life of an instance --- */

static const char *resources;
static const fmi2CallbackFunctions functions = {NULL, calloc, free, NULL, NULL};

static void silent(const fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment, (void)name, (void)status;
    REQUIRE(strlen(category) > 0 && strlen(message) > 0);
}

static void silent_3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)status;
    REQUIRE(strlen(category) > 0 && strlen(message) > 0);
}

/* Random inputs and outputs within a step, some illegal calls, requests of early return. environment: the world. */
static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean settable, fmi3Boolean gettable,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *requested, fmi3Float64 *return_time)
{
    World *w = environment;
    Values v;
    fmi3Boolean truth[1];
    const unsigned in_range = FIRST_REFERENCE + IN_RANGE;

    REQUIRE(isfinite(time) && gettable && finished && (settable || !may_return));
    make_values(&v, FIRST_OUTPUT, OUTPUTS);
    if (v.references != NULL && v.results != NULL
        && fmi3GetFloat64(w->instance, v.references, v.count, v.results, v.count) == fmi3OK) {
        check_finite(&v, 1);
    }
    (void)fmi3GetBoolean(w->instance, &in_range, 1, truth, 1);
    make_values(&v, 0, INPUTS);
    (void)fmi3SetFloat64(w->instance, v.references, v.count, v.numbers, v.count);
    if (choose(200) == 0) {
        REQUIRE(fmi3Terminate(w->instance) == fmi3Error);
    }
    *requested = choose(4) == 0;
    *return_time = choose(2) ? time + 1e-5 : any_number();
}

static void make(World *w)
{
    static const fmi2CallbackFunctions talking = {silent, calloc, free, NULL, NULL};

    memset(w->state, 0, sizeof w->state);
    w->failed = 0;
    w->time = 0.0;
    w->co_simulation = (int)choose(2);
    w->event_mode = 0;
    if (w->version == 2) {
        w->instance = fmi2Instantiate("walk", w->co_simulation ? fmi2CoSimulation : fmi2ModelExchange, MODEL_TOKEN,
                                      resources, choose(2) ? &talking : &functions, 0, choose(2) ? 1 : 0);
    } else if (w->co_simulation) {
        w->event_mode = MODEL_PARTS && choose(2);
        w->instance = fmi3InstantiateCoSimulation("walk", MODEL_TOKEN, resources, false, true, w->event_mode == 1,
                                                  choose(2) == 1, NULL, 0, w, silent_3, choose(2) ? update : NULL);
    } else {
        w->instance = fmi3InstantiateModelExchange("walk", MODEL_TOKEN, resources, false, true, NULL, silent_3);
    }
    REQUIRE(w->instance != NULL);
}

static void end(World *w)
{
    if (w->version == 2) {
        fmi2FreeInstance(w->instance); /* frees the states that are held, too */
    } else {
        fmi3FreeInstance(w->instance);
    }
}

/* --- random calls --- */

#define VR v.references, v.count
#define READ(call)                              \
    do {                                        \
        call;                                   \
        if (status <= 1 && v.results != NULL) { \
            check_finite(&v, w->co_simulation); \
        }                                       \
    } while (0)
#define COUNTS (choose(50) ? v.count : v.count + 1)

static void call_2(World *w)
{
    fmi2Component c = w->instance;
    Values v, k;
    int number[64], status = 0, flag = 0, other = 0;
    fmi2EventInfo info;
    fmi2Status found;
    const char *text[64] = {NULL};
    const unsigned slot = choose(MOST_STATES);
    fmi2FMUstate state = w->state[slot];
    double x = any_number();

    memset(number, 0, sizeof number);
    make_values(&v, choose(3) ? 0 : FIRST_LOCAL, choose(3) ? INPUTS : VARIABLE_COUNT);
    make_values(&k, choose(3) ? FIRST_OUTPUT : 0, choose(3) ? OUTPUTS : VARIABLE_COUNT + 1);
    if (v.count == 0) { /* reads what is not written */
        v.results = NULL;
    }
    switch (choose(46)) {
    case 0: DO(fmi2SetDebugLogging, (c, (fmi2Boolean)choose(2), choose(9) ? 0 : 1, text)); break;
    case 1: DO(fmi2SetupExperiment, (c, 0, 0.0, choose(9) ? 0.0 : x, choose(9) == 0, x)); break;
    case 2: case 3: DO(fmi2EnterInitializationMode, (c)); break;
    case 4: case 5: DO(fmi2ExitInitializationMode, (c)); break;
    case 6: if (choose(20) == 0) { DO(fmi2Terminate, (c)); } break;
    case 7: if (choose(4) == 0) { DO(fmi2Reset, (c)); w->failed = 0; } break;
    case 8: case 9: make_values(&v, FIRST_OUTPUT, OUTPUTS); READ(DO(fmi2GetReal, (c, VR, v.results))); break;
    case 10: case 11: case 12: DO(fmi2SetReal, (c, VR, v.numbers)); break;
    case 13: READ(DO(fmi2GetReal, (c, VR, v.results))); break;
    case 14: v.reference[0] = FIRST_REFERENCE + IN_RANGE; DO(fmi2GetBoolean, (c, v.reference, choose(2), number)); break;
    case 15: if (!choose(9)) { DO(fmi2SetBoolean, (c, v.reference, choose(2), number)); } break;
    case 16: if (!choose(9)) { DO(fmi2GetInteger, (c, v.reference, choose(2), number)); } break;
    case 17: if (!choose(9)) { DO(fmi2SetInteger, (c, v.reference, choose(2), number)); } break;
    case 18: if (!choose(9)) { DO(fmi2GetString, (c, v.reference, choose(2), text)); } break;
    case 19: if (!choose(9)) { DO(fmi2SetString, (c, v.reference, choose(2), text)); } break;
    case 20: if (DERIVATIVES || !choose(9)) { DO(fmi2GetDirectionalDerivative, (c, k.references, k.count, VR, v.numbers, k.results)); } break;
    case 21: case 22: DO(fmi2GetFMUstate, (c, choose(100) ? &w->state[slot] : NULL)); break;
    case 23: DO(fmi2SetFMUstate, (c, state)); w->failed = w->failed && status != 0; break;
    case 24: DO(fmi2FreeFMUstate, (c, &w->state[slot])); break;
    case 25: DO(fmi2SerializedFMUstateSize, (c, state, &w->size)); break;
    case 26: w->size = w->size % ROOM; DO(fmi2SerializeFMUstate, (c, state, (fmi2Byte *)w->bytes, w->size)); break;
    case 27: case 28:
        if (w->size > 24 && choose(3)) {
            damage(w->bytes, w->size);
        }
        if (w->state[slot] == NULL) {
            DO(fmi2DeSerializeFMUstate, (c, (fmi2Byte *)w->bytes, w->size, &w->state[slot]));
        }
        break;
    case 29: DO(fmi2EnterEventMode, (c)); break;
    case 30: DO(fmi2NewDiscreteStates, (c, choose(50) ? &info : NULL)); break;
    case 31: DO(fmi2EnterContinuousTimeMode, (c)); break;
    case 32: DO(fmi2CompletedIntegratorStep, (c, 1, &flag, choose(9) ? &other : NULL)); break;
    case 33: DO(fmi2SetTime, (c, x)); break;
    case 34: x = choose(3) ? 1e-6 * x : x; DO(fmi2SetContinuousStates, (c, &x, choose(50) ? STATES : 2)); break;
    case 35: DO(fmi2GetDerivatives, (c, v.result, choose(50) ? STATES : 2)); break;
    case 36: DO(fmi2GetEventIndicators, (c, v.result, choose(50) ? 2 : 1)); break;
    case 37: DO(fmi2GetContinuousStates, (c, v.result, choose(50) ? STATES : 3)); break;
    case 38: DO(fmi2GetNominalsOfContinuousStates, (c, choose(50) ? v.result : NULL, STATES)); break;
    case 39: if (!choose(9)) { DO(fmi2SetRealInputDerivatives, (c, VR, number, v.numbers)); } break;
    case 40: if (!choose(9)) { DO(fmi2GetRealOutputDerivatives, (c, VR, number, v.results)); } break;
    case 41: case 42: case 43:
        DO(fmi2DoStep, (c, choose(50) ? w->time : x, any_step(), 1));
        w->time += status <= 1 ? 1e-3 : 0.0;
        break;
    case 44: if (!choose(9)) { DO(fmi2CancelStep, (c)); } break;
    default:
        switch (choose(5)) {
        case 0: DO(fmi2GetStatus, (c, (fmi2StatusKind)choose(4), &found)); break;
        case 1: DO(fmi2GetRealStatus, (c, (fmi2StatusKind)choose(4), choose(9) ? &x : NULL)); break;
        case 2: DO(fmi2GetIntegerStatus, (c, (fmi2StatusKind)choose(4), number)); break;
        case 3: DO(fmi2GetBooleanStatus, (c, (fmi2StatusKind)choose(4), number)); break;
        default: DO(fmi2GetStringStatus, (c, (fmi2StatusKind)choose(4), text)); break;
        }
    }
    if (w->failed) {
        REQUIRE(fmi2DoStep(c, w->time, 1e-3, 1) == fmi2Error && fmi2SetReal(c, v.reference, 0, v.number) == fmi2Error);
    }
}

#define NUMBERS_3(type, ctype)                                                                       \
    do {                                                                                             \
        ctype array[4] = {0};                                                                        \
        if (choose(2)) {                                                                             \
            DO(fmi3Get##type, (c, v.reference, choose(2), array, choose(9) ? 0 : 1));                \
        } else {                                                                                     \
            DO(fmi3Set##type, (c, v.reference, choose(2), array, choose(9) ? 0 : 1));                \
        }                                                                                            \
    } while (0)

static void without_variables(World *w)
{
    fmi3Instance c = w->instance;
    Values v;
    int status;
    size_t sizes[4] = {0};
    const fmi3Byte *binary[4] = {NULL};
    fmi3Clock clock[4] = {false};
    double number[4] = {0.0};
    fmi3IntervalQualifier qualifier[4] = {fmi3IntervalNotYetKnown};
    fmi3UInt64 counter[4] = {0}, resolution[4] = {1};
    fmi3DependencyKind kind[4];
    unsigned n;

    make_values(&v, 0, VARIABLE_COUNT);
    n = choose(3) ? 0 : 1;
    switch (choose(29)) {
    case 0: NUMBERS_3(Float32, fmi3Float32); break;
    case 1: NUMBERS_3(Int8, fmi3Int8); break;
    case 2: NUMBERS_3(UInt8, fmi3UInt8); break;
    case 3: NUMBERS_3(Int16, fmi3Int16); break;
    case 4: NUMBERS_3(UInt16, fmi3UInt16); break;
    case 5: NUMBERS_3(Int32, fmi3Int32); break;
    case 6: NUMBERS_3(UInt32, fmi3UInt32); break;
    case 7: NUMBERS_3(Int64, fmi3Int64); break;
    case 8: NUMBERS_3(UInt64, fmi3UInt64); break;
    case 9: NUMBERS_3(String, fmi3String); break;
    case 10: DO(fmi3GetBinary, (c, v.reference, n, sizes, binary, n)); break;
    case 11: DO(fmi3SetBinary, (c, v.reference, n, sizes, binary, n)); break;
    case 12: DO(fmi3GetClock, (c, v.reference, n, clock)); break;
    case 13: DO(fmi3SetClock, (c, v.reference, n, clock)); break;
    case 14: DO(fmi3GetIntervalDecimal, (c, v.reference, n, number, qualifier)); break;
    case 15: DO(fmi3GetIntervalFraction, (c, v.reference, n, counter, resolution, qualifier)); break;
    case 16: DO(fmi3GetShiftDecimal, (c, v.reference, n, number)); break;
    case 17: DO(fmi3GetShiftFraction, (c, v.reference, n, counter, resolution)); break;
    case 18: DO(fmi3SetIntervalDecimal, (c, v.reference, n, number)); break;
    case 19: DO(fmi3SetIntervalFraction, (c, v.reference, n, counter, resolution)); break;
    case 20: DO(fmi3SetShiftDecimal, (c, v.reference, n, number)); break;
    case 21: DO(fmi3SetShiftFraction, (c, v.reference, n, counter, resolution)); break;
    case 22: DO(fmi3EvaluateDiscreteStates, (c)); break;
    case 23: DO(fmi3GetNumberOfVariableDependencies, (c, 4, sizes)); break;
    case 24: DO(fmi3GetVariableDependencies, (c, 4, sizes, v.reference, sizes, kind, 1)); break;
    case 25: DO(fmi3EnterConfigurationMode, (c)); break;
    case 26: DO(fmi3ExitConfigurationMode, (c)); break;
    case 27: DO(fmi3ActivateModelPartition, (c, 0, 0.0)); break;
    default: DO(fmi3GetOutputDerivatives, (c, v.reference, n, (fmi3Int32 *)sizes, number, n)); break;
    }
    (void)status;
}

static void call_3(World *w)
{
    fmi3Instance c = w->instance;
    Values v, k;
    int status = 0;
    fmi3Boolean flag[5], truth[64] = {false};
    const char *text[1] = {NULL};
    const unsigned slot = choose(MOST_STATES);
    fmi3FMUState state = w->state[slot];
    double x = any_number();
    size_t size;

    make_values(&v, choose(3) ? 0 : FIRST_LOCAL, choose(3) ? INPUTS : VARIABLE_COUNT + 1);
    make_values(&k, choose(3) ? FIRST_OUTPUT : 0, choose(3) ? OUTPUTS : VARIABLE_COUNT + 1);
    if (v.count == 0) {
        v.results = NULL;
    }
    switch (choose(40)) {
    case 0: DO(fmi3SetDebugLogging, (c, choose(2) == 0, choose(9) ? 0 : 1, text)); break;
    case 1: case 2: case 3:
        DO(fmi3EnterInitializationMode, (c, false, 0.0, choose(9) ? 0.0 : x, choose(9) == 0, x));
        break;
    case 4: case 5: DO(fmi3ExitInitializationMode, (c)); break;
    case 6: if (choose(20) == 0) { DO(fmi3Terminate, (c)); } break;
    case 7: if (choose(4) == 0) { DO(fmi3Reset, (c)); w->failed = 0; } break;
    case 8: case 9:
        make_values(&v, FIRST_OUTPUT, OUTPUTS);
        READ(DO(fmi3GetFloat64, (c, VR, v.results, COUNTS)));
        break;
    case 10: case 11: case 12: DO(fmi3SetFloat64, (c, VR, v.numbers, COUNTS)); break;
    case 13: READ(DO(fmi3GetFloat64, (c, VR, v.results, COUNTS))); break;
    case 14: v.reference[0] = FIRST_REFERENCE + IN_RANGE; DO(fmi3GetBoolean, (c, v.reference, 1, truth, choose(9) ? 1 : 0)); break;
    case 15: if (!choose(9)) { DO(fmi3SetBoolean, (c, v.reference, choose(2), truth, choose(2))); } break;
    case 16: case 17: if (!choose(4)) { without_variables(w); } break;
    case 18: if (DERIVATIVES || !choose(9)) { DO(fmi3GetDirectionalDerivative, (c, k.references, k.count, VR, v.numbers, COUNTS, k.results, k.count)); } break;
    case 19: if (DERIVATIVES || !choose(9)) { DO(fmi3GetAdjointDerivative, (c, k.references, k.count, VR, k.numbers, k.count, v.results, COUNTS)); } break;
    case 20: case 21: DO(fmi3GetFMUState, (c, choose(100) ? &w->state[slot] : NULL)); break;
    case 22: DO(fmi3SetFMUState, (c, state)); w->failed = w->failed && status != 0; break;
    case 23: DO(fmi3FreeFMUState, (c, &w->state[slot])); break;
    case 24: DO(fmi3SerializedFMUStateSize, (c, state, &w->size)); break;
    case 25: w->size = w->size % ROOM; DO(fmi3SerializeFMUState, (c, state, w->bytes, w->size)); break;
    case 26: case 27:
        if (w->size > 24 && choose(3)) {
            damage(w->bytes, w->size);
        }
        if (w->state[slot] == NULL) {
            DO(fmi3DeserializeFMUState, (c, w->bytes, w->size, &w->state[slot]));
        }
        break;
    case 28: DO(fmi3EnterEventMode, (c)); break;
    case 29: DO(fmi3UpdateDiscreteStates, (c, flag, flag + 1, flag + 2, choose(9) ? flag + 3 : NULL, flag + 4, &x)); break;
    case 30:
        if (w->event_mode && choose(9)) {
            DO(fmi3EnterStepMode, (c));
        } else {
            DO(fmi3EnterContinuousTimeMode, (c));
        }
        break;
    case 31: DO(fmi3CompletedIntegratorStep, (c, true, flag, choose(9) ? flag + 1 : NULL)); break;
    case 32: DO(fmi3SetTime, (c, x)); break;
    case 33: x = choose(3) ? 1e-6 * x : x; DO(fmi3SetContinuousStates, (c, &x, choose(50) ? STATES : 2)); break;
    case 34: DO(fmi3GetContinuousStateDerivatives, (c, v.result, choose(50) ? STATES : 2)); break;
    case 35: DO(fmi3GetEventIndicators, (c, v.result, choose(50) ? 2 : 1)); break;
    case 36: DO(fmi3GetContinuousStates, (c, v.result, choose(50) ? STATES : 3)); break;
    case 37: DO(fmi3GetNominalsOfContinuousStates, (c, choose(50) ? v.result : NULL, STATES)); break;
    case 38:
        if (choose(2)) {
            DO(fmi3GetNumberOfEventIndicators, (c, choose(9) ? &size : NULL));
        } else {
            DO(fmi3GetNumberOfContinuousStates, (c, choose(9) ? &size : NULL));
        }
        break;
    default:
        DO(fmi3DoStep, (c, choose(50) ? w->time : x, any_step(), true, flag, flag + 1, flag + 2, choose(9) ? &x : NULL));
        REQUIRE(status > 1 || !flag[1]);
        w->time += status <= 1 && !flag[2] ? 1e-3 : 0.0;
    }
    if (w->failed) {
        REQUIRE(fmi3DoStep(c, w->time, 1e-3, true, flag, flag + 1, flag + 2, &x) == fmi3Error);
        REQUIRE(fmi3SetFloat64(c, v.reference, 0, v.number, 0) == fmi3Error);
    }
}

/* Legal calls that bring an instance to a state where calls succeed. */
static void start_2(World *w)
{
    REQUIRE(fmi2Reset(w->instance) == fmi2OK);
    REQUIRE(fmi2SetupExperiment(w->instance, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
    REQUIRE(fmi2EnterInitializationMode(w->instance) == fmi2OK);
    REQUIRE(fmi2ExitInitializationMode(w->instance) == fmi2OK);
    REQUIRE(w->co_simulation || choose(2) || fmi2EnterContinuousTimeMode(w->instance) == fmi2OK);
}

static void start_3(World *w)
{
    REQUIRE(fmi3Reset(w->instance) == fmi3OK);
    REQUIRE(fmi3EnterInitializationMode(w->instance, false, 0.0, 0.0, false, 0.0) == fmi3OK);
    REQUIRE(fmi3ExitInitializationMode(w->instance) == fmi3OK);
    REQUIRE(w->co_simulation || choose(2) || fmi3EnterContinuousTimeMode(w->instance) == fmi3OK);
    REQUIRE(!w->co_simulation || !w->event_mode || choose(2) || fmi3EnterStepMode(w->instance) == fmi3OK);
}

int main(int argc, char **argv)
{
    static World world;
    World *const w = &world;
    long calls, functions_called = 0, that_succeeded = 0, total = 0, good = 0;

    if (argc != 3) {
        return 2;
    }
    resources = argv[1];
    calls = strtol(argv[2], NULL, 10);
    for (w->version = 2; w->version <= 3; ++w->version) {
        make(w);
        for (long n = 0; n < calls; ++n) {
            if (choose(2000) == 0) {
                end(w);
                make(w);
            }
            if (w->failed ? choose(10) == 0 : choose(300) == 0) {
                w->version == 2 ? start_2(w) : start_3(w);
                w->failed = 0;
                w->time = 0.0;
            }
            w->version == 2 ? call_2(w) : call_3(w);
        }
        end(w);
    }
    for (int i = 0; i < LINES; ++i) {
        functions_called += called[i] > 0;
        that_succeeded += succeeded[i] > 0;
        total += called[i];
        good += succeeded[i];
        if (called[i] > 0 && succeeded[i] == 0) {
            (void)printf("never succeeded: %s\n", names[i]);
        }
    }
    (void)printf("%ld calls, %ld succeeded; %ld places of calls, %ld with success\n", total, good, functions_called,
                 that_succeeded);
    return 0;
}
