/* Values of the variables of an instance, by value reference and as vectors of model exchange. A call that fails or is
   discarded stores nothing. In co-simulation a value that is not valid is stored, and steps are discarded until it is
   replaced. */
#include "values.h"

#include "messages.h"

/* States in which a variable may be set; 0: never. */
static unsigned settable_in(const Variable *variable)
{
    switch (variable->causality) {
    case CAUSALITY_INPUT:
        return INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE;
    case CAUSALITY_PARAMETER:
        return INSTANTIATED | INITIALIZATION_MODE | (variable->fixed ? 0U : STEP_MODE | EVENT_MODE);
    case CAUSALITY_STATE:
        return INSTANTIATED | INITIALIZATION_MODE | CONTINUOUS_TIME_MODE;
    default:
        return 0U;
    }
}

static unsigned instance_index(unsigned reference)
{
    const unsigned index = reference - FIRST_REFERENCE; /* wraps around below the first */

    return index < (unsigned)VARIABLE_COUNT ? index : (unsigned)VARIABLE_COUNT;
}

INTERNAL Status instance_missing_array(Instance *instance)
{
    return instance_fail(instance, "an array is a NULL pointer");
}

static Status unknown(Instance *instance, const char *type, unsigned reference)
{
    return instance_fail(instance, "no %s variable has value reference %u", type, reference);
}

static Status invalid(Instance *instance, unsigned index, double value)
{
    const Variable *variable = &model_variables[index];
    char text[32], lowest[32], highest[32];

    return instance_discard(instance, "%s = %s; needs a finite number >= %s and < %s", variable->name,
                            number_text(value, text), number_text(variable->lowest, lowest),
                            number_text(TOO_LARGE, highest));
}

/* all values that were set; if not, the first one is logged */
INTERNAL bool instance_is_valid(Instance *instance)
{
    const double *value = instance->now.model.value;

    for (unsigned i = 0; instance->now.unchecked && i < (unsigned)VARIABLE_COUNT; ++i) {
        if (model_is_set(&model_variables[i]) && !model_accepts((int)i, value[i])) {
            (void)invalid(instance, i, value[i]);
            return false;
        }
    }
    instance->now.unchecked = false;
    return true;
}

/* Update the outputs after valid values were set. In step mode of co-simulation only a step updates them. */
INTERNAL void update_outputs(Instance *instance)
{
    if (instance->now.stale
        && (instance->kind == KIND_ME || instance->now.state == INITIALIZATION_MODE)) {
        instance->now.stale = false;
        if (instance_is_valid(instance)) {
            model_latch(&instance->now.model);
        }
    }
}

static bool is_settable(const Instance *instance, unsigned index)
{
    return (settable_in(&model_variables[index]) & instance->now.state) != 0U;
}

/* Whether a variable may be set to this value now; if not, the call has failed. A parameter may always be set to the
   value that it has, without effect: OpenModelica writes all parameters, fixed ones too, after the initialization. */
static bool can_be_set(Instance *instance, unsigned index, double value)
{
    char here[32];

    if (is_settable(instance, index)
        || (model_variables[index].causality == CAUSALITY_PARAMETER && instance->now.model.value[index] == value)) {
        return true;
    }
    instance_list_states(instance->now.state, here, sizeof here);
    (void)instance_fail(instance, "%s cannot be set in %s", model_variables[index].name, here);
    return false;
}

INTERNAL Status instance_get_reals(Instance *instance, const unsigned references[], size_t count, double values[])
{
    if (count > 0 && (references == NULL || values == NULL)) {
        return instance_missing_array(instance);
    }
    update_outputs(instance);
    for (size_t i = 0; i < count; ++i) {
        const unsigned index = instance_index(references[i]);
        if (index < (unsigned)VARIABLE_COUNT) { /* a Boolean too, as 0 or 1: some importers read all outputs as Real */
            values[i] = model_get(&instance->now.model, (int)index);
        } else if (instance->importer.time_variable && references[i] == (unsigned)TIME_REFERENCE) {
            values[i] = instance->now.time;
        } else {
            return unknown(instance, "Real", references[i]);
        }
    }
    return STATUS_OK;
}

/* Whether a call has its arrays, and its references are of Boolean variables, or of others. type: for the message */
static bool check_references(Instance *instance, const unsigned references[], const void *values, size_t count,
                             bool boolean, const char *type)
{
    if (count > 0 && (references == NULL || values == NULL)) {
        (void)instance_missing_array(instance);
        return false;
    }
    for (size_t i = 0; i < count; ++i) {
        const unsigned index = instance_index(references[i]);
        if (index == (unsigned)VARIABLE_COUNT || model_variables[index].boolean != boolean) {
            (void)unknown(instance, type, references[i]);
            return false;
        }
    }
    return true;
}

