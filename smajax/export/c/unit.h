/* One instance of a block behind the functional mock-up interface, whichever version of it: what fmi2.c and fmi3.c share.
 *
 * The generated block.h says which block it is: its types and functions, and the table of its variables.
 */
#ifndef SMAJAX_UNIT_H
#define SMAJAX_UNIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "block.h"

enum unit_kind { UNIT_TIME, UNIT_PARAMETER, UNIT_INPUT, UNIT_OUTPUT };
enum unit_mode { UNIT_MADE, UNIT_INITIALISING, UNIT_STEPPING, UNIT_ENDED };
enum unit_result { UNIT_OK, UNIT_ERROR };

/* What an instance remembers, without a pointer in it: a copy of it is its state. */
typedef struct {
    block_state state;
    block_inputs inputs;
    block_outputs outputs;
    double time;      /* s, of the last communication point */
    double begin;     /* s, of the first one */
    uint64_t samples; /* that a sampled block has taken */
    int32_t mode;
    int32_t stale;    /* whether outputs are of before the last change */
} unit_data;

typedef void (*unit_say)(void *listener, const char *category, const char *message);

typedef struct {
    unit_data data;
    unit_say say;
    void *listener;
} unit;

unit *unit_new(unit_say say, void *listener);
void unit_reset(unit *one);
enum unit_result unit_begin(unit *one, double time);
enum unit_result unit_initialised(unit *one);
enum unit_result unit_get(unit *one, uint32_t reference, double *value);
enum unit_result unit_set(unit *one, uint32_t reference, double value);
enum unit_result unit_step(unit *one, double time, double seconds);
enum unit_result unit_failed(unit *one, const char *what, const char *name);

/* Bytes of a saved state, and a saved state as bytes; `unit_read` refuses what another unit has written. */
size_t unit_bytes(void);
void unit_write(const unit_data *data, uint8_t *bytes);
enum unit_result unit_read(unit *one, const uint8_t *bytes, size_t count, unit_data *data);

#endif
