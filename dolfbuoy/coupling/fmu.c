/* Functions of FMI 3.0 for co-simulation, by those of dolfbuoy.h.  layout.h: made for every FMU by fmu.py.

   Numbers of variables: time, extrapolation, x of all that is driven, f of all that is driven, of each free buoy its load
   (6) and its motion (13), tension_top and tension_anchor of each cable. */

#include "dolfbuoy.h"
#include "layout.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

typedef enum {OK, WARNING, DISCARD, ERROR, FATAL} status;
typedef void log_function(void *environment, status, const char *category, const char *message);

enum {TIME, EXTRAPOLATION, X, F = X + OF_X, BUOY = F + OF_F, TENSION = BUOY + 19 * BUOYS, COUNT = TENSION + 2 * CABLES};
enum {LOAD = 6, MOTION = 13, KNOWN = 3};

typedef struct {                /* what an FMU state has besides the session's own */
    double start, t;            /* FMI's time when the session began; the session's */
    int32_t extrapolation;
    double values[COUNT];
    bool loaded, stale;         /* loads were set; values of what is read are those of an earlier instant */
    int inputs;                 /* how many there were until now, KNOWN at most; the latest first: */
    double at[KNOWN], x[KNOWN][OF_X + 1];
    int number;                 /* of the session's state */
} instant;

typedef struct {
    dolfbuoy *session;
    char *scene;
    void *environment;
    log_function *log;
    instant now;
    bool open;                  /* the session is */
} component;

static status judged(component *c, int code)
{
    if (!code)
        return OK;
    if (c->log)
        c->log(c->environment, ERROR, "logStatusError", dolfbuoy_message(c->session));
    return ERROR;
}

static status read_outputs(component *c)
{
    double *values = c->now.values;
    int code = 0;
    if (!c->now.stale)
        return OK;
    for (int k = 0; k < BUOYS && !code; ++k)
        code = dolfbuoy_state(c->session, FREE_BUOYS[k], values + BUOY + 19 * k + LOAD);
    if (CABLES && !code)
        code = dolfbuoy_values(c->session, "tension_top", values + TENSION, CABLES);
    if (CABLES && !code)
        code = dolfbuoy_values(c->session, "tension_anchor", values + TENSION + CABLES, CABLES);
    c->now.stale = code != 0;
    return judged(c, code);
}

/* Inputs at t and before are what is known; the place at t + h is on the line or parabola through them. */
static void extrapolate(instant *now, double h, double *x)
{
    const int degree = now->extrapolation < now->inputs ? now->extrapolation : now->inputs - 1;
    memcpy(x, now->x[0], OF_X * sizeof *x);
    for (int k = 0; k <= degree && degree; ++k) {
        double weight = 1;
        for (int j = 0; j <= degree; ++j)
            weight *= j == k ? 1 : (now->t + h - now->at[j]) / (now->at[k] - now->at[j]);
        for (int i = 0; i < OF_X; ++i)
            x[i] = (k ? x[i] : 0) + weight * now->x[k][i];
    }
}

static void keep_inputs(instant *now)
{
    for (int k = KNOWN - 1; k > 0; --k) {
        now->at[k] = now->at[k - 1];
        memcpy(now->x[k], now->x[k - 1], sizeof now->x[k]);
    }
    now->at[0] = now->t;
    memcpy(now->x[0], now->values + X, OF_X * sizeof(double));
    now->inputs += now->inputs < KNOWN;
}

/* -- life ----------------------------------------------------------------------------------------------------------- */

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool events, bool early, const uint32_t *intermediate,
                                         size_t count, void *environment, log_function *log, void *update)
{
    component *c = calloc(1, sizeof *c);
    const size_t length = resources ? strlen(resources) : 0;
    (void)name, (void)visible, (void)logging, (void)early, (void)intermediate, (void)count, (void)update;
    if (!c || strcmp(token, TOKEN) || events || !length || !(c->scene = malloc(length + sizeof "/scene.toml"))) {
        if (log)
            log(environment, ERROR, "logStatusError", "not the token or the resources of this FMU, or events are asked for");
        free(c);
        return NULL;
    }
    sprintf(c->scene, "%s%sscene.toml", resources, resources[length - 1] == '/' ? "" : "/");
    c->environment = environment;
    c->log = log;
    c->now.extrapolation = 1;
    memcpy(c->now.values + X, STARTS, OF_X * sizeof(double));
    c->session = dolfbuoy_create(c->scene);
    return c;
}

