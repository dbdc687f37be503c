/* Friction at and near standstill. Twin of standstill.py, where the laws are derived.
   Source: Dupont, Hayward, Armstrong, Altpeter, IEEE Trans. Automat. Contr. 47 (2002) 787. */
#ifndef BALLSCREW_LAW_H
#define BALLSCREW_LAW_H

#define ELASTIC_SHARE 0.7        /* elastic limit over sliding deflection */
#define FILM_SPEED_EXPONENT 0.67 /* Hamrock & Dowson 1977, central film */

typedef struct {
    double deflection; /* [rad] at the end of the step */
    double torque;     /* [N.m] at the end of the step */
    double heat;       /* [J] */
} BristleStep;

/* Sign of the speed that passes smoothly through zero; the sign itself for a regularization speed of 0. */
double regularised_sign(double speed, double regularization_speed);

/* Deflection, at most the one at which the bristle slides; 0 without Coulomb torque. */
double bristle_within(double deflection, double coulomb, double stiffness);

/* Share of the motion that slides, 0 to 1, for a motion in the direction of the speed. */
double bristle_yielding(double deflection, double speed, double coulomb, double stiffness);

/* Rate of the deflection [rad/s]; slip not 0: it is held. */
double bristle_rate(double deflection, double speed, double coulomb, double stiffness, int slip);

/* Dissipated power at an instant [W], no damping. */
double bristle_power(double deflection, double speed, double coulomb, double stiffness);

/* Exact step of length > 0 with the speed held, stiffness > 0. */
BristleStep bristle_step(double deflection, double speed, double step, double coulomb, double stiffness,
                         double damping);

#endif
