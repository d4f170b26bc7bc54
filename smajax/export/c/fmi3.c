/* Functional mock-up interface 3.0 for co-simulation, of the standard's text: every function that it names, those of what this unit has not
 * as errors. */
#ifdef FMI3_FUNCTION_PREFIX
#define FUNCTION_PREFIX FMI3_FUNCTION_PREFIX
#endif
#include "unit.h"

#include <stdlib.h>
#include <string.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);

typedef struct {
    unit *own;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} instance;

static void say(void *listener, const char *category, const char *message)
{
    const instance *i = listener;
    if (i->log != NULL) {
        i->log(i->environment, fmi3Error, category, message);
    }
}

static fmi3Status status(enum unit_result result)
{
    return result == UNIT_OK ? fmi3OK : fmi3Error;
}

static unit *own(fmi3Instance i)
{
    return ((instance *)i)->own;
}

static fmi3Status refused(fmi3Instance i, const char *function)
{
    return status(unit_failed(own(i), "is not for this unit, which has real variables and co-simulation alone", function));
}

FUNCTION(const char *, fmi3GetVersion, (void)) { return "3.0"; }

FUNCTION(fmi3Status, fmi3SetDebugLogging, (fmi3Instance i, fmi3Boolean on, size_t count, const fmi3String categories[]))
{
    UNUSED(i);
    UNUSED(on);
    UNUSED(count);
    UNUSED(categories);
    return fmi3OK;
}

FUNCTION(fmi3Instance, fmi3InstantiateModelExchange,
         (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log))
{
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    if (log != NULL) {
        log(environment, fmi3Error, "logStatusError", "this unit is for co-simulation, not for model exchange");
    }
    return NULL;
}

FUNCTION(fmi3Instance, fmi3InstantiateCoSimulation,
         (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
          fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t intermediates,
          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update))
{
    instance *i = calloc(1, sizeof *i);
    UNUSED(name);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(events);
    UNUSED(early_return);
    UNUSED(intermediate);
    UNUSED(intermediates);
    UNUSED(update);
    if (i == NULL) {
        return NULL;
    }
    i->environment = environment;
    i->log = log;
    i->own = unit_new(say, i);
    if (i->own == NULL || token == NULL || strcmp(token, UNIT_TOKEN) != 0) {
        if (i->own != NULL) {
            unit_failed(i->own, "the instantiation token is another one than that of the model description", "");
        }
        free(i->own);
        free(i);
        return NULL;
    }
    return i;
}

FUNCTION(fmi3Instance, fmi3InstantiateScheduledExecution,
         (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
          fmi3LockPreemptionCallback lock, fmi3LockPreemptionCallback unlock))
{
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(clock);
    UNUSED(lock);
    UNUSED(unlock);
    if (log != NULL) {
        log(environment, fmi3Error, "logStatusError", "this unit is for co-simulation, not for scheduled execution");
    }
    return NULL;
}

FUNCTION(void, fmi3FreeInstance, (fmi3Instance i))
{
    if (i != NULL) {
        free(own(i));
        free(i);
    }
}

FUNCTION(fmi3Status, fmi3EnterInitializationMode,
         (fmi3Instance i, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean stop_defined,
          fmi3Float64 stop))
{
    UNUSED(tolerance_defined);
    UNUSED(tolerance);
    UNUSED(stop_defined);
    UNUSED(stop);
    return status(unit_begin(own(i), start));
}

FUNCTION(fmi3Status, fmi3ExitInitializationMode, (fmi3Instance i)) { return status(unit_initialised(own(i))); }

FUNCTION(fmi3Status, fmi3EnterEventMode, (fmi3Instance i)) { return refused(i, "fmi3EnterEventMode"); }

FUNCTION(fmi3Status, fmi3EnterStepMode, (fmi3Instance i)) { return refused(i, "fmi3EnterStepMode"); }

FUNCTION(fmi3Status, fmi3EnterConfigurationMode, (fmi3Instance i)) { return refused(i, "fmi3EnterConfigurationMode"); }

FUNCTION(fmi3Status, fmi3ExitConfigurationMode, (fmi3Instance i)) { return refused(i, "fmi3ExitConfigurationMode"); }

FUNCTION(fmi3Status, fmi3Terminate, (fmi3Instance i))
{
    own(i)->data.mode = UNIT_ENDED;
    return fmi3OK;
}

