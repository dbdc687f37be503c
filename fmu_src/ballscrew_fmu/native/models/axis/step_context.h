#ifndef BALLSCREW_STEP_CONTEXT_H
#define BALLSCREW_STEP_CONTEXT_H

/* What the axis needs in addition to the variables. */
typedef struct {
    unsigned slips;  /* bit per element that slides, */
    int slip;        /* in direction +1 or -1 */
    double stiffness; /* [N.m/rad] of the elements */
    int guide_slip;  /* direction of the guide that slides, 0: it follows */
    double heat;     /* [J] of all steps; model exchange: of events */
    double supplied; /* [J] of all steps */
} StepContext;

#endif
