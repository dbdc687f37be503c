"""The native FMUs as compiled libraries, called through ctypes as the standards declare them.

Calls are not wrapped: every call returns its status, every message is kept.
"""

import ctypes
from collections import namedtuple
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p

from fmpy.fmi2 import (
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2EventInfo,
)
from fmpy.fmi3 import fmi3LogMessageCallback
from native_model import TOKEN, compiled_model
from synthetic_map import closed_form

from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, fmu_variables, native_variables
from ballscrew_tehl.runtime.constants import ELEMENTS
from ballscrew_tehl.runtime.packed import Law

OK, WARNING, DISCARD, ERROR = range(4)
CS, ME = "co-simulation", "model exchange"
KINDS = {CS: 1, ME: 0}  # fmi2Type
NUT_MAP = closed_form(Law.THREE_PARAMETER)
VARIABLES = native_variables(NUT_MAP.header)
TIME_REFERENCE = FIRST_REFERENCE + len(VARIABLES)  # FMI 3
REALS = tuple(v.name for v in VARIABLES if v.unit is not None)
INDICATORS = tuple(v.name for v in VARIABLES if v.indicates)
OUTPUTS = tuple(v.name for v in VARIABLES if v.causality == "output" and v.unit is not None)
INPUTS = tuple(v.name for v in VARIABLES if v.causality == "input")
REAL_PARAMETERS = tuple(  # tunable ones
    v.name for v in VARIABLES if v.causality == "parameter" and v.unit is not None and not v.fixed
)


def doubles(*values):
    return (c_double * len(values))(*values)


Message = namedtuple("Message", "status category text")