FUNCTION(fmi3Status, fmi3Reset, (fmi3Instance i))
{
    unit_reset(own(i));
    return fmi3OK;
}

FUNCTION(fmi3Status, fmi3GetFloat64,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, fmi3Float64 values[], size_t numbers))
{
    if (count != numbers) {
        return status(unit_failed(own(i), "every variable is one number", "fmi3GetFloat64"));
    }
    return status(unit_get(own(i), references, count, values));
}

FUNCTION(fmi3Status, fmi3SetFloat64,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, const fmi3Float64 values[], size_t numbers))
{
    if (count != numbers) {
        return status(unit_failed(own(i), "every variable is one number", "fmi3SetFloat64"));
    }
    return status(unit_set(own(i), references, count, values));
}

/* There are no variables of these types: asked for none it is well, asked for one it is an error. */
#define NO_VARIABLES(name, type)                                                                                             \
    FUNCTION(fmi3Status, name, (fmi3Instance i, const fmi3ValueReference references[], size_t count, type values[], size_t numbers)) \
    {                                                                                                                        \
        UNUSED(references);                                                                                                  \
        UNUSED(values);                                                                                                      \
        UNUSED(numbers);                                                                                                     \
        return count == 0 ? fmi3OK : refused(i, #name);                                                                      \
    }
NO_VARIABLES(fmi3GetFloat32, fmi3Float32)
NO_VARIABLES(fmi3GetInt8, int8_t)
NO_VARIABLES(fmi3GetUInt8, uint8_t)
NO_VARIABLES(fmi3GetInt16, int16_t)
NO_VARIABLES(fmi3GetUInt16, uint16_t)
NO_VARIABLES(fmi3GetInt32, int32_t)
NO_VARIABLES(fmi3GetUInt32, uint32_t)
NO_VARIABLES(fmi3GetInt64, int64_t)
NO_VARIABLES(fmi3GetUInt64, uint64_t)
NO_VARIABLES(fmi3GetBoolean, fmi3Boolean)
NO_VARIABLES(fmi3GetString, fmi3String)
NO_VARIABLES(fmi3SetFloat32, const fmi3Float32)
NO_VARIABLES(fmi3SetInt8, const int8_t)
NO_VARIABLES(fmi3SetUInt8, const uint8_t)
NO_VARIABLES(fmi3SetInt16, const int16_t)
NO_VARIABLES(fmi3SetUInt16, const uint16_t)
NO_VARIABLES(fmi3SetInt32, const int32_t)
NO_VARIABLES(fmi3SetUInt32, const uint32_t)
NO_VARIABLES(fmi3SetInt64, const int64_t)
NO_VARIABLES(fmi3SetUInt64, const uint64_t)
NO_VARIABLES(fmi3SetBoolean, const fmi3Boolean)
NO_VARIABLES(fmi3SetString, const fmi3String)

FUNCTION(fmi3Status, fmi3GetBinary,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, size_t sizes[], fmi3Binary values[], size_t numbers))
{
    UNUSED(references);
    UNUSED(sizes);
    UNUSED(values);
    UNUSED(numbers);
    return count == 0 ? fmi3OK : refused(i, "fmi3GetBinary");
}

FUNCTION(fmi3Status, fmi3SetBinary,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, const size_t sizes[], const fmi3Binary values[],
          size_t numbers))
{
    UNUSED(references);
    UNUSED(sizes);
    UNUSED(values);
    UNUSED(numbers);
    return count == 0 ? fmi3OK : refused(i, "fmi3SetBinary");
}

FUNCTION(fmi3Status, fmi3GetClock, (fmi3Instance i, const fmi3ValueReference references[], size_t count, fmi3Clock values[]))
{
    UNUSED(references);
    UNUSED(values);
    return count == 0 ? fmi3OK : refused(i, "fmi3GetClock");
}

FUNCTION(fmi3Status, fmi3SetClock, (fmi3Instance i, const fmi3ValueReference references[], size_t count, const fmi3Clock values[]))
{
    UNUSED(references);
    UNUSED(values);
    return count == 0 ? fmi3OK : refused(i, "fmi3SetClock");
}

FUNCTION(fmi3Status, fmi3GetNumberOfVariableDependencies, (fmi3Instance i, fmi3ValueReference reference, size_t *count))
{
    UNUSED(reference);
    UNUSED(count);
    return refused(i, "fmi3GetNumberOfVariableDependencies");
}

