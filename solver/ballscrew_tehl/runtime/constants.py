"""Constants that the Python runtime and its C twin share; constants.h of the native FMUs is written from this table.

Standard library only: this module travels inside the Python FMUs. The column order of a map is in packed.py and is
written to constants.h as well.
"""

# nut law (evaluate.py)
BREAKAWAY_EXPONENT_MAX = 1.0  # of the Coulomb part at the slowest node, steepest law towards rest
REST = 0.02  # speed over that of the slowest node below which the Coulomb part is flat
LEAST_HALF = 0.01  # the same, at which half of the rise to breakaway is left in a full film
FILM_SPEED_EXPONENT = 0.67  # film over speed below the slowest node: Hamrock & Dowson 1977, central film
LEAST_RISE = 1e-30  # of the Coulomb part towards rest; avoids a division by zero, no effect on a torque
LAMBDA_RATIO_MAX = 1000.0  # reported for a smooth surface
SMOOTH = 1e-30  # [m] roughness height below which a surface counts as smooth
FREE_PUSH = 0.097  # friction of a relieved pair of flanks on a ball free to roll, per load and rolling speed
FREE_SHARPNESS = 7.0  # of the change from held by four flanks to free; both fitted to balls of ten screws
DRAG_SHARPNESS = (
    4.0  # of the change from the drag of a full gap to what the contacts transmit: assumption of form
)
HELD = 0.4  # least force of the relieved flanks of oversize balls over the loaded ones' in range: 800 points of four
# screws, 99 % within 0.65 % of the law, 2.1 % at most; below it up to 40 %, where balls are neither held nor free
SPEED_EXPONENT_MAX = 3.0  # of the viscous torque at the slowest node; above it no monotone law towards rest

# temperature difference of screw and nut (evaluate.py)
MOST_DIFFERENCE = 20.0  # [K] screw minus nut, either way, in range
STRETCH = 3.0  # nodes 20 K sinh(3 t)/sinh(3), t = -1 to 1: dense where the first balls lose contact

# presliding (standstill.py)
ELEMENTS = 6  # elasto-slip; a loop loses energy as amplitude^2.81 to 2.94, with 20 of them ^2.90 to 2.99
STIFFNESS_RATIO = 4.0  # of stiffness held and that of the loads; beyond it the elements follow the loads
# model exchange
LEVEL_MARGIN = 0.05  # of a state above a level that falls while the element sticks: then an event
FOLLOW_TIME = 2e-3  # [s] at least, of a sliding element to its level: explicit steps of 1 ms are stable
DAMPING_TIME = 4e-3  # [s] damping over stiffness by default; explicit coupling needs steps below it
AXIS_DAMPING_TIME = 1e-3  # [s] the same of BallScrewAxis, stable without: assumed, brings it to rest
LEAST_STIFFNESS = 1e-6  # [N.m/rad] of the elements; a smaller one that is set counts as 0, from the screw

# preload from torque (native/models/monitor/search.c)
LEAST_ELASTICITY = 0.01  # (preload/torque) d torque/d preload; below it 1 % of torque is all of the preload
ACCURACY = 1e-11  # relative, of the last step in preload
JUMP = 1e-9  # relative; torques this near that of an unloaded nut do not determine the preload: it may jump there
SEPARATION_STEPS = 6  # of Newton; load over preload at separation hardly changes with preload, 3 suffice
LONGEST_STEP = 50.0  # of ln preload; keeps the exponential finite, any larger step leaves the bracket
ROUNDING = 4e-16  # relative width of a bracket that cannot shrink any more
MOST_ITERATIONS = 200  # each halves the error in torque or the bracket: it takes 3 to 10, and cannot take all

# transmission (native/models/transmission)
FORCE_ROUNDING = 1e-12  # relative, of a force computed from a preload at the end of the map

# table of the support bearings in the axis (native/models/axis): nodes
BEARING_SPEEDS, BEARING_TEMPERATURES = 24, 12  # between them within 3 % of the law (ZKLN3572, VG 100)

# inputs
TOO_LARGE = 1e30  # a value of this size or more is rejected like infinity, so that no product overflows
