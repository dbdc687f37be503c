/* External functions of the Modelica package, on the model of the native FMUs (model.h): inputs are set, the point is
   latched, results are read. */
#define _POSIX_C_SOURCE 200809L /* of file.c, */
#define _DARWIN_C_SOURCE        /* on macOS */
#include "BallScrewFriction.h"

#include <math.h>
#include <stdlib.h>

#include "file.c"
#include "map.c"
#include "model.c"

/* of the Modelica tool (ModelicaUtilities.h); does not return */
void ModelicaFormatError(const char *format, ...);

typedef struct {
    Map *map;
    Model model;
} Handle;

typedef struct {
    int reference;
    double value;
} Setting;

/* Bring the model to a point. Model exchange without presliding and regularization: friction parts have their magnitude
   at positive speed. */
static Model *at(void *map, size_t count, const Setting settings[])
{
    Model *model = &((Handle *)map)->model;

    for (size_t i = 0; i < count; ++i) {
        const Setting s = settings[i];
        if (!model_accepts(s.reference, s.value)) {
            ModelicaFormatError("BallScrewFriction: %s = %g; needs a finite number, not below %g\n",
                                model_variables[s.reference].name, s.value, model_variables[s.reference].lowest);
        }
        model_set(model, s.reference, s.value);
    }
    model_latch(model);
    return model;
}

void *ballScrewMap_open(const char *fileName)
{
    char message[1024];
    double start[VARIABLE_COUNT] = {0.0};
    Handle *handle = calloc(1, sizeof *handle);

    if (handle == NULL) {
        ModelicaFormatError("BallScrewFriction: no memory\n");
        return NULL;
    }
    handle->map = map_read(fileName, ANY_LAW, message, sizeof message);
    if (handle->map == NULL) {
        free(handle);
        ModelicaFormatError("BallScrewFriction: %s\n", message);
        return NULL;
    }
    friction_of_map(handle->map, start);
    model_reset(&handle->model, handle->map, start, true);
    return handle;
}

void ballScrewMap_close(void *map)
{
    Handle *handle = map;

    if (handle != NULL) {
        map_free(handle->map);
        free(handle);
    }
}

/* At rest the parts have no sign: their magnitude is that of the slowest motion. */
#define SLOWEST 1e-100 /* [rad/s] */

static Model *at_coulomb(void *map, double preload, double w, double T, double axialLoad, double netSlidingCoefficient,
                         double breakawayFactor)
{
    const Setting point[] = {{PRELOAD, preload},
                             {SPEED, fabs(w) < SLOWEST ? SLOWEST : fabs(w)},
                             {TEMPERATURE, T},
                             {AXIAL_LOAD, axialLoad},
                             {NET_SLIDING_COEFFICIENT, netSlidingCoefficient},
                             {BREAKAWAY_FACTOR, breakawayFactor}};
    return at(map, sizeof point / sizeof *point, point);
}

double ballScrewMap_coulomb(void *map, double preload, double w, double T, double axialLoad,
                            double netSlidingCoefficient, double breakawayFactor)
{
    Model *model = at_coulomb(map, preload, w, T, axialLoad, netSlidingCoefficient, breakawayFactor);

    return model_get(model, HYSTERESIS_TORQUE) + model_get(model, SLIDING_TORQUE);
}

/* Slopes of all outputs along the rates of the inputs of a point. */
static void derive(Model *model, double der_preload, double der_w, double der_T, double der_axialLoad,
                   double slopes[VARIABLE_COUNT])
{
    double direction[VARIABLE_COUNT] = {0.0};

    direction[PRELOAD] = der_preload;
    direction[SPEED] = der_w;
    direction[TEMPERATURE] = der_T;
    direction[AXIAL_LOAD] = der_axialLoad;
    model_derivatives(model, direction, slopes);
}

