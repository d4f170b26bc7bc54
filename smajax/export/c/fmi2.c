/* Functional mock-up interface 2.0 for co-simulation, of the standard's text: only what a slave has to have. */
#ifdef FMI2_FUNCTION_PREFIX
#define FUNCTION_PREFIX FMI2_FUNCTION_PREFIX
#endif
#include "unit.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    unit *own;
    char *name;
    const fmi2CallbackFunctions *callbacks;
    bool logging;
} component;

static void say(void *listener, const char *category, const char *message)
{
    const component *c = listener;
    if (c->callbacks != NULL && c->callbacks->logger != NULL) {
        c->callbacks->logger(c->callbacks->componentEnvironment, c->name, fmi2Error, category, "%s", message);
    }
}

static fmi2Status status(enum unit_result result)
{
    return result == UNIT_OK ? fmi2OK : fmi2Error;
}

static unit *own(fmi2Component c)
{
    return ((component *)c)->own;
}

FUNCTION(const char *, fmi2GetTypesPlatform, (void)) { return "default"; }

FUNCTION(const char *, fmi2GetVersion, (void)) { return "2.0"; }

FUNCTION(fmi2Status, fmi2SetDebugLogging, (fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]))
{
    UNUSED(count);
    UNUSED(categories);
    ((component *)c)->logging = on != 0;
    return fmi2OK;
}

FUNCTION(fmi2Component, fmi2Instantiate,
         (fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *callbacks,
          fmi2Boolean visible, fmi2Boolean logging))
{
    const size_t length = name == NULL ? 0 : strlen(name);
    component *c = calloc(1, sizeof *c);
    UNUSED(resources);
    UNUSED(visible);
    if (c == NULL) {
        return NULL;
    }
    c->callbacks = callbacks;
    c->logging = logging != 0;
    c->name = calloc(length + 1, 1);
    c->own = unit_new(say, c);
    if (c->name != NULL && length > 0) {
        memcpy(c->name, name, length);
    }
    if (c->name == NULL || c->own == NULL || type != fmi2CoSimulation || guid == NULL || strcmp(guid, UNIT_TOKEN) != 0) {
        if (c->own != NULL && c->name != NULL) {
            unit_failed(c->own, "the guid is another one than that of the model description, or the type is not co-simulation", "");
        }
        free(c->own);
        free(c->name);
        free(c);
        return NULL;
    }
    return c;
}

FUNCTION(void, fmi2FreeInstance, (fmi2Component c))
{
    if (c != NULL) {
        free(own(c));
        free(((component *)c)->name);
        free(c);
    }
}

FUNCTION(fmi2Status, fmi2SetupExperiment,
         (fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop))
{
    UNUSED(tolerance_defined);
    UNUSED(tolerance);
    UNUSED(stop_defined);
    UNUSED(stop);
    own(c)->data.time = start;
    return fmi2OK;
}

FUNCTION(fmi2Status, fmi2EnterInitializationMode, (fmi2Component c)) { return status(unit_begin(own(c), own(c)->data.time)); }

FUNCTION(fmi2Status, fmi2ExitInitializationMode, (fmi2Component c)) { return status(unit_initialised(own(c))); }

FUNCTION(fmi2Status, fmi2Terminate, (fmi2Component c))
{
    own(c)->data.mode = UNIT_ENDED;
    return fmi2OK;
}

FUNCTION(fmi2Status, fmi2Reset, (fmi2Component c))
{
    unit_reset(own(c));
    return fmi2OK;
}

FUNCTION(fmi2Status, fmi2GetReal, (fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[]))
{
    return status(unit_get(own(c), references, count, values));
}

FUNCTION(fmi2Status, fmi2SetReal, (fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[]))
{
    return status(unit_set(own(c), references, count, values));
}

/* There are no variables of these types, and no derivatives: asked for none it is well, asked for one it is an error. */
#define NO_VARIABLES(name, type)                                                                                             \
    FUNCTION(fmi2Status, name, (fmi2Component c, const fmi2ValueReference references[], size_t count, type values[]))        \
    {                                                                                                                        \
        UNUSED(references);                                                                                                  \
        UNUSED(values);                                                                                                      \
        return count == 0 ? fmi2OK : status(unit_failed(own(c), "there are real variables alone", #name));                   \
    }
NO_VARIABLES(fmi2GetInteger, fmi2Integer)
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetInteger, const fmi2Integer)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)

FUNCTION(fmi2Status, fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *state))
{
    return status(unit_save(own(c), state));
}

FUNCTION(fmi2Status, fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate state))
{
    return status(unit_restore(own(c), state, "fmi2SetFMUstate"));
}

FUNCTION(fmi2Status, fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *state))
{
    UNUSED(c);
    unit_forget(state);
    return fmi2OK;
}

FUNCTION(fmi2Status, fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size))
{
    UNUSED(c);
    UNUSED(state);
    *size = unit_bytes();
    return fmi2OK;
}

FUNCTION(fmi2Status, fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size))
{
    return status(unit_write(own(c), state, (uint8_t *)bytes, size, "fmi2SerializeFMUstate"));
}

FUNCTION(fmi2Status, fmi2DeSerializeFMUstate, (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state))
{
    return status(unit_read(own(c), (const uint8_t *)bytes, size, state));
}

FUNCTION(fmi2Status, fmi2GetDirectionalDerivative,
         (fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[], size_t knowns,
          const fmi2Real seed[], fmi2Real sensitivity[]))
{
    UNUSED(unknown);
    UNUSED(unknowns);
    UNUSED(known);
    UNUSED(knowns);
    UNUSED(seed);
    UNUSED(sensitivity);
    return status(unit_failed(own(c), "there are none", "fmi2GetDirectionalDerivative"));
}

FUNCTION(fmi2Status, fmi2SetRealInputDerivatives,
         (fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer order[], const fmi2Real values[]))
{
    UNUSED(references);
    UNUSED(order);
    UNUSED(values);
    return count == 0 ? fmi2OK : status(unit_failed(own(c), "inputs are held over a step", "fmi2SetRealInputDerivatives"));
}

FUNCTION(fmi2Status, fmi2GetRealOutputDerivatives,
         (fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer order[], fmi2Real values[]))
{
    UNUSED(references);
    UNUSED(order);
    UNUSED(values);
    return count == 0 ? fmi2OK : status(unit_failed(own(c), "there are none", "fmi2GetRealOutputDerivatives"));
}

FUNCTION(fmi2Status, fmi2DoStep, (fmi2Component c, fmi2Real time, fmi2Real seconds, fmi2Boolean no_earlier_state))
{
    UNUSED(no_earlier_state);
    return status(unit_step(own(c), time, seconds));
}

FUNCTION(fmi2Status, fmi2CancelStep, (fmi2Component c)) { return status(unit_failed(own(c), "a step never pends", "fmi2CancelStep")); }

FUNCTION(fmi2Status, fmi2GetStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Status *value))
{
    UNUSED(c);
    UNUSED(kind);
    *value = fmi2OK;
    return fmi2Discard;
}

FUNCTION(fmi2Status, fmi2GetRealStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Real *value))
{
    *value = own(c)->data.time;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

FUNCTION(fmi2Status, fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value))
{
    UNUSED(c);
    UNUSED(kind);
    *value = 0;
    return fmi2Discard;
}

FUNCTION(fmi2Status, fmi2GetBooleanStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value))
{
    UNUSED(c);
    *value = 0;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

FUNCTION(fmi2Status, fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2String *value))
{
    UNUSED(c);
    UNUSED(kind);
    *value = "";
    return fmi2Discard;
}
