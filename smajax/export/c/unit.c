/* See unit.h. */
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct unit_variable {
    const char *name;
    enum unit_kind kind;
    size_t at; /* in unit_data */
    double start, low, high;
};
#include "variables.h"

#if UNIT_SAMPLED
/* A sample that rounding put a hair before the end of a step belongs to the next one. */
#define HAIR 1e-9
#endif

static double *place(unit_data *data, uint32_t reference)
{
    return (double *)(void *)((char *)data + unit_variables[reference].at);
}

enum unit_result unit_failed(unit *one, const char *what, const char *name)
{
    char text[320];
    if (one->say != NULL) {
        snprintf(text, sizeof text, "%s%s%s", name, name[0] != '\0' ? ": " : "", what);
        one->say(one->listener, "logStatusError", text);
    }
    return UNIT_ERROR;
}

unit *unit_new(unit_say say, void *listener)
{
    unit *one = calloc(1, sizeof *one);
    if (one != NULL) {
        one->say = say;
        one->listener = listener;
        unit_reset(one);
    }
    return one;
}

void unit_reset(unit *one)
{
    uint32_t k;
    memset(&one->data, 0, sizeof one->data);
    block_init(&one->data.state);
    for (k = 0; k < UNIT_VARIABLES; k++) {
        if (unit_variables[k].kind == UNIT_INPUT) {
            *place(&one->data, k) = unit_variables[k].start;
        }
    }
    one->data.mode = UNIT_MADE;
    one->data.stale = 1;
}

static enum unit_result check(unit *one, enum unit_kind kind)
{
    uint32_t k;
    for (k = 0; k < UNIT_VARIABLES; k++) {
        if (unit_variables[k].kind == kind) {
            const double value = *place(&one->data, k);
            if (!isfinite(value)) {
                return unit_failed(one, "is not a finite number", unit_variables[k].name);
            }
            if (kind == UNIT_PARAMETER && !(value >= unit_variables[k].low && value <= unit_variables[k].high)) {
                return unit_failed(one, "is out of its bounds, the min and max of the model description", unit_variables[k].name);
            }
        }
    }
    return UNIT_OK;
}

/* The state at rest with the present parameters and inputs: of a block that is not sampled, which waits for its first sample. */
static enum unit_result refreshed(unit *one)
{
    if (one->data.stale && one->data.mode != UNIT_STEPPING) {
        if (check(one, UNIT_PARAMETER) != UNIT_OK || check(one, UNIT_INPUT) != UNIT_OK) {
            return UNIT_ERROR;
        }
#if !UNIT_SAMPLED
        UNIT_START(&one->data);
#endif
        one->data.stale = 0;
    }
    return UNIT_OK;
}

enum unit_result unit_begin(unit *one, double time)
{
    if (one->data.mode != UNIT_MADE) {
        return unit_failed(one, "initialization mode is entered once, after instantiation or reset", "");
    }
    one->data.time = one->data.begin = time;
    one->data.mode = UNIT_INITIALISING;
    return UNIT_OK;
}

enum unit_result unit_initialised(unit *one)
{
    if (one->data.mode != UNIT_INITIALISING) {
        return unit_failed(one, "there is no initialization mode to leave", "");
    }
    if (refreshed(one) != UNIT_OK) {
        return UNIT_ERROR;
    }
    one->data.mode = UNIT_STEPPING;
    return UNIT_OK;
}

static enum unit_result get(unit *one, uint32_t reference, double *value)
{
    if (reference >= UNIT_VARIABLES) {
        return unit_failed(one, "there is no variable of this value reference", "");
    }
    if (unit_variables[reference].kind == UNIT_OUTPUT && refreshed(one) != UNIT_OK) {
        return UNIT_ERROR;
    }
    *value = *place(&one->data, reference);
    return UNIT_OK;
}

enum unit_result unit_get(unit *one, const uint32_t references[], size_t count, double values[])
{
    size_t k;
    for (k = 0; k < count; k++) {
        if (get(one, references[k], &values[k]) != UNIT_OK) {
            return UNIT_ERROR;
        }
    }
    return UNIT_OK;
}