EXPORT void fmi3FreeInstance(component *c)
{
    if (!c)
        return;
    dolfbuoy_close(c->session);
    free(c->scene);
    free(c);
}

EXPORT status fmi3Reset(component *c)
{
    const status found = judged(c, dolfbuoy_close(c->session));
    memset(&c->now, 0, sizeof c->now);
    c->open = false;
    c->now.extrapolation = 1;
    memcpy(c->now.values + X, STARTS, OF_X * sizeof(double));
    c->session = dolfbuoy_create(c->scene);
    return found;
}

static int open_session(component *c)
{
    int code = 0;
    double before[OF_X + 1];
    if (c->open)
        return 0;
    memcpy(before, c->now.values + X, OF_X * sizeof *before);
    for (int k = 0; k < DRIVEN_COUNT && !code; ++k)
        code = dolfbuoy_drive(c->session, DRIVEN[k]);
    code = code ? code : dolfbuoy_init(c->session);
    code = code ? code : dolfbuoy_now(c->session, &c->now.t, before, c->now.values + F);
    c->open = !code;
    return code;
}

EXPORT status fmi3EnterInitializationMode(component *c, bool tolerant, double tolerance, double start, bool ends, double end)
{
    const int code = open_session(c);
    (void)tolerant, (void)tolerance, (void)ends, (void)end;
    c->now.start = start - c->now.t;
    c->now.stale = true;
    return judged(c, code);
}

EXPORT status fmi3ExitInitializationMode(component *c)
{
    (void)c;
    return OK;
}

EXPORT status fmi3EnterStepMode(component *c)
{
    (void)c;
    return OK;
}

EXPORT status fmi3Terminate(component *c)
{
    (void)c;
    return OK;
}

EXPORT status fmi3SetDebugLogging(component *c, bool on, size_t count, const char *const *categories)
{
    (void)c, (void)on, (void)count, (void)categories;
    return OK;
}

/* -- numbers -------------------------------------------------------------------------------------------------------- */

EXPORT status fmi3GetFloat64(component *c, const uint32_t *variables, size_t count, double *values, size_t sizes)
{
    (void)sizes;
    for (size_t k = 0; k < count; ++k) {
        const uint32_t v = variables[k];
        if (v == EXTRAPOLATION || v >= COUNT || (v >= BUOY && read_outputs(c) != OK))
            return ERROR;
        values[k] = v == TIME ? c->now.start + c->now.t : c->now.values[v];
    }
    return OK;
}

EXPORT status fmi3SetFloat64(component *c, const uint32_t *variables, size_t count, const double *values, size_t sizes)
{
    (void)sizes;
    for (size_t k = 0; k < count; ++k) {
        const uint32_t v = variables[k];
        const bool place = v >= X && v < F, load = v >= BUOY && v < TENSION && (v - BUOY) % 19 < LOAD;
        if (!place && !load)
            return ERROR;
        c->now.values[v] = values[k];
        c->now.loaded = c->now.loaded || load;
    }
    return OK;
}

EXPORT status fmi3GetInt32(component *c, const uint32_t *variables, size_t count, int32_t *values, size_t sizes)
{
    (void)sizes;
    for (size_t k = 0; k < count; ++k) {
        if (variables[k] != EXTRAPOLATION)
            return ERROR;
        values[k] = c->now.extrapolation;
    }
    return OK;
}

EXPORT status fmi3SetInt32(component *c, const uint32_t *variables, size_t count, const int32_t *values, size_t sizes)
{
    (void)sizes;
    for (size_t k = 0; k < count; ++k) {
        if (variables[k] != EXTRAPOLATION || values[k] < 0 || values[k] >= KNOWN)
            return ERROR;
        c->now.extrapolation = values[k];
    }
    return OK;
}

EXPORT status fmi3DoStep(component *c, double t, double h, bool kept, bool *event, bool *end, bool *early, double *last)
{
    double x[OF_X + 1];
    int code = 0;
    (void)kept;
    *event = *end = *early = false;
    *last = c->now.start + c->now.t;
    if (fabs(t - *last) > 1e-6 * h) {
        if (c->log)
            c->log(c->environment, ERROR, "logStatusError", "currentCommunicationPoint is not the time that was reached");
        return ERROR;
    }
    const instant before = c->now;
    keep_inputs(&c->now);
    extrapolate(&c->now, h, x);
    for (int k = 0; k < BUOYS && c->now.loaded && !code; ++k) {
        const double *load = c->now.values + BUOY + 19 * k;
        code = dolfbuoy_load(c->session, FREE_BUOYS[k], load, load + 3);
    }
    code = code ? code : dolfbuoy_step(c->session, x, NULL, c->now.values + F, &c->now.t, h);
    if (code)                   /* inputs that it failed with are none to go on from */
        c->now = before;
    c->now.stale = true;
    *last = c->now.start + c->now.t;
    return judged(c, code);
}

