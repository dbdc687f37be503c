/* Directional and adjoint derivatives from the directional derivative of the model. */
#include "instance.h"

/* One entry per variable, even if the importer gives it repeatedly, so that the size is bounded. */
typedef struct {
    int indices[VARIABLE_COUNT];
    double seeds[VARIABLE_COUNT];
    size_t count;
} Seeded;

static void add_seed(Seeded *seeded, int index, double seed)
{
    size_t i = 0;

    while (i < seeded->count && seeded->indices[i] != index) {
        ++i;
    }
    if (i == seeded->count) {
        seeded->indices[seeded->count++] = index;
        seeded->seeds[i] = 0.0;
    }
    seeded->seeds[i] += seed;
}

/* Sum over the unknowns: seed times derivative along one known. */
static double along(Model *model, const Seeded *seeded, int known)
{
    const double one = 1.0;
    double slopes[VARIABLE_COUNT], sum = 0.0;

    model_directional_derivative(model, seeded->indices, seeded->count, &known, 1, &one, slopes);
    for (size_t i = 0; i < seeded->count; ++i) {
        sum += seeded->seeds[i] * slopes[i];
    }
    return sum;
}

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

static bool is_unknown(unsigned reference)
{
    const unsigned index = instance_index(reference);

    return index < (unsigned)VARIABLE_COUNT && !model_variables[index].boolean
           && (model_variables[index].causality == CAUSALITY_OUTPUT
               || model_variables[index].causality == CAUSALITY_RATE);
}

Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                           const unsigned knowns[], size_t known_count, const double seed[], double sensitivity[],
                           bool adjoint)
{
    Seeded seeded;

    if ((unknown_count > 0 && unknowns == NULL) || (known_count > 0 && knowns == NULL)
        || ((adjoint ? unknown_count : known_count) > 0 && seed == NULL)
        || ((adjoint ? known_count : unknown_count) > 0 && sensitivity == NULL)) {
        return instance_missing_array(instance);
    }
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!is_unknown(unknowns[i])) {
            return instance_fail(instance, "value reference %u has no derivatives; unknowns are Real outputs and "
                                 "derivatives of states", unknowns[i]);
        }
    }
    for (size_t i = 0; i < known_count; ++i) {
        if (!is_known(instance, knowns[i])) {
            return instance_fail(instance, "no derivatives along value reference %u; knowns are inputs and states",
                                 knowns[i]);
        }
    }
    instance_follow(instance);
    seeded.count = 0;
    if (adjoint) {
        for (size_t i = 0; i < unknown_count; ++i) {
            add_seed(&seeded, (int)instance_index(unknowns[i]), seed[i]);
        }
        for (size_t i = 0; i < known_count; ++i) {
            sensitivity[i] = along(&instance->now.model, &seeded, (int)instance_index(knowns[i]));
        }
        return STATUS_OK;
    }
    for (size_t i = 0; i < known_count; ++i) {
        add_seed(&seeded, (int)instance_index(knowns[i]), seed[i]);
    }
    for (size_t first = 0; first < unknown_count; first += VARIABLE_COUNT) {
        int indices[VARIABLE_COUNT];
        size_t count = 0;
        for (; count < VARIABLE_COUNT && first + count < unknown_count; ++count) {
            indices[count] = (int)instance_index(unknowns[first + count]);
        }
        model_directional_derivative(&instance->now.model, indices, count, seeded.indices, seeded.count,
                                     seeded.seeds, sensitivity + first);
    }
    return STATUS_OK;
}
