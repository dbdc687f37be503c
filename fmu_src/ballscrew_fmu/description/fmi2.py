"""modelDescription.xml of the FMUs for Python hosts, FMI 2.0 co-simulation."""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.description.native import LOG_CATEGORIES as NATIVE_CATEGORIES
from ballscrew_fmu.description.native import described, flags
from ballscrew_fmu.models import FRICTION, FmuModel

LOG_CATEGORIES = {
    **NATIVE_CATEGORIES,
    "logStatusDiscard": "A step is discarded, with the variable and the value that are the reason",
    "logStatusError": "A call that has no effect",
    "logStatusFatal": "Failures of the Python interpreter",
}
CAPABILITIES = flags(
    "canHandleVariableCommunicationStepSize canNotUseMemoryManagementFunctions canGetAndSetFMUstate "
    "canSerializeFMUstate",
    # requirements on the host: documentation/externalDependencies.txt
    "needsExecutionTool canInterpolateInputs canRunAsynchronuously canBeInstantiatedOnlyOncePerProcess "
    "providesDirectionalDerivative",
) | {"maxOutputDerivativeOrder": "0"}


def model_description(
    header: Mapping[str, Any], guid: str, generation_tool: str, model: FmuModel = FRICTION
) -> bytes:
    """The XML in UTF-8. Same arguments give the same bytes.

    Parameters   header : of the map (bounds, start values, screw and kinematics for the description)
    """
    names = (model.name, model.summary, guid, generation_tool)
    return described(
        header, 2, names, model.variables(header), {"CoSimulation": CAPABILITIES}, LOG_CATEGORIES
    )
