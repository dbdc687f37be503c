"""Cost of a step of native FMUs of the friction (FMI 2, co-simulation), side by side in one process.

`python tests/benchmarks/bench_native_step.py OLD.fmu NEW.fmu` times them in turn, so that other work on the machine
counts for all alike. The cost of the same calls without an instance is subtracted. What remains is to be compared: it
is larger than in a C host. `python -m ballscrew_fmu build --only friction --fmi 2` in two clones builds the FMUs.
"""

import random
import statistics
import sys
import time
from ctypes import c_double, c_size_t, c_uint, c_void_p
from math import sin, tau

import fmpy
from fmpy.fmi2 import FMU2Slave

REPETITIONS, CALLS = 500, 300
KNOWN, OUTPUTS = (c_uint * 4)(1, 2, 3, 4), (c_uint * 12)(*range(5, 17))  # value references
POINTS = [  # preload, speed, temperature, axial load of a cycle of a drive
    (c_double * 4)(2e3 + 300.0 * sin(x), 150.0 * sin(4.0 * x + 0.3), 303.0, 900.0 * sin(7.0 * x))
    for x in (tau * n / CALLS for n in range(CALLS))
]


def opened(path):
    model, folder = fmpy.read_model_description(path), fmpy.extract(path)
    kind = model.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=model.guid, modelIdentifier=kind, unzipDirectory=folder)
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


def seconds(dll, handle, *counts):
    """Of setting the first inputs, a step and getting the first outputs."""
    (inputs, outputs), values = map(c_size_t, counts), (c_double * 12)()
    put, step, get = dll.fmi2SetReal, dll.fmi2DoStep, dll.fmi2GetReal
    zero, size = c_double(0.0), c_double(1e-4)
    begun = time.perf_counter()
    for point in POINTS:
        put(handle, KNOWN, inputs, point)
        step(handle, zero, size, 1)
        get(handle, OUTPUTS, outputs, values)
    return (time.perf_counter() - begun) / CALLS


if __name__ == "__main__":
    fmus = {path: opened(path) for path in sys.argv[1:]}
    for counts in ((3, 1), (4, 1), (3, 12), (4, 12)):
        costs = {path: [] for path in fmus}
        for path in random.sample(list(fmus) * REPETITIONS, len(fmus) * REPETITIONS):
            fmu = fmus[path]
            fmu.setReal([4], [0.0])  # no axial load
            run, calls = (seconds(fmu.dll, c_void_p(x), *counts) for x in (fmu.component, None))
            costs[path].append(1e9 * (run - calls))
        for path, found in costs.items():
            print(f"{counts} inputs, outputs: {statistics.median(found):5.0f} ns  {path}")