class NativeInstance:
    """One instance, for a `with` block; library: of an FMU for Python hosts, None: that of the runtime.

    messages: all since it exists; opening: those of the instantiation; time: end of the last step of go() [s]
    """

    def __init__(
        self, version, kind=CS, name=b"one", token=TOKEN, resources="", logging=True, logger=True, functions=None,
        event_mode=False, intermediate=(), nut_map=NUT_MAP, model=FRICTION, library=None, counts=False,
    ):  # fmt: skip
        table = fmu_variables if library else model.variables
        library, variables = library or compiled_model(nut_map, model, counts), table(nut_map.header)
        self.names = {v.name: n for n, v in enumerate(variables, FIRST_REFERENCE)}
        self.output = next(v.name for v in variables if v.causality == "output")
        kinds = "output", "local"
        self._shown = [v.name for v in variables if v.causality in kinds and v.unit and not v.indicates]
        self.indicators = sum(v.indicates for v in variables)
        self.states = sum(v.derivative_of is not None and v.derivative_of != "" for v in variables)
        self.library = ctypes.CDLL(str(library))
        self.version, self.kind, self.model, self.time = version, kind, model, 0.0
        self.saved = "FMUstate" if version == 2 else "FMUState"
        self.messages = []
        folder = (str(library.parent) if resources == "" else resources) or None
        place, key = (None if text is None else text.encode() for text in (folder, token))
        if version == 2:
            make = self.library.fmi2Instantiate
            make.restype = c_void_p
            self._functions = functions or self._callbacks(logger)
            address = None if self._functions == "NULL" else byref(self._functions)
            self.handle = make(name, KINDS.get(kind, 7), key, place, address, 0, int(logging))
        else:
            self._logger = fmi3LogMessageCallback(self._log) if logger else fmi3LogMessageCallback()
            if kind == CS:
                make = self.library.fmi3InstantiateCoSimulation
                wanted = (c_uint * len(intermediate))(*intermediate)
                more = (event_mode, True, wanted, c_size_t(len(wanted)), None, self._logger, None)
            elif kind == ME:
                make, more = self.library.fmi3InstantiateModelExchange, (None, self._logger)
            else:
                make = self.library.fmi3InstantiateScheduledExecution
                more = (None, self._logger, None, None, None)
            make.restype = c_void_p
            self.handle = make(name, key, place, False, logging, *more)
        self.opening = list(self.messages)
        if self.handle is not None:
            self.messages.clear()

    def _callbacks(self, logger):
        functions = fmi2CallbackFunctions()
        if logger:
            functions.logger = fmi2CallbackLoggerTYPE(self._log)
        return functions

    def _log(self, *given):
        """Of FMI 2 and 3: environment, in FMI 2 the name, status, category, message."""
        status, category, message = given[-3:]
        self.messages.append(Message(status, category.decode(), message.decode()))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        free = getattr(self.library, f"fmi{self.version}FreeInstance")
        free.restype = None
        free(c_void_p(self.handle))
        self.handle = None

    @property
    def last(self):
        return self.messages[-1].text if self.messages else ""

    def call(self, name, *arguments):
        """Status of a call by its name without prefix."""
        return getattr(self.library, f"fmi{self.version}{name}")(c_void_p(self.handle), *arguments)

    def vr(self, *names):
        return (c_uint * len(names))(*(self.names[n] if isinstance(n, str) else n for n in names))

    def access(self, name, vr, values):
        """Status of Get or Set of a type."""
        counts = (c_size_t(len(values)),) if self.version == 3 else ()
        return self.call(name, vr, c_size_t(len(vr)), values, *counts)

    def set_raw(self, vr, values):
        return self.access("SetReal" if self.version == 2 else "SetFloat64", vr, values)

    def get_raw(self, vr, values):
        return self.access("GetReal" if self.version == 2 else "GetFloat64", vr, values)

    def set(self, **values):
        return self.set_raw(self.vr(*values), doubles(*values.values()))

    def get(self, *names):
        values = doubles(*[0.0] * len(names))
        assert self.get_raw(self.vr(*names), values) == OK, self.last
        return list(values)

    def set_boolean(self, name, value):
        room = (c_int * 1)(int(value)) if self.version == 2 else (ctypes.c_bool * 1)(value)
        return self.access("SetBoolean", self.vr(name), room)

    def in_range(self):
        value = (c_int * 1)()
        assert self.access("GetBoolean", self.vr("in_range"), value) == OK
        return bool(value[0])

    def outputs(self):
        """Outputs, elements and their rates."""
        return [*self.get(*self._shown), self.in_range()]

    def initialize(self, start=0.0, stop=None):
        experiment = (0, c_double(0.0), c_double(start), int(stop is not None), c_double(stop or 0.0))
        self.time = start
        if self.version == 3:
            return self.call("EnterInitializationMode", *experiment)
        return self.call("SetupExperiment", *experiment) or self.call("EnterInitializationMode")

    def start(self, start=0.0, stop=None, **values):
        """Initialized with these values, in step mode or event mode."""
        assert self.set(**values) == OK
        assert self.initialize(start, stop) == OK
        assert self.call("ExitInitializationMode") == OK, self.last
        return self

    def update(self):
        """Status of the update at an event, and whether the elements were changed."""
        if self.version == 2:
            info = fmi2EventInfo()
            status = self.call("NewDiscreteStates", byref(info))
            flags = (info.newDiscreteStatesNeeded, info.terminateSimulation, info.nextEventTimeDefined)
            assert flags == (0, 0, 0)
            return status, bool(info.valuesOfContinuousStatesChanged)
        found = [ctypes.c_bool(True) for _ in range(5)]
        status = self.call("UpdateDiscreteStates", *map(byref, found), byref(c_double()))
        assert [flag.value for place, flag in enumerate(found) if place != 3] == [False] * 4
        return status, found[3].value

    def go_to(self, state):
        """From new to the state with this letter: i n s e c t x, as in test_native_calls."""
        if state == "x":
            self.set_raw(self.vr(999), doubles(0.0))
        elif state != "i":
            self.initialize()
            if state != "n":
                self.call("ExitInitializationMode")
            if state == "c":
                self.call("EnterContinuousTimeMode")
            elif state == "t":
                self.call("Terminate")
        self.messages.clear()
        return self

    def step(self, time, size):
        nothing = (None,) * 4 if self.version == 3 else ()
        return self.call("DoStep", c_double(time), c_double(size), 0, *nothing)

    def go(self, size=1e-3, **values):
        """Outputs after a step with these values set."""
        assert self.set(**values) == OK, self.last
        assert self.step(self.time, size) == OK, self.last
        self.time += size
        return self.outputs()

    def vector(self, name, length=ELEMENTS):
        """Continuous states, their derivatives, nominals or the event indicators."""
        values = doubles(*[0.0] * length)
        assert self.call(name, values, c_size_t(length)) == OK, self.last
        return list(values)

    def rates(self):
        name = "GetDerivatives" if self.version == 2 else "GetContinuousStateDerivatives"
        return self.vector(name, self.states or 1)

    def save(self):
        state = c_void_p()
        assert self.call(f"Get{self.saved}", byref(state)) == OK
        return state

    def restore(self, state):
        return self.call(f"Set{self.saved}", state)

    def forget(self, state):
        return self.call(f"Free{self.saved}", byref(state))

    def serialize(self, state, more=0):
        """Bytes of a state, or the status if they are refused; more: room beyond what is needed."""
        size = c_size_t()
        assert self.call(f"Serialized{self.saved}Size", state, byref(size)) == OK
        content = ctypes.create_string_buffer(size.value + more)
        status = self.call(f"Serialize{self.saved}", state, content, c_size_t(size.value + more))
        return content.raw if status == OK else status

    def deserialize(self, content):
        state = c_void_p()
        name = f"{'DeSerialize' if self.version == 2 else 'Deserialize'}{self.saved}"
        return self.call(name, c_char_p(content), c_size_t(len(content)), byref(state)), state
