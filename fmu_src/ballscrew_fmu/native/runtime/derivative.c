/* Directional and adjoint derivatives from the derivatives of the model along a direction. */
#include "instance.h"

static bool is_known(const Instance *instance, unsigned reference)
{
    const unsigned index = instance_index(reference);
    enum Causality causality;

    if (index == (unsigned)VARIABLE_COUNT || model_variables[index].boolean) {
        return false;
    }
    causality = model_variables[index].causality;
    return causality == CAUSALITY_INPUT || causality == CAUSALITY_STATE
           || (causality == CAUSALITY_PARAMETER && instance->now.state == INITIALIZATION_MODE);
}

/* Of a Boolean output the derivative is 0: some importers ask for those of all outputs. */
static bool is_unknown(unsigned reference)
{
    const unsigned index = instance_index(reference);

    return index < (unsigned)VARIABLE_COUNT
           && (model_variables[index].causality == CAUSALITY_OUTPUT || model_variables[index].shown
               || model_variables[index].causality == CAUSALITY_RATE);
}

/* Derivatives of outputs and rates with respect to inputs, continuous states and, in initialization mode, parameters.
   Forward: sensitivity of each unknown for the seed of the knowns. Adjoint: sensitivity of each known
   for the seed of the unknowns. */
INTERNAL Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                           const unsigned knowns[], size_t known_count, const double seed[], double sensitivity[],
                                    bool adjoint)
{
    Model *model = &instance->now.model;
    double direction[VARIABLE_COUNT] = {0.0}, slopes[VARIABLE_COUNT] = {0.0};

    if ((unknown_count > 0 && unknowns == NULL) || (known_count > 0 && knowns == NULL)
        || ((adjoint ? unknown_count : known_count) > 0 && seed == NULL)
        || ((adjoint ? known_count : unknown_count) > 0 && sensitivity == NULL)) {
        return instance_missing_array(instance);
    }
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!is_unknown(unknowns[i])) {
            return instance_fail(instance, "value reference %u has no derivatives; unknowns are outputs and "
                                 "derivatives of states", unknowns[i]);
        }
    }
    for (size_t k = 0; k < known_count; ++k) {
        if (!is_known(instance, knowns[k])) {
            return instance_fail(instance, "no derivatives along value reference %u; knowns are inputs and states",
                                 knowns[k]);
        }
    }
    instance_follow(instance);
    for (size_t k = 0; adjoint && k < known_count; ++k) {
        const unsigned along = instance_index(knowns[k]);
        direction[along] = 1.0;
        model_derivatives(model, direction, slopes);
        direction[along] = sensitivity[k] = 0.0;
        for (size_t i = 0; i < unknown_count; ++i) {
            sensitivity[k] += seed[i] * slopes[instance_index(unknowns[i])];
        }
    }
    for (size_t k = 0; !adjoint && k < known_count; ++k) {
        direction[instance_index(knowns[k])] += seed[k];
    }
    if (!adjoint) {
        model_derivatives(model, direction, slopes);
        for (size_t i = 0; i < unknown_count; ++i) {
            sensitivity[i] = slopes[instance_index(unknowns[i])];
        }
    }
    return STATUS_OK;
}
