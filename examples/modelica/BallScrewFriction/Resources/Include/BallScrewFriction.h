/* External functions of the Modelica package BallScrewFriction, one for each in package.mo.

   Link with the library of the same name, which holds the map runtime of the native FMUs. A file that cannot be used
   and a value that is not a number, or too large, stop the simulation through ModelicaFormatError. SI units. */
#ifndef BALL_SCREW_FRICTION_H
#define BALL_SCREW_FRICTION_H

#ifdef __cplusplus
extern "C" {
#endif

/* Map of a file, path in UTF-8; free it by ballScrewMap_close. Two threads must not use one map at once. */
void *ballScrewMap_open(const char *fileName);
void ballScrewMap_close(void *map);

/* Magnitude [N.m] of hysteresis and sliding part; its rate for rates of the inputs. */
double ballScrewMap_coulomb(void *map, double preload, double w, double T, double axialLoad,
                            double netSlidingCoefficient, double breakawayFactor);
double ballScrewMap_coulombRate(void *map, double preload, double w, double T, double axialLoad,
                                double netSlidingCoefficient, double breakawayFactor, double der_preload, double der_w,
                                double der_T, double der_axialLoad);

/* Viscous part [N.m] with the sign of the speed; its rate for rates of the inputs. */
double ballScrewMap_viscous(void *map, double preload, double w, double T, double axialLoad,
                            double apparentViscosityRatio, double roughnessHeight);
double ballScrewMap_viscousRate(void *map, double preload, double w, double T, double axialLoad,
                                double apparentViscosityRatio, double roughnessHeight, double der_preload,
                                double der_w, double der_T, double der_axialLoad);

/* 1: the map covers the point; 0: inputs are clamped. */
double ballScrewMap_covered(void *map, double preload, double w, double T, double axialLoad);

void ballScrewMap_films(void *map, double preload, double w, double T, double axialLoad, double *filmThicknessMin,
                        double *filmTemperatureRise, double *contactPressureMax);

/* Friction parameters that were calibrated with the map. */
double ballScrewMap_apparentViscosityRatio(void *map);
double ballScrewMap_netSlidingCoefficient(void *map);
double ballScrewMap_roughnessHeight(void *map);
double ballScrewMap_breakawayFactor(void *map);

/* Presliding stiffness at rest that follows from the screw [N.m/rad]. */
double ballScrewMap_preslidingStiffness(void *map, double preload, double netSlidingCoefficient, double breakawayFactor);

#ifdef __cplusplus
}
#endif

#endif