FUNCTION(fmi3Status, fmi3GetVariableDependencies,
         (fmi3Instance i, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference independents[], size_t others[],
          fmi3DependencyKind kinds[], size_t count))
{
    UNUSED(dependent);
    UNUSED(elements);
    UNUSED(independents);
    UNUSED(others);
    UNUSED(kinds);
    UNUSED(count);
    return refused(i, "fmi3GetVariableDependencies");
}

FUNCTION(fmi3Status, fmi3GetFMUState, (fmi3Instance i, fmi3FMUState *state))
{
    return status(unit_save(own(i), state));
}

FUNCTION(fmi3Status, fmi3SetFMUState, (fmi3Instance i, fmi3FMUState state))
{
    return status(unit_restore(own(i), state, "fmi3SetFMUState"));
}

FUNCTION(fmi3Status, fmi3FreeFMUState, (fmi3Instance i, fmi3FMUState *state))
{
    UNUSED(i);
    unit_forget(state);
    return fmi3OK;
}

FUNCTION(fmi3Status, fmi3SerializedFMUStateSize, (fmi3Instance i, fmi3FMUState state, size_t *size))
{
    UNUSED(i);
    UNUSED(state);
    *size = unit_bytes();
    return fmi3OK;
}

FUNCTION(fmi3Status, fmi3SerializeFMUState, (fmi3Instance i, fmi3FMUState state, fmi3Byte bytes[], size_t size))
{
    return status(unit_write(own(i), state, bytes, size, "fmi3SerializeFMUState"));
}

FUNCTION(fmi3Status, fmi3DeserializeFMUState, (fmi3Instance i, const fmi3Byte bytes[], size_t size, fmi3FMUState *state))
{
    return status(unit_read(own(i), bytes, size, state));
}

