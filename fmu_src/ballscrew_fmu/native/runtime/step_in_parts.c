/* Co-simulation steps of FMI 3 in parts: to events, to intermediate updates, with early return. */
#include "instance.h"

#if MODEL_PARTS

#define PARTS 8 /* equal parts of a step with intermediate updates; a power of 2, so that their ends are exact */

/* Calls the importer at the end of a part; it may set inputs there. *until [s from the start of the step] becomes
   earlier if the importer requests an early return. */
static Status intermediate_update(Instance *instance, double start, double done, bool last, double *until)
{
    const bool may_return = instance->early_return && !last;
    double requested = instance->now.time;
    bool returns;

    instance->now.state = INTERMEDIATE_UPDATE_MODE;
    returns = instance->update(instance, instance->now.time, !last, may_return, &requested);
    if (instance->now.state != INTERMEDIATE_UPDATE_MODE) { /* a call was illegal */
        return STATUS_ERROR;
    }
    instance->now.state = STEP_MODE;
    if (returns && may_return) {
        /* a time that has passed, or nan: at once */
        requested = requested > instance->now.time ? requested - start : done;
        *until = requested < *until ? requested : *until;
    }
    return STATUS_OK;
}

static Status make_parts(Instance *instance, double time, double step, StepEnd *end)
{
    Situation *now = &instance->now;
    Model *model = &now->model;
    Status status = instance_begin_step(instance, time, step, false, true);
    double done = 0.0, until = step, energy = 0.0, longest = 0.0;
    int part = 1, count = 0;
    bool due = false;

    if (status != STATUS_OK) {
        return status;
    }
    if (now->reported) { /* and the importer has not entered event mode */
        model_latch(model);
        (void)model_event(model);
        now->reported = false;
    }
    do {
        const double end_of_part = instance->update != NULL && part < PARTS ? step * part / PARTS : step;
        const double to = end_of_part < until ? end_of_part : until, length = to - done;

        if (model->events) {
            model_latch(model);
            due = model_event_due(model);
        }
        if (!due) {
            model_step(model, length);
            energy += length * model_power(model);
            longest = length > longest ? length : longest;
            ++count;
            done = to;
        }
        now->time = time + done;
        now->stale = false;
        if (due) {
            if (instance->early_return) {
                break;
            }
            (void)model_event(model);
            due = false;
        } else if (done >= end_of_part) {
            if (instance->update != NULL) {
                status = intermediate_update(instance, time, done, part >= PARTS, &until);
                if (status == STATUS_OK && done < until && !instance_is_valid(instance)) {
                    return STATUS_DISCARD;
                }
            }
            ++part;
        }
    } while (status == STATUS_OK && done < until);
    if (status != STATUS_OK) {
        return status;
    }
    if (count > 1) {
        model_set_mean_power(model, energy / done);
    }
    now->reported = due;
    end->event = due;
    end->early = done < step;
    instance_end_step(instance, end->early ? time + done : time + step, longest);
    return STATUS_OK;
}

/* A step with a value that is not valid: all as before it, except what has been set since. */
static Status discard(Instance *instance, const Situation *before)
{
    const Model set = instance->now.model;

    instance->now = *before;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_INPUT) {
            model_set(&instance->now.model, i, set.value[i]);
        }
    }
    instance->now.stale = instance->now.unchecked = true;
    return STATUS_DISCARD;
}

INTERNAL Status instance_step_in_parts(Instance *instance, double time, double step, StepEnd *end)
{
    if (instance->update != NULL) {
        const Situation before = instance->now;
        const Status status = make_parts(instance, time, step, end);
        return status == STATUS_DISCARD ? discard(instance, &before) : status;
    }
    return make_parts(instance, time, step, end);
}

#endif
