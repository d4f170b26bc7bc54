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

/* An exported function with its declaration before it, under the prefix that sources linked into a master have; and an argument of a call
 * that changes nothing. */
#ifdef FUNCTION_PREFIX
#define PASTED(a, b) a##b
#define PASTE(a, b) PASTED(a, b)
#define API(name) PASTE(FUNCTION_PREFIX, name)
#define EXPORTED
#else
#define API(name) name
#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#elif defined __GNUC__
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif
#endif
#define FUNCTION(result, name, arguments) EXPORTED result API(name) arguments; result API(name) arguments
#define UNUSED(one) ((void)(one))

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
enum unit_result unit_get(unit *one, const uint32_t references[], size_t count, double values[]);
enum unit_result unit_set(unit *one, const uint32_t references[], size_t count, const double values[]);
enum unit_result unit_step(unit *one, double time, double seconds);
enum unit_result unit_failed(unit *one, const char *what, const char *name);

/* A state saved into memory that is made where *state is NULL, gone back to, and given back. `function`: who asks, for the message. */
enum unit_result unit_save(const unit *one, void **state);
enum unit_result unit_restore(unit *one, const void *state, const char *function);
void unit_forget(void **state);

/* A saved state as bytes, and back; bytes that another unit has written are refused. */
size_t unit_bytes(void);
enum unit_result unit_write(unit *one, const void *state, uint8_t bytes[], size_t count, const char *function);
enum unit_result unit_read(unit *one, const uint8_t bytes[], size_t count, void **state);

#endif