/* -- states --------------------------------------------------------------------------------------------------------- */

EXPORT status fmi3FreeFMUState(component *c, void **state)
{
    instant *kept = *state;
    const status found = kept ? judged(c, dolfbuoy_forget(c->session, kept->number)) : OK;
    free(kept);
    *state = NULL;
    return found;
}

EXPORT status fmi3GetFMUState(component *c, void **state)
{
    int code;
    instant *kept = *state;
    if (kept)
        dolfbuoy_forget(c->session, kept->number);
    else if (!(kept = *state = malloc(sizeof *kept)))
        return ERROR;
    *kept = c->now;
    code = dolfbuoy_save(c->session, &kept->number);
    if (code) {
        free(kept);
        *state = NULL;
    }
    return judged(c, code);
}

EXPORT status fmi3SetFMUState(component *c, const void *state)
{
    c->now = *(const instant *)state;
    return judged(c, dolfbuoy_restore(c->session, c->now.number));
}

/* As bytes: the instant, then the session's own; of the same FMU on the same kind of machine. */

EXPORT status fmi3SerializedFMUStateSize(component *c, const void *state, size_t *size)
{
    const int code = dolfbuoy_pack(c->session, ((const instant *)state)->number, NULL, size);
    *size += sizeof(instant);
    return judged(c, code);
}

EXPORT status fmi3SerializeFMUState(component *c, const void *state, uint8_t *bytes, size_t size)
{
    const instant *kept = state;
    size_t room = size - sizeof *kept;
    if (size < sizeof *kept)
        return ERROR;
    memcpy(bytes, kept, sizeof *kept);
    return judged(c, dolfbuoy_pack(c->session, kept->number, bytes + sizeof *kept, &room));
}

EXPORT status fmi3DeserializeFMUState(component *c, const uint8_t *bytes, size_t size, void **state)
{
    int code = size < sizeof(instant) ? -1 : open_session(c), number = 0;
    instant *kept = *state;
    code = code ? code : dolfbuoy_unpack(c->session, bytes + sizeof *kept, size - sizeof *kept, &number);
    if (code)
        return judged(c, code);
    if (kept)
        dolfbuoy_forget(c->session, kept->number);
    else if (!(kept = *state = malloc(sizeof *kept)))
        return ERROR;
    memcpy(kept, bytes, sizeof *kept);
    kept->number = number;
    return kept->inputs < 0 || kept->inputs > KNOWN || kept->extrapolation < 0 || kept->extrapolation >= KNOWN ? ERROR : OK;
}

/* -- what there is nothing of --------------------------------------------------------------------------------------- */

#define ABSENT(name) EXPORT status fmi3##name(void) { return ERROR; }
#define NOTHING(name) EXPORT void *fmi3##name(void) { return NULL; }
#define EITHER(kind) ABSENT(Get##kind) ABSENT(Set##kind)

NOTHING(InstantiateModelExchange)
NOTHING(InstantiateScheduledExecution)
EITHER(Float32) EITHER(Int8) EITHER(UInt8) EITHER(Int16) EITHER(UInt16) EITHER(UInt32) EITHER(Int64) EITHER(UInt64)
EITHER(Boolean) EITHER(String) EITHER(Binary) EITHER(Clock)
EITHER(IntervalDecimal) EITHER(IntervalFraction) EITHER(ShiftDecimal) EITHER(ShiftFraction)
ABSENT(EnterEventMode) ABSENT(EnterConfigurationMode) ABSENT(ExitConfigurationMode)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetVariableDependencies)
ABSENT(GetDirectionalDerivative) ABSENT(GetAdjointDerivative) ABSENT(GetOutputDerivatives)
ABSENT(EvaluateDiscreteStates) ABSENT(UpdateDiscreteStates) ABSENT(ActivateModelPartition)
ABSENT(EnterContinuousTimeMode) ABSENT(CompletedIntegratorStep) ABSENT(SetTime) ABSENT(SetContinuousStates)
ABSENT(GetContinuousStateDerivatives) ABSENT(GetEventIndicators) ABSENT(GetContinuousStates)
ABSENT(GetNominalsOfContinuousStates) ABSENT(GetNumberOfEventIndicators) ABSENT(GetNumberOfContinuousStates)