double ballScrewMap_coulombRate(void *map, double preload, double w, double T, double axialLoad,
                                double netSlidingCoefficient, double breakawayFactor, double der_preload, double der_w,
                                double der_T, double der_axialLoad)
{
    double slopes[VARIABLE_COUNT];

    derive(at_coulomb(map, preload, w, T, axialLoad, netSlidingCoefficient, breakawayFactor), der_preload,
           w < 0.0 ? -der_w : der_w, der_T, der_axialLoad, slopes);
    return slopes[HYSTERESIS_TORQUE] + slopes[SLIDING_TORQUE];
}

static Model *at_point(void *map, double preload, double w, double T, double axialLoad)
{
    const Setting point[] = {{PRELOAD, preload}, {SPEED, w}, {TEMPERATURE, T}, {AXIAL_LOAD, axialLoad}};
    return at(map, sizeof point / sizeof *point, point);
}

static Model *at_viscous(void *map, double preload, double w, double T, double axialLoad,
                         double apparentViscosityRatio, double roughnessHeight)
{
    const Setting point[] = {{PRELOAD, preload},
                             {SPEED, w},
                             {TEMPERATURE, T},
                             {AXIAL_LOAD, axialLoad},
                             {APPARENT_VISCOSITY_RATIO, apparentViscosityRatio},
                             {ROUGHNESS_HEIGHT, roughnessHeight}};
    return at(map, sizeof point / sizeof *point, point);
}

double ballScrewMap_viscous(void *map, double preload, double w, double T, double axialLoad,
                            double apparentViscosityRatio, double roughnessHeight)
{
    return model_get(at_viscous(map, preload, w, T, axialLoad, apparentViscosityRatio, roughnessHeight),
                     VISCOUS_TORQUE);
}

double ballScrewMap_viscousRate(void *map, double preload, double w, double T, double axialLoad,
                                double apparentViscosityRatio, double roughnessHeight, double der_preload,
                                double der_w, double der_T, double der_axialLoad)
{
    double slopes[VARIABLE_COUNT];

    derive(at_viscous(map, preload, w, T, axialLoad, apparentViscosityRatio, roughnessHeight), der_preload, der_w,
           der_T, der_axialLoad, slopes);
    return slopes[VISCOUS_TORQUE];
}

double ballScrewMap_covered(void *map, double preload, double w, double T, double axialLoad)
{
    return model_clamped(at_point(map, preload, w, T, axialLoad)) == 0U ? 1.0 : 0.0;
}

void ballScrewMap_films(void *map, double preload, double w, double T, double axialLoad, double *filmThicknessMin,
                        double *filmTemperatureRise, double *contactPressureMax)
{
    Model *model = at_point(map, preload, w, T, axialLoad);

    *filmThicknessMin = model_get(model, FILM_THICKNESS_MIN);
    *filmTemperatureRise = model_get(model, FILM_TEMPERATURE_RISE);
    *contactPressureMax = model_get(model, CONTACT_PRESSURE_MAX);
}

double ballScrewMap_apparentViscosityRatio(void *map)
{
    return ((Handle *)map)->map->defaults[APPARENT_VISCOSITY_RATIO_DEFAULT];
}

double ballScrewMap_netSlidingCoefficient(void *map)
{
    return ((Handle *)map)->map->defaults[NET_SLIDING_COEFFICIENT_DEFAULT];
}

double ballScrewMap_roughnessHeight(void *map)
{
    return ((Handle *)map)->map->defaults[ROUGHNESS_HEIGHT_DEFAULT];
}

double ballScrewMap_breakawayFactor(void *map)
{
    return ((Handle *)map)->map->defaults[BREAKAWAY_FACTOR_DEFAULT];
}

double ballScrewMap_preslidingStiffness(void *map, double preload, double netSlidingCoefficient, double breakawayFactor)
{
    const Friction friction = {0.0, netSlidingCoefficient, 0.0, breakawayFactor, 0.0};
    Loads loads;

    nut_loads(((Handle *)map)->map, preload, 0.0, &loads);
    return nut_stiffness(((Handle *)map)->map, &loads, &friction);
}
