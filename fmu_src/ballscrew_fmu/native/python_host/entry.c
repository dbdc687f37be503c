/* Entry library of the FMU for Python hosts, FMI 2.0 co-simulation: checks what the library of pythonfmu 0.7 does not,
   then passes every call on to it.

   pythonfmu decodes nothing but %20 in the URI of the resources and ends the host if it finds no script there; it
   accepts any GUID and model exchange; it passes messages to the logger as formats and categories as NULL; Python code
   cannot return fmi2Error through it. So unknown references, variables that cannot be set and damaged states are
   refused here, with the messages of the native FMU; after an error the instance has to be reset, or a state restored.
   Its library is in the same folder under its own name. An instance holds the addresses of its functions, so that there
   is no global data except the constant table of variables. */
#define _GNU_SOURCE /* dladdr */
#include "fmi2Functions.h"

#include <math.h>

#include "platform.h"
#include "text.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standard fixes the arguments */
#endif

typedef struct {
    const char *name;
    bool boolean;
    enum { NEVER, INITIALLY, ALWAYS } settable;
} Variable;

#include "entry_table.h" /* generated: TOO_LARGE, variables by value reference from FIRST_REFERENCE */

#define VARIABLE_COUNT (sizeof variables / sizeof variables[0])

/* Phase of the slave, as in slave_base.py: its Integer of this reference, which no variable has */
#define PHASE_REFERENCE 0U
enum { INITIALIZING, STEPPING, ENDED, UNUSABLE };
static const char *const phases[] = {"Initialization Mode", "Step Mode", "Terminated", "Error"};

#define TOKEN_FILE "guid.txt" /* in the resources: the GUID of the model description they belong to */
#define SCRIPT_FILE "slavemodule.txt"
#define LONGEST_TOKEN 127

#define CALLS(X)                                                                                        \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode)     \
    X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(GetInteger) X(GetBoolean) X(GetString) \
    X(SetReal) X(SetInteger) X(SetBoolean) X(SetString) X(GetFMUstate) X(SetFMUstate) X(FreeFMUstate)   \
    X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate) X(GetDirectionalDerivative)   \
    X(SetRealInputDerivatives) X(GetRealOutputDerivatives) X(DoStep) X(CancelStep) X(GetRealStatus)
#define AS_POINTER(name) fmi2##name##TYPE *name;

typedef struct {
    CALLS(AS_POINTER)
} Calls;

typedef struct {
    fmi2Component slave; /* of pythonfmu */
    Calls calls;
    fmi2CallbackFunctions callbacks; /* given to pythonfmu, which keeps their address */
    fmi2CallbackLogger logger;       /* of the importer; NULL: none */
    fmi2ComponentEnvironment environment;
    const char *call; /* current call, for messages */
    unsigned logged;  /* bit per status */
    double stop;      /* [s] infinity: not defined */
    bool failed;      /* state "error" of the standard: a call was refused */
    char reason[1200]; /* why there is no instance */
    char name[1];     /* of the instance */
} Entry;

/* --- messages ---------------------------------------------------------------------------------------------------- */

/* Category of a message that is logged without debug logging too: slave_base.py. */
#define UNFILTERED "always"

/* Logger of pythonfmu. */
static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String message, ...)
{
    const Entry *entry = environment;
    char format[2048];

    const bool always = category != NULL && strcmp(category, UNFILTERED) == 0;

    if (entry->logger == NULL || message == NULL || !(always || (entry->logged >> status & 1U) != 0U)) {
        return;
    }
    format_of(message, format, sizeof format);
    if (always || category == NULL || category[0] == '\0') {
        category = log_categories[(unsigned)status < CATEGORIES ? status : 0];
    }
    entry->logger(entry->environment, name, status, category, format);
}

/* Refuses a call of an instance. */
static fmi2Status fail(Entry *entry, const char *format, ...)
{
    char message[512];
    va_list arguments;

    va_start(arguments, format);
    write_message(message, sizeof message, entry->call, format, arguments);
    va_end(arguments);
    log_message(entry, entry->name, fmi2Error, log_categories[fmi2Error], message);
    entry->failed = true;
    return fmi2Error;
}

/* False, with the reason why there is no instance. */
static bool reject(Entry *entry, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(entry->reason, sizeof entry->reason, format, arguments);
    va_end(arguments);
    return false;
}

/* --- library of pythonfmu ---------------------------------------------------------------------------------------- */