#define NO_DERIVATIVE(name)                                                                                                  \
    FUNCTION(fmi3Status, name,                                                                                               \
             (fmi3Instance i, const fmi3ValueReference unknown[], size_t unknowns, const fmi3ValueReference known[],         \
              size_t knowns, const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities))       \
    {                                                                                                                        \
        UNUSED(unknown);                                                                                                     \
        UNUSED(unknowns);                                                                                                    \
        UNUSED(known);                                                                                                       \
        UNUSED(knowns);                                                                                                      \
        UNUSED(seed);                                                                                                        \
        UNUSED(seeds);                                                                                                       \
        UNUSED(sensitivity);                                                                                                 \
        UNUSED(sensitivities);                                                                                               \
        return refused(i, #name);                                                                                            \
    }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

#define NO_CLOCKS(name, more)                                                                                                \
    FUNCTION(fmi3Status, name, more)                                                                                         \
    {                                                                                                                        \
        UNUSED(references);                                                                                                  \
        UNUSED(first);                                                                                                       \
        return count == 0 ? fmi3OK : refused(i, #name);                                                                      \
    }
#define NO_CLOCKS_2(name, more)                                                                                              \
    FUNCTION(fmi3Status, name, more)                                                                                         \
    {                                                                                                                        \
        UNUSED(references);                                                                                                  \
        UNUSED(first);                                                                                                       \
        UNUSED(second);                                                                                                      \
        return count == 0 ? fmi3OK : refused(i, #name);                                                                      \
    }
NO_CLOCKS_2(fmi3GetIntervalDecimal, (fmi3Instance i, const fmi3ValueReference references[], size_t count, fmi3Float64 first[],
                                     fmi3IntervalQualifier second[]))
NO_CLOCKS(fmi3GetShiftDecimal, (fmi3Instance i, const fmi3ValueReference references[], size_t count, fmi3Float64 first[]))
NO_CLOCKS_2(fmi3GetShiftFraction,
            (fmi3Instance i, const fmi3ValueReference references[], size_t count, uint64_t first[], uint64_t second[]))
NO_CLOCKS(fmi3SetIntervalDecimal, (fmi3Instance i, const fmi3ValueReference references[], size_t count, const fmi3Float64 first[]))
NO_CLOCKS_2(fmi3SetIntervalFraction,
            (fmi3Instance i, const fmi3ValueReference references[], size_t count, const uint64_t first[], const uint64_t second[]))
NO_CLOCKS(fmi3SetShiftDecimal, (fmi3Instance i, const fmi3ValueReference references[], size_t count, const fmi3Float64 first[]))
NO_CLOCKS_2(fmi3SetShiftFraction,
            (fmi3Instance i, const fmi3ValueReference references[], size_t count, const uint64_t first[], const uint64_t second[]))

FUNCTION(fmi3Status, fmi3GetIntervalFraction,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, uint64_t counters[], uint64_t resolutions[],
          fmi3IntervalQualifier qualifiers[]))
{
    UNUSED(references);
    UNUSED(counters);
    UNUSED(resolutions);
    UNUSED(qualifiers);
    return count == 0 ? fmi3OK : refused(i, "fmi3GetIntervalFraction");
}

FUNCTION(fmi3Status, fmi3EvaluateDiscreteStates, (fmi3Instance i)) { return refused(i, "fmi3EvaluateDiscreteStates"); }

FUNCTION(fmi3Status, fmi3UpdateDiscreteStates,
         (fmi3Instance i, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *next,
          fmi3Float64 *time))
{
    UNUSED(again);
    UNUSED(end);
    UNUSED(nominals);
    UNUSED(values);
    UNUSED(next);
    UNUSED(time);
    return refused(i, "fmi3UpdateDiscreteStates");
}

/* Of model exchange. */

FUNCTION(fmi3Status, fmi3EnterContinuousTimeMode, (fmi3Instance i)) { return refused(i, "fmi3EnterContinuousTimeMode"); }

FUNCTION(fmi3Status, fmi3CompletedIntegratorStep, (fmi3Instance i, fmi3Boolean no_earlier, fmi3Boolean *event, fmi3Boolean *end))
{
    UNUSED(no_earlier);
    UNUSED(event);
    UNUSED(end);
    return refused(i, "fmi3CompletedIntegratorStep");
}

FUNCTION(fmi3Status, fmi3SetTime, (fmi3Instance i, fmi3Float64 time))
{
    UNUSED(time);
    return refused(i, "fmi3SetTime");
}

FUNCTION(fmi3Status, fmi3SetContinuousStates, (fmi3Instance i, const fmi3Float64 values[], size_t count))
{
    UNUSED(values);
    UNUSED(count);
    return refused(i, "fmi3SetContinuousStates");
}

#define NO_STATES(name)                                                                                                      \
    FUNCTION(fmi3Status, name, (fmi3Instance i, fmi3Float64 values[], size_t count))                                         \
    {                                                                                                                        \
        UNUSED(values);                                                                                                      \
        UNUSED(count);                                                                                                       \
        return refused(i, #name);                                                                                            \
    }
NO_STATES(fmi3GetContinuousStateDerivatives)
NO_STATES(fmi3GetEventIndicators)
NO_STATES(fmi3GetContinuousStates)
NO_STATES(fmi3GetNominalsOfContinuousStates)

FUNCTION(fmi3Status, fmi3GetNumberOfEventIndicators, (fmi3Instance i, size_t *count))
{
    UNUSED(count);
    return refused(i, "fmi3GetNumberOfEventIndicators");
}

FUNCTION(fmi3Status, fmi3GetNumberOfContinuousStates, (fmi3Instance i, size_t *count))
{
    UNUSED(count);
    return refused(i, "fmi3GetNumberOfContinuousStates");
}

/* Of co-simulation. */

FUNCTION(fmi3Status, fmi3GetOutputDerivatives,
         (fmi3Instance i, const fmi3ValueReference references[], size_t count, const int32_t orders[], fmi3Float64 values[],
          size_t numbers))
{
    UNUSED(references);
    UNUSED(orders);
    UNUSED(values);
    UNUSED(numbers);
    return count == 0 ? fmi3OK : refused(i, "fmi3GetOutputDerivatives");
}

FUNCTION(fmi3Status, fmi3DoStep,
         (fmi3Instance i, fmi3Float64 time, fmi3Float64 seconds, fmi3Boolean no_earlier_state, fmi3Boolean *event, fmi3Boolean *end,
          fmi3Boolean *early, fmi3Float64 *reached))
{
    const fmi3Status result = status(unit_step(own(i), time, seconds));
    UNUSED(no_earlier_state);
    *event = *end = *early = false;
    *reached = own(i)->data.time;
    return result;
}

/* Of scheduled execution. */

FUNCTION(fmi3Status, fmi3ActivateModelPartition, (fmi3Instance i, fmi3ValueReference clock, fmi3Float64 time))
{
    UNUSED(clock);
    UNUSED(time);
    return refused(i, "fmi3ActivateModelPartition");
}