static enum unit_result set(unit *one, uint32_t reference, double value)
{
    enum unit_kind kind;
    if (reference >= UNIT_VARIABLES) {
        return unit_failed(one, "there is no variable of this value reference", "");
    }
    kind = unit_variables[reference].kind;
    if (kind != UNIT_PARAMETER && kind != UNIT_INPUT) {
        return unit_failed(one, "is computed and cannot be set", unit_variables[reference].name);
    }
    if (kind == UNIT_PARAMETER && !UNIT_SAMPLED && one->data.mode == UNIT_STEPPING) {
        return unit_failed(one, "is a fixed parameter: set it before the initialization ends", unit_variables[reference].name);
    }
    *place(&one->data, reference) = value;
    one->data.stale = 1;
    return UNIT_OK;
}

enum unit_result unit_set(unit *one, const uint32_t references[], size_t count, const double values[])
{
    size_t k;
    for (k = 0; k < count; k++) {
        if (set(one, references[k], values[k]) != UNIT_OK) {
            return UNIT_ERROR;
        }
    }
    return UNIT_OK;
}

static void advance(unit_data *data, double time, double seconds)
{
#if UNIT_SAMPLED
    while (data->begin + (double)data->samples * UNIT_PERIOD < time + seconds - HAIR * UNIT_PERIOD) {
        UNIT_RUN(data);
        data->samples++;
    }
#else
    (void)time;
    if (seconds > 0.0) {
        UNIT_RUN(data, seconds);
    }
#endif
}

enum unit_result unit_step(unit *one, double time, double seconds)
{
    uint32_t k;
    if (one->data.mode != UNIT_STEPPING) {
        return unit_failed(one, "a step comes after the initialization and before the end", "");
    }
    if (!(seconds >= 0.0) || !isfinite(seconds) || !isfinite(time)) {
        return unit_failed(one, "the time of a step is finite and not negative", "");
    }
    if (check(one, UNIT_INPUT) != UNIT_OK || (UNIT_SAMPLED && check(one, UNIT_PARAMETER) != UNIT_OK)) {
        return UNIT_ERROR;
    }
    advance(&one->data, time, seconds);
    one->data.time = time + seconds;
    for (k = 0; k < UNIT_VARIABLES; k++) {
        if (unit_variables[k].kind == UNIT_OUTPUT && !isfinite(*place(&one->data, k))) {
            return unit_failed(one, "is no finite number after this step", unit_variables[k].name);
        }
    }
    return UNIT_OK;
}

static enum unit_result saved(const unit_data *data, void **state)
{
    if (*state == NULL) {
        *state = malloc(sizeof *data);
    }
    if (*state == NULL) {
        return UNIT_ERROR;
    }
    memcpy(*state, data, sizeof *data);
    return UNIT_OK;
}

enum unit_result unit_save(const unit *one, void **state)
{
    return saved(&one->data, state);
}

enum unit_result unit_restore(unit *one, const void *state, const char *function)
{
    if (state == NULL) {
        return unit_failed(one, "there is no state to go back to", function);
    }
    memcpy(&one->data, state, sizeof one->data);
    return UNIT_OK;
}

void unit_forget(void **state)
{
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
}

size_t unit_bytes(void)
{
    return sizeof(uint64_t) + sizeof(unit_data);
}

enum unit_result unit_write(unit *one, const void *state, uint8_t bytes[], size_t count, const char *function)
{
    const uint64_t mark = UNIT_MARK;
    if (state == NULL || count < unit_bytes()) {
        return unit_failed(one, "the buffer is too small", function);
    }
    memcpy(bytes, &mark, sizeof mark);
    memcpy(bytes + sizeof mark, state, sizeof(unit_data));
    return UNIT_OK;
}

enum unit_result unit_read(unit *one, const uint8_t bytes[], size_t count, void **state)
{
    unit_data data;
    uint64_t mark = 0;
    if (count == unit_bytes()) {
        memcpy(&mark, bytes, sizeof mark);
    }
    if (mark != UNIT_MARK) {
        return unit_failed(one, "these bytes are not a state of this unit", "");
    }
    memcpy(&data, bytes + sizeof mark, sizeof data);
    return saved(&data, state);
}
