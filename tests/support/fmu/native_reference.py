"""Small reference results and a validation for the native FMUs of the tests."""

from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_fmu.pages.page import Validation

REFERENCE = Reference(
    1e-3,
    [{"preload": 2000.0, "speed": 10.0 * n, "temperature": 303.15, "axial_load": 0.0} for n in range(5)],
    [{"friction_torque": 0.1 * n, "in_range": n < 4} for n in range(5)],
)
VALIDATION = Validation("<p>Table</p>", {"plot.png": b"\x89PNG"})