static bool load(Entry *entry)
{
    char error[300];
    void *const library = open_library(error, sizeof error);
    const char *missing = library == NULL ? error : NULL;

#define LOAD(name)                                                                   \
    if (missing == NULL) {                                                           \
        entry->calls.name = (fmi2##name##TYPE *)function_of(library, "fmi2" #name);  \
        missing = entry->calls.name == NULL ? "fmi2" #name " not found" : NULL;      \
    }
    CALLS(LOAD)
    /* never closed: it stays loaded until the process ends */
    return missing == NULL
           || reject(entry,
                     "needs a host that runs Python, see documentation/externalDependencies.txt; elsewhere use the "
                     "native FMU. " LIBRARY ": %s", missing);
}

/* --- interface --------------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

/* Path of the resources for Python, in place of theirs, whose GUID must be this one. False, with the reason. */
static bool find_resources(Entry *entry, char *folder, const char *guid, const char *uri)
{
    char token[LONGEST_TOKEN + 1];
    size_t length = strlen(folder);

    while (length > 1 && (folder[length - 1] == '/' || folder[length - 1] == '\\')) {
        folder[--length] = '\0';
    }
    /* in brackets: not the macro of C11 that some libraries have */
    if (!is_utf8(folder) || readable_path(folder) == NULL || (strstr)(folder, "%20") != NULL
        || (strstr)(folder, "file://") != NULL) {
        return reject(entry,
                      "Python cannot be given this folder of resources; unpack the FMU below a path without %%20 and "
                      "with characters that the system can name in UTF-8: %.900s", uri);
    }
    if (!first_line(folder, SCRIPT_FILE, token, (int)sizeof token)
        || !first_line(folder, TOKEN_FILE, token, (int)sizeof token)) {
        return reject(entry, "no resources of this FMU in %.1000s", uri);
    }
    return (guid != NULL && strcmp(guid, token) == 0)
           || reject(entry, "GUID is %.100s, the resources have %s: they belong to different FMUs",
                     guid != NULL ? guid : "NULL", token);
}

/* Makes the slave of pythonfmu. False, with the reason, which is empty if pythonfmu has logged it. */
static bool make_slave(Entry *entry, fmi2Type type, fmi2String guid, fmi2String uri, fmi2Boolean visible)
{
    char *folder;

    if (is_blank(entry->name)) {
        return reject(entry, "instance name is empty; needs a name");
    }
    if (type != fmi2CoSimulation) {
        return reject(entry, "this FMU is for co-simulation only");
    }
    if (uri == NULL) {
        return reject(entry, "location of the resources is NULL");
    }
    folder = calloc(1, strlen(uri) + 1);
    if (folder == NULL) {
        return reject(entry, "not enough memory");
    }
    path_of_uri(uri, folder);
    if (find_resources(entry, folder, guid, uri) && load(entry)) {
        entry->slave =
            entry->calls.Instantiate(entry->name, type, guid, folder, &entry->callbacks, visible, fmi2True);
    }
    free(folder);
    return entry->slave != NULL;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    Entry *entry = calloc(1, sizeof *entry + (instanceName != NULL ? strlen(instanceName) : 0));

    if (entry == NULL) {
        return NULL;
    }
    strcpy(entry->name, instanceName != NULL ? instanceName : "");
    entry->logged = loggingOn != fmi2False ? ALL_CATEGORIES : PROBLEMS;
    entry->stop = HUGE_VAL;
    if (functions != NULL) {
        entry->callbacks = *functions;
        entry->logger = functions->logger;
        entry->environment = functions->componentEnvironment;
    }
    entry->callbacks.logger = log_message;
    entry->callbacks.componentEnvironment = entry;
    if (make_slave(entry, fmuType, fmuGUID, fmuResourceLocation, visible)) {
        return entry;
    }
    if (entry->reason[0] != '\0') {
        log_message(entry, entry->name, fmi2Error, log_categories[fmi2Error], entry->reason);
    }
    free(entry);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    Entry *entry = c;

    if (entry != NULL) {
        entry->calls.FreeInstance(entry->slave);
        free(entry);
    }
}

/* --- calls that are passed on ------------------------------------------------------------------------------------ */

#define BEGIN(name)             \
    Entry *const entry = c;     \
    if (entry == NULL) {        \
        return fmi2Error;       \
    }                           \
    entry->call = "fmi2" #name;
/* After an error: until it is reset, or a state is restored. */
#define BEGIN_GOOD(name)                                                                                 \
    BEGIN(name)                                                                                          \
    if (entry->failed) {                                                                                 \
        return fail(entry, "called in Error; legal after fmi2Reset or when an FMU state is restored");   \
    }
#define FORWARD(begin, name, parameters, ...)                \
    fmi2Status fmi2##name parameters                         \
    {                                                        \
        begin(name)                                          \
        return entry->calls.name(entry->slave, __VA_ARGS__); \
    }
#define FORWARD_PLAIN(name)                     \
    fmi2Status fmi2##name(fmi2Component c)      \
    {                                           \
        BEGIN_GOOD(name)                        \
        return entry->calls.name(entry->slave); \
    }

FORWARD_PLAIN(EnterInitializationMode)
FORWARD_PLAIN(ExitInitializationMode)
FORWARD_PLAIN(Terminate)
FORWARD_PLAIN(CancelStep)
FORWARD(BEGIN, GetDirectionalDerivative,
        (fmi2Component c, const fmi2ValueReference unknown[], size_t nUnknown, const fmi2ValueReference known[],
         size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[]),
        unknown, nUnknown, known, nKnown, dvKnown, dvUnknown)
FORWARD(BEGIN, SetRealInputDerivatives,
        (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], const fmi2Real value[]),
        vr, nvr, order, value)