INTERNAL Status instance_get_booleans(Instance *instance, const unsigned references[], size_t count, bool values[])
{
    if (!check_references(instance, references, values, count, true, "Boolean")) {
        return STATUS_ERROR;
    }
    update_outputs(instance);
    for (size_t i = 0; i < count; ++i) {
        values[i] = model_get(&instance->now.model, (int)instance_index(references[i])) != 0.0;
    }
    return STATUS_OK;
}

/* values: bool of Boolean variables, double of the others */
INTERNAL Status instance_set(Instance *instance, const unsigned references[], size_t count, const void *values,
                             bool boolean)
{
    const bool *booleans = values;
    const double *reals = values;

    if (!check_references(instance, references, values, count, boolean, boolean ? "settable Boolean" : "settable Real")) {
        return STATUS_ERROR;
    }
    for (size_t i = 0; i < count; ++i) {
        if (!can_be_set(instance, instance_index(references[i]), boolean ? booleans[i] : reals[i])) {
            return STATUS_ERROR;
        }
    }
    for (size_t i = 0; !boolean && i < count; ++i) {
        const unsigned index = instance_index(references[i]);
        if (!model_accepts((int)index, reals[i])) {
            if (instance->kind == KIND_ME) {
                return invalid(instance, index, reals[i]);
            }
            instance->now.unchecked = true; /* the step is discarded */
        }
    }
    for (size_t i = 0; i < count; ++i) {
        const unsigned index = instance_index(references[i]);
        if (is_settable(instance, index)) {
            model_set(&instance->now.model, (int)index, boolean ? booleans[i] : reals[i]);
            instance->now.stale = true;
        }
    }
    return STATUS_OK;
}

INTERNAL Status instance_no_variables(Instance *instance, const char *type, const unsigned references[], size_t count)
{
    if (count == 0) {
        return STATUS_OK;
    }
    return references == NULL ? instance_missing_array(instance) : unknown(instance, type, references[0]);
}

/* --- vectors of model exchange ----------------------------------------------------------------------------------- */

/* Checks that the array of the importer is not NULL and has the expected length. */
static Status check_length(Instance *instance, const double array[], size_t length, size_t expected)
{
    if (length != expected) {
        return instance_fail(instance, "array of %lu numbers; needs %lu", (unsigned long)length,
                             (unsigned long)expected);
    }
    return array == NULL && length > 0 ? instance_missing_array(instance) : STATUS_OK;
}

/* Number of variables of a causality. */
static size_t instance_count(enum Causality causality)
{
    size_t count = 0;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        count += model_variables[i].causality == causality;
    }
    return count;
}

INTERNAL Status instance_put_count(Instance *instance, enum Causality causality, size_t *count)
{
    if (count == NULL) {
        return instance_fail(instance, "argument is a NULL pointer");
    }
    *count = instance_count(causality);
    return STATUS_OK;
}

/* Values of the states, rates or event indicators, in the order of the table; nominal: the nominal ones. */
INTERNAL Status instance_get_all(Instance *instance, enum Causality causality, bool nominal, double values[],
                                 size_t length)
{
    const Status status = check_length(instance, values, length, instance_count(causality));
    Model *model = &instance->now.model;

    if (status == STATUS_OK && causality != CAUSALITY_STATE) {
        update_outputs(instance);
    }
    if (status == STATUS_OK && causality == CAUSALITY_INDICATOR) {
        model_indicators(model);
    }
    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == causality) {
            *values++ = nominal                        ? model_variables[i].nominal
                        : causality == CAUSALITY_RATE ? model_get(model, i)
                                                      : model->value[i];
        }
    }
    return status;
}

/* fmi4c asks without an array, and ends if it is refused */
INTERNAL Status instance_get_nominals(Instance *instance, double nominals[], size_t length)
{
    return nominals == NULL ? STATUS_OK : instance_get_all(instance, CAUSALITY_STATE, true, nominals, length);
}

INTERNAL Status instance_set_states(Instance *instance, const double states[], size_t length)
{
    Status status = check_length(instance, states, length, instance_count(CAUSALITY_STATE));
    const double *state = states;

    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_STATE && !model_accepts(i, *state++)) {
            status = invalid(instance, (unsigned)i, state[-1]);
        }
    }
    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_STATE) {
            model_set(&instance->now.model, i, *states++);
            instance->now.stale = true;
        }
    }
    return status;
}

/* --- derivatives ------------------------------------------------------------------------------------------------- */

static bool is_known(const Instance *instance, unsigned reference)
{
    const unsigned index = instance_index(reference);
    const Variable *variable = &model_variables[index < (unsigned)VARIABLE_COUNT ? index : 0];

    return index < (unsigned)VARIABLE_COUNT && !variable->boolean
           && (variable->causality == CAUSALITY_INPUT || variable->causality == CAUSALITY_STATE
               || (variable->causality == CAUSALITY_PARAMETER && instance->now.state == INITIALIZATION_MODE));
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
                                    const unsigned knowns[], size_t known_count, const double seed[],
                                    double sensitivity[], bool adjoint)
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
    update_outputs(instance);
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
