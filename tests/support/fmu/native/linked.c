/* Three FMUs in one program: friction of one screw (FMI 2, prefix one_), friction of another (FMI 3, prefix two_), the
   preload monitor of the first (FMI 2, prefix three_). Usage: linked RESOURCES_1 RESOURCES_2 RESOURCES_3, or without
   arguments for FMUs with their maps compiled in. Prints the friction torque of both screws and the preload that the
   monitor finds from the torque of the first.

   Compile with the tokens TOKEN_1, TOKEN_2, TOKEN_3 and the value references FRICTION_INPUTS, FRICTION_TORQUE,
   MONITOR_INPUTS, MONITOR_PRELOAD. */
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"
#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes"
#endif
#include "fmi3FunctionTypes.h"
#ifdef __clang__
#pragma clang diagnostic pop
#endif

#define INPUTS 4
#define STEP 1e-3

extern fmi2InstantiateTYPE one_fmi2Instantiate, three_fmi2Instantiate;
extern fmi2SetupExperimentTYPE one_fmi2SetupExperiment, three_fmi2SetupExperiment;
extern fmi2EnterInitializationModeTYPE one_fmi2EnterInitializationMode, three_fmi2EnterInitializationMode;
extern fmi2ExitInitializationModeTYPE one_fmi2ExitInitializationMode, three_fmi2ExitInitializationMode;
extern fmi2SetRealTYPE one_fmi2SetReal, three_fmi2SetReal;
extern fmi2DoStepTYPE one_fmi2DoStep, three_fmi2DoStep;
extern fmi2GetRealTYPE one_fmi2GetReal, three_fmi2GetReal;
extern fmi2FreeInstanceTYPE one_fmi2FreeInstance, three_fmi2FreeInstance;
extern fmi3InstantiateCoSimulationTYPE two_fmi3InstantiateCoSimulation;
extern fmi3EnterInitializationModeTYPE two_fmi3EnterInitializationMode;
extern fmi3ExitInitializationModeTYPE two_fmi3ExitInitializationMode;
extern fmi3SetFloat64TYPE two_fmi3SetFloat64;
extern fmi3DoStepTYPE two_fmi3DoStep;
extern fmi3GetFloat64TYPE two_fmi3GetFloat64;
extern fmi3FreeInstanceTYPE two_fmi3FreeInstance;

static const unsigned friction_inputs[INPUTS] = {FRICTION_INPUTS}, friction_torque[] = {FRICTION_TORQUE};
static const unsigned monitor_inputs[INPUTS] = {MONITOR_INPUTS}, monitor_preload[] = {MONITOR_PRELOAD};
static const fmi2CallbackFunctions functions = {NULL, calloc, free, NULL, NULL};

#define CHECK(condition)                                      \
    do {                                                      \
        if (!(condition)) {                                   \
            (void)fprintf(stderr, "not so: %s\n", #condition); \
            exit(1);                                          \
        }                                                     \
    } while (0)

int main(int count, char **arguments)
{
    const char *resources[3];
    double at[INPUTS] = {2000.0, 30.0, 310.0, 400.0}, first, second, preload;
    fmi3Boolean event, terminate, early;
    fmi3Float64 last;
    void *one, *two, *three;

    for (int n = 0; n < 3; ++n) {
        resources[n] = count == 4 ? arguments[n + 1] : NULL;
    }
    one = one_fmi2Instantiate("one", fmi2CoSimulation, TOKEN_1, resources[0], &functions, fmi2False, fmi2False);
    two = two_fmi3InstantiateCoSimulation("two", TOKEN_2, resources[1], fmi3False, fmi3False, fmi3False, fmi3False,
                                          NULL, 0, NULL, NULL, NULL);
    three = three_fmi2Instantiate("three", fmi2CoSimulation, TOKEN_3, resources[2], &functions, fmi2False, fmi2False);
    CHECK(one != NULL && two != NULL && three != NULL);
    CHECK(one_fmi2Instantiate("one", fmi2CoSimulation, TOKEN_3, resources[0], &functions, 0, 0) == NULL);

    CHECK(one_fmi2SetupExperiment(one, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(one_fmi2EnterInitializationMode(one) == fmi2OK && one_fmi2ExitInitializationMode(one) == fmi2OK);
    CHECK(two_fmi3EnterInitializationMode(two, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
    CHECK(two_fmi3ExitInitializationMode(two) == fmi3OK);
    CHECK(three_fmi2SetupExperiment(three, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(three_fmi2EnterInitializationMode(three) == fmi2OK && three_fmi2ExitInitializationMode(three) == fmi2OK);

    CHECK(one_fmi2SetReal(one, friction_inputs, INPUTS, at) == fmi2OK);
    CHECK(two_fmi3SetFloat64(two, friction_inputs, INPUTS, at, INPUTS) == fmi3OK);
    CHECK(one_fmi2DoStep(one, 0.0, STEP, fmi2True) == fmi2OK);
    CHECK(two_fmi3DoStep(two, 0.0, STEP, fmi3True, &event, &terminate, &early, &last) == fmi3OK);
    CHECK(one_fmi2GetReal(one, friction_torque, 1, &first) == fmi2OK);
    CHECK(two_fmi3GetFloat64(two, friction_torque, 1, &second, 1) == fmi3OK);
    at[0] = first;
    CHECK(three_fmi2SetReal(three, monitor_inputs, INPUTS, at) == fmi2OK);
    CHECK(three_fmi2DoStep(three, 0.0, STEP, fmi2True) == fmi2OK);
    CHECK(three_fmi2GetReal(three, monitor_preload, 1, &preload) == fmi2OK);
    one_fmi2FreeInstance(one);
    two_fmi3FreeInstance(two);
    three_fmi2FreeInstance(three);
    (void)printf("%.17g %.17g %.17g\n", first, second, preload);
    return 0;
}