FORWARD(BEGIN, GetRealOutputDerivatives,
        (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], fmi2Real value[]), vr,
        nvr, order, value)
FORWARD(BEGIN, GetRealStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Real *value), s, value)

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    BEGIN_GOOD(SetupExperiment)
    entry->stop = stopTimeDefined != fmi2False ? stopTime : HUGE_VAL;
    return entry->calls.SetupExperiment(entry->slave, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime);
}

/* pythonfmu logs all: log_message selects. */
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String names[])
{
    const char *unknown_name;
    char message[200];

    BEGIN(SetDebugLogging)
    if (nCategories > 0 && names == NULL) {
        return fail(entry, "an array is a NULL pointer");
    }
    unknown_name = categories_mask(loggingOn != fmi2False, nCategories, names, &entry->logged);
    if (unknown_name == NULL) {
        return fmi2OK;
    }
    (void)snprintf(message, sizeof message, "log category %.80s is unknown and has no effect", unknown_name);
    log_message(entry, entry->name, fmi2Warning, UNFILTERED, message);
    return fmi2Warning;
}

/* The limits are those of the native FMU. */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real step, fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    char text[32], other[32];

    BEGIN_GOOD(DoStep)
    if (!(fabs(point) < TOO_LARGE && step >= 0.0 && step < TOO_LARGE)) {
        return fail(entry, "communication point = %s s, step size = %s s; needs finite numbers, step size >= 0",
                    number_text(point, text), number_text(step, other));
    }
    if (point + step > entry->stop + 1e-3 * step + 1e-15 * fabs(point)) {
        fail(entry, "step ends at %s s, beyond the stop time %s s: not done", number_text(point + step, text),
             number_text(entry->stop, other));
        entry->failed = false; /* the instance is as before */
        return fmi2Error;
    }
    return entry->calls.DoStep(entry->slave, point, step, noSetFMUStatePriorToCurrentPoint);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    BEGIN(Reset)
    entry->failed = false;
    entry->stop = HUGE_VAL;
    return entry->calls.Reset(entry->slave);
}

/* --- values ------------------------------------------------------------------------------------------------------ */

static int phase_of(const Entry *entry)
{
    const fmi2ValueReference reference = PHASE_REFERENCE;
    fmi2Integer phase = UNUSABLE;

    return entry->calls.GetInteger(entry->slave, &reference, 1, &phase) == fmi2OK ? phase : UNUSABLE;
}

/* A fixed parameter may be set to the value that it has, as in the native FMU. */
static bool can_be_set(const Entry *entry, const Variable *variable, fmi2ValueReference reference, fmi2Real value)
{
    const int phase = phase_of(entry);
    fmi2Real present;

    return variable->settable == ALWAYS
           || (variable->settable == INITIALLY
               && (phase == INITIALIZING
                   || (phase == STEPPING && entry->calls.GetReal(entry->slave, &reference, 1, &present) == fmi2OK
                       && present == value)));
}

/* Whether all references are those of variables that the call may get or set. A Boolean may be read as Real, as in the
   native FMU. */
