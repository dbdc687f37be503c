"""Importers that run the FMUs in tests: how each replays rows of inputs.

A replay sets the inputs of row n, steps, and gives the outputs, one row after the other or all at once; model exchange
reads them at the instant of the row. What is missing here is skipped: python -m pip install -e '.[importers]', or
.ci/importers.
"""

import contextlib
import ctypes
import functools
import importlib
import sys
from collections import namedtuple
from pathlib import Path

import fmpy
import numpy as np
import pytest

STEP = 2.0**-9  # [s]: all communication points are exact, in seconds and in the nanoseconds of libcosim


def needs(tool):
    """Skip a test whose tool does not load here."""
    try:
        if tool == "ecos":  # finds tbb of the system only, not that of pip
            for library in ("libtbb.so.12", str(Path(sys.prefix) / "lib" / "libtbb.so.12")):
                with contextlib.suppress(OSError):
                    ctypes.CDLL(library, ctypes.RTLD_GLOBAL)
                    break
        importlib.import_module({"ecos": "ecospy", "libcosim": "libcosimpy"}.get(tool, tool))
    except (ImportError, OSError) as error:
        pytest.skip(f"{tool} does not load: {error}")


@functools.cache
def outputs_of(fmu):
    """Names of the Real and of the Boolean outputs."""
    variables = [v for v in fmpy.read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    flags = [v.name for v in variables if v.type == "Boolean"]
    return [v.name for v in variables if v.name not in flags], flags


def as_row(fmu, values):
    """Outputs of a tool that reads all of them as numbers; a Boolean that is not 0 or 1 remains a number."""
    reals, flags = outputs_of(fmu)
    row = {name: float(values[name]) for name in reals}
    return row | {name: bool(values[name]) if values[name] in (0.0, 1.0) else values[name] for name in flags}


def _simulated(fmu, rows, **options):
    """fmpy.simulate_fmu with the rows as samples of its input signals."""
    names = list(rows[0])
    signals = np.zeros(len(rows) + 1, dtype=[(name, float) for name in ("time", *names)])
    signals["time"] = STEP * np.arange(len(rows) + 1)
    for name in names:
        signals[name] = [row[name] for row in (*rows, rows[-1])]
    outputs = [name for group in outputs_of(fmu) for name in group]
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=signals["time"][-1], output_interval=STEP, input=signals, output=outputs, **options,
    )  # fmt: skip
    return [{name: row[name].item() for name in outputs} for row in result]


def in_fmpy_co_simulation(fmu, rows):
    return _simulated(fmu, rows, fmi_type="CoSimulation")[1:]


def in_fmpy_cvode(fmu, rows):
    options = {"step_size": STEP, "record_events": False, "start_values": {"presliding": False}}
    return _simulated(fmu, rows, fmi_type="ModelExchange", solver="CVode", **options)[: len(rows)]


def in_pathsim(fmu, rows):
    """CoSimulationFMU behind sources: it steps at the end of each step of pathsim, with the inputs of that instant."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Source
    from pathsim_fmi import CoSimulationFMU

    block = CoSimulationFMU(str(fmu), dt=STEP)
    sources = [Source(lambda t, n=name: float(rows[max(round(t / STEP) - 1, 0)][n])) for name in rows[0]]
    wires = [Connection(source, block[name]) for source, name in zip(sources, rows[0], strict=True)]
    simulation = Simulation([*sources, block], wires, dt=STEP, log=False)
    names = [name for group in outputs_of(fmu) for name in group]
    ports = list(block.fmu_wrapper.output_refs)
    for _ in rows:
        simulation.timestep()
        found = dict(zip(ports, block.outputs.to_array(), strict=True))
        yield as_row(fmu, {name: found[name] for name in names})


def in_libcosim(fmu, rows):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(STEP * 1e9)
    slave = execution.add_local_slave(CosimLocalSlave(str(fmu), "friction"))
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    assert slave >= 0
    assert execution.add_observer(observer)
    assert execution.add_manipulator(manipulator)
    reals, flags = outputs_of(fmu)
    reference = {v.name: v.valueReference for v in fmpy.read_model_description(str(fmu)).modelVariables}
    for row in rows:
        inputs = [reference[name] for name in row]
        assert manipulator.slave_real_values(slave, inputs, [float(value) for value in row.values()])
        assert execution.step(), "libcosim: step failed"
        values = observer.last_real_values(slave, [reference[name] for name in reals])
        booleans = observer.last_boolean_values(slave, [reference[name] for name in flags])
        yield dict(zip((*reals, *flags), (*values, *booleans), strict=True))


def in_ecos(fmu, rows):
    from ecospy import EcosSimulation, EcosSimulationStructure

    reals, flags = outputs_of(fmu)
    with EcosSimulationStructure() as structure:
        structure.add_model("friction", str(fmu))
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init()
            for row in rows:
                for name, value in row.items():
                    simulation.set_real(f"friction::{name}", float(value))
                simulation.step()
                found = {name: simulation.get_real(f"friction::{name}") for name in reals}
                found |= {name: simulation.get_bool(f"friction::{name}") for name in flags}
                yield found
            simulation.terminate()


Replay = namedtuple("Replay", "tool way kind versions run")  # CS or ME, versions of FMI
REPLAYS = (
    Replay("fmpy", "simulate_fmu", "CS", (2, 3), in_fmpy_co_simulation),
    Replay("fmpy", "CVode", "ME", (2, 3), in_fmpy_cvode),
    Replay("libcosim", "override manipulator", "CS", (2,), in_libcosim),
    Replay("ecos", "fixed-step algorithm", "CS", (2, 3), in_ecos),
    Replay("pathsim_fmi", "co-simulation block", "CS", (2, 3), in_pathsim),
)
