"""Which call of the native FMUs is legal in which state, and valid arguments of each."""

import ctypes
from ctypes import byref, c_double, c_size_t, c_uint, c_void_p

from native_library import CS, DISCARD, ERROR, ME, doubles

STATES = {CS: "instx", ME: "inectx"}

# States in which a call is legal: i instantiated, n initialization mode, s step mode, e event mode,
# c continuous-time mode, t terminated, x error. Read from the standards, independently of the tables in C. The only
# addition is SetTime in event mode.
LEGAL = {
    2: {
        "SetDebugLogging": "inscetx", "SetupExperiment": "i", "EnterInitializationMode": "i",
        "ExitInitializationMode": "n", "Terminate": "sec", "Reset": "inscetx", "GetReal": "nsectx",
        "GetInteger": "nsectx", "GetBoolean": "nsectx", "GetString": "nsectx", "SetReal": "insec",
        "SetInteger": "inse", "SetBoolean": "inse", "SetString": "inse", "GetFMUstate": "insectx",
        "SetFMUstate": "insectx", "FreeFMUstate": "insectx", "SerializedFMUstateSize": "insectx",
        "SerializeFMUstate": "insectx", "DeSerializeFMUstate": "insectx",
        "GetDirectionalDerivative": "nsectx",
        "EnterEventMode": "ec", "NewDiscreteStates": "e", "EnterContinuousTimeMode": "e",
        "CompletedIntegratorStep": "c", "SetTime": "ec", "SetContinuousStates": "c",
        "GetEventIndicators": "nectx", "GetContinuousStates": "nectx", "GetDerivatives": "nectx",
        "GetNominalsOfContinuousStates": "inectx",
        "SetRealInputDerivatives": "ins", "GetRealOutputDerivatives": "stx", "DoStep": "s", "CancelStep": "",
        "GetStatus": "st", "GetRealStatus": "st", "GetIntegerStatus": "st", "GetBooleanStatus": "st",
        "GetStringStatus": "st",
    },
    3: {
        "SetDebugLogging": "insectx", "EnterInitializationMode": "i", "ExitInitializationMode": "n",
        "EnterEventMode": "c", "Terminate": "sec", "Reset": "insectx",
        **{f"Get{t}": "nsectx" for t in ("Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32",
                                         "UInt32", "Int64", "UInt64", "Boolean", "String", "Binary")},
        **{f"Set{t}": "insec" for t in ("Float32", "Float64")},
        **{f"Set{t}": "inse" for t in ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64",
                                       "UInt64", "Boolean", "String", "Binary")},
        **{name: "ne" for name in ("GetClock", "SetClock", "GetIntervalDecimal", "GetIntervalFraction",
                                   "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal",
                                   "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction",
                                   "EvaluateDiscreteStates")},
        "GetNumberOfVariableDependencies": "insectx", "GetVariableDependencies": "insectx",
        "GetFMUState": "insectx", "SetFMUState": "insectx", "FreeFMUState": "insectx",
        "SerializedFMUStateSize": "insectx", "SerializeFMUState": "insectx", "DeserializeFMUState": "insectx",
        "GetDirectionalDerivative": "nsectx", "GetAdjointDerivative": "nsectx",
        "EnterConfigurationMode": "ise", "ExitConfigurationMode": "", "UpdateDiscreteStates": "e",
        "EnterContinuousTimeMode": "e", "CompletedIntegratorStep": "c", "SetTime": "ec",
        "SetContinuousStates": "c", "GetContinuousStateDerivatives": "nectx", "GetEventIndicators": "nectx",
        "GetContinuousStates": "nectx", "GetNominalsOfContinuousStates": "nectx",
        "GetNumberOfEventIndicators": "inectx", "GetNumberOfContinuousStates": "inectx",
        "EnterStepMode": "e", "GetOutputDerivatives": "stx", "DoStep": "s", "ActivateModelPartition": "",
    },
}  # fmt: skip
CS_ONLY = {
    "SetRealInputDerivatives", "GetRealOutputDerivatives", "DoStep", "GetStatus", "GetRealStatus",
    "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus", "GetOutputDerivatives", "EnterStepMode",
}  # fmt: skip
ME_ONLY = {
    "EnterEventMode", "NewDiscreteStates", "UpdateDiscreteStates", "EnterContinuousTimeMode",
    "CompletedIntegratorStep", "SetTime", "SetContinuousStates", "GetEventIndicators", "GetContinuousStates",
    "GetDerivatives", "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates",
    "GetNumberOfEventIndicators", "GetNumberOfContinuousStates",
}  # fmt: skip
# legal calls that the FMU does not support
UNSUPPORTED = {
    "SetRealInputDerivatives": ERROR, "GetRealOutputDerivatives": ERROR, "GetOutputDerivatives": ERROR,
    "GetNumberOfVariableDependencies": ERROR, "GetVariableDependencies": ERROR,
    "EnterConfigurationMode": ERROR, "EvaluateDiscreteStates": ERROR, "GetStatus": DISCARD,
    "GetIntegerStatus": DISCARD, "GetBooleanStatus": DISCARD, "GetStringStatus": DISCARD,
}  # fmt: skip
NO_ARGUMENTS = {
    "EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset", "EnterEventMode",
    "EnterContinuousTimeMode", "CancelStep", "EnterConfigurationMode", "ExitConfigurationMode",
    "EnterStepMode", "EvaluateDiscreteStates",
}  # fmt: skip

# co-simulation with event mode: states, and the calls that differ
STATES_WITH_EVENTS = "inestx"
LEGAL_WITH_EVENTS = {"EnterEventMode": "s", "UpdateDiscreteStates": "e"}


def is_legal(version, name, kind, state, event_mode=False):
    if event_mode and name in LEGAL_WITH_EVENTS:
        return state in LEGAL_WITH_EVENTS[name]
    other = CS_ONLY if kind == ME else ME_ONLY
    return state in LEGAL[version][name] and name not in other


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
    if name in ("SetContinuousStates", "GetContinuousStates", "GetDerivatives",
                "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates"):  # fmt: skip
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
        unknowns, knowns = one.vr(one.output), one.vr("speed")
        if one.version == 2:
            return unknowns, c_size_t(1), knowns, c_size_t(1), doubles(1.0), doubles(0.0)
        one_each = c_size_t(1)
        return unknowns, one_each, knowns, one_each, doubles(1.0), one_each, doubles(0.0), one_each
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
    if name.startswith("GetNumberOf") and name != "GetNumberOfVariableDependencies":
        return (byref(c_size_t()),)
    if name == "GetNumberOfVariableDependencies":
        return c_uint(4), byref(c_size_t())
    if name == "GetVariableDependencies":
        return c_uint(4), None, None, None, None, zero
    if name == "ActivateModelPartition":
        return c_uint(0), c_double(0.0)
    return None, zero, None, zero, zero  # of no variable