static fmi2Status check(Entry *entry, const char *type, bool sets, const fmi2ValueReference vr[],
                        size_t nvr, const void *value)
{
    const bool real = strcmp(type, "Real") == 0, boolean = strcmp(type, "Boolean") == 0;

    if (nvr > 0 && (vr == NULL || value == NULL)) {
        return fail(entry, "an array is a NULL pointer");
    }
    for (size_t i = 0; i < nvr; ++i) {
        const size_t index = vr[i] - FIRST_REFERENCE; /* wraps around below the first */
        const Variable *variable = index < VARIABLE_COUNT ? &variables[index] : NULL;
        if (variable == NULL || !(variable->boolean ? boolean || (real && !sets) : real)) {
            return fail(entry, "no %s%s variable has value reference %u", sets ? "settable " : "", type, vr[i]);
        }
        if (sets && !can_be_set(entry, variable, vr[i], real ? ((const fmi2Real *)value)[i] : 0.0)) {
            return fail(entry, "%s cannot be set in %s", variable->name, phases[phase_of(entry)]);
        }
    }
    return fmi2OK;
}

#define VALUES(name, begin, type, sets, modifier)                                                                     \
    fmi2Status fmi2##name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, modifier fmi2##type value[])    \
    {                                                                                                                 \
        begin(name)                                                                                                   \
        if (check(entry, #type, sets, vr, nvr, (const void *)value) != fmi2OK) {                        \
            return fmi2Error;                                                                                         \
        }                                                                                                             \
        return nvr == 0 ? fmi2OK : entry->calls.name(entry->slave, vr, nvr, value);                                   \
    }
VALUES(GetReal, BEGIN, Real, false, )
VALUES(GetInteger, BEGIN, Integer, false, )
VALUES(GetBoolean, BEGIN, Boolean, false, )
VALUES(GetString, BEGIN, String, false, )
VALUES(SetReal, BEGIN_GOOD, Real, true, const)
VALUES(SetInteger, BEGIN_GOOD, Integer, true, const)
VALUES(SetBoolean, BEGIN_GOOD, Boolean, true, const)
VALUES(SetString, BEGIN_GOOD, String, true, const)

/* --- saved states ------------------------------------------------------------------------------------------------ */

#define BEGIN_STATE(name, missing)                                                      \
    BEGIN(name)                                                                         \
    if (missing) {                                                                      \
        return fail(entry, "FMU state or an argument is a NULL pointer");         \
    }

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    BEGIN_STATE(GetFMUstate, FMUstate == NULL)
    return entry->calls.GetFMUstate(entry->slave, FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    BEGIN_STATE(SerializedFMUstateSize, FMUstate == NULL || size == NULL)
    return entry->calls.SerializedFMUstateSize(entry->slave, FMUstate, size);
}

/* pythonfmu fills the whole length, whatever room there is. */
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte bytes[], size_t size)
{
    size_t length = 0;

    BEGIN_STATE(SerializeFMUstate, FMUstate == NULL || bytes == NULL)
    if (entry->calls.SerializedFMUstateSize(entry->slave, FMUstate, &length) != fmi2OK || size != length) {
        return fail(entry, "room for %lu bytes; the state has another size", (unsigned long)size);
    }
    return entry->calls.SerializeFMUstate(entry->slave, FMUstate, bytes, size);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    fmi2Status status = fmi2OK;

    BEGIN(FreeFMUstate)
    if (FMUstate != NULL && *FMUstate != NULL) {
        status = entry->calls.FreeFMUstate(entry->slave, FMUstate);
        *FMUstate = NULL;
    }
    return status;
}

/* The slave logs why it cannot use a state, and is unusable from then on. */
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    fmi2Status status;

    BEGIN_STATE(SetFMUstate, FMUstate == NULL)
    status = entry->calls.SetFMUstate(entry->slave, FMUstate);
    entry->failed = status != fmi2OK || phase_of(entry) == UNUSABLE;
    return entry->failed ? fmi2Error : fmi2OK;
}

/* What the slave cannot read is a state of no bytes. */
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *FMUstate)
{
    fmi2FMUstate state = NULL;
    size_t length = 0;

    BEGIN_STATE(DeSerializeFMUstate, bytes == NULL || FMUstate == NULL)
    if (entry->calls.DeSerializeFMUstate(entry->slave, bytes, size, &state) != fmi2OK
        || entry->calls.SerializedFMUstateSize(entry->slave, state, &length) != fmi2OK || length == 0) {
        if (state != NULL) {
            (void)entry->calls.FreeFMUstate(entry->slave, &state);
        }
        return fail(entry, "serialized FMU state of %lu bytes is damaged or not of this FMU",
                    (unsigned long)size);
    }
    *FMUstate = state;
    return fmi2OK;
}

/* As in the native FMU. */
#define NO_STATUS(name, type)                                                               \
    fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind s, type *value)          \
    {                                                                                       \
        return fmi2Discard;                                                                 \
    }
NO_STATUS(Status, fmi2Status)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)
