"""Which call of the native FMUs is legal in which state, and valid arguments of each."""

import csv
import ctypes
from ctypes import byref, c_double, c_size_t, c_uint, c_void_p
from pathlib import Path

from native_library import CS, DISCARD, ERROR, ME, doubles

STATES = {CS: "instx", ME: "inectx"}

# legal_calls.csv: states in which a call is legal, i instantiated, n initialization mode, s step mode, e event mode,
# c continuous-time mode, t terminated, x error; the one kind that has it; the status of a legal call that the FMU does
# not support. Read from the standards, independently of the tables in C. The only addition is SetTime in event mode.
with Path(__file__).with_name("legal_calls.csv").open(encoding="ascii") as file:
    _ROWS = list(csv.DictReader(file))
LEGAL = {v: {row["call"]: row for row in _ROWS if str(v) in row["versions"]} for v in (2, 3)}
_WORDS = {"error": ERROR, "discard": DISCARD}
UNSUPPORTED = {row["call"]: _WORDS[row["unsupported"]] for row in _ROWS if row["unsupported"]}
NO_ARGUMENTS = {
    "EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset", "EnterEventMode",
    "EnterContinuousTimeMode", "CancelStep", "EnterConfigurationMode", "ExitConfigurationMode",
    "EnterStepMode", "EvaluateDiscreteStates",
}  # fmt: skip
VECTORS = ("SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetContinuousStateDerivatives",
           "GetNominalsOfContinuousStates")  # fmt: skip


def is_legal(version, name, kind, state):
    row = LEGAL[version][name]
    return state in row["states"] and row["kind"] in ("", kind)


def arguments(one, name):
    """Valid arguments of a call, without the instance."""
    room, zero = ctypes.create_string_buffer(4096), c_size_t(0)
    experiment = (0, c_double(0.0), c_double(0.0), 0, c_double(0.0))
    if name == "SetupExperiment" or (name == "EnterInitializationMode" and one.version == 3):
        return experiment
    if name in NO_ARGUMENTS:
        return ()
    if name == "SetDebugLogging":
        return 1, zero, None
    if name in VECTORS:
        return doubles(*[0.0] * max(one.states, 1)), c_size_t(one.states)
    if name == "GetEventIndicators":
        return doubles(*[0.0] * one.indicators), c_size_t(one.indicators)
    if name == "SetTime":
        return (c_double(0.0),)
    if name == "DoStep":
        return c_double(0.0), c_double(1e-3), 0, None, None, None, None
    if name.endswith("Status"):
        return 2, room  # last successful time
    if name in ("GetDirectionalDerivative", "GetAdjointDerivative"):
        each = c_size_t(1)
        given = one.vr(one.output), each, one.vr("speed"), each, doubles(1.0)
        return (*given, doubles(0.0)) if one.version == 2 else (*given, each, doubles(0.0), each)
    if name.startswith("GetFMU") or name.startswith("FreeFMU"):
        return (byref(c_void_p()),)
    if name.startswith("SetFMU"):
        return (one.save(),)
    if name.startswith("SerializedFMU"):
        return one.save(), byref(c_size_t())
    if name.startswith("SerializeFMU"):
        state = one.save()
        size = len(one.serialize(state))
        return state, ctypes.create_string_buffer(size), c_size_t(size)
    if name.lower().startswith("deserialize"):
        content = one.serialize(one.save())
        return content, c_size_t(len(content)), byref(c_void_p())
    if name == "NewDiscreteStates":
        return (room,)
    if name in ("CompletedIntegratorStep", "UpdateDiscreteStates"):
        return (None,) * 6
    if name.startswith("GetNumberOf"):
        return (*([c_uint(4)] if "Variable" in name else []), byref(c_size_t()))
    if name == "GetVariableDependencies":
        return c_uint(4), None, None, None, None, zero
    if name == "ActivateModelPartition":
        return c_uint(0), c_double(0.0)
    return None, zero, None, zero, zero  # of no variable
