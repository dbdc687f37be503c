"""Where the numbers of a friction set were measured, and what the catalogue says for another screw."""

from ..parameters.file import Law, Parameters, changed
from ..parameters.identity import parameters_hash
from ..runtime.packed import MapError
from .sets import FITTED, SETS, FrictionSet, overridable

#: name of the catalogue formula, baselines.nsk_torque
CATALOGUE = "JIS B 1192 / ISO 3408-3"
#: why it differs from the mechanistic law, and where measured screws lie; measured torques of other leads: none known
CATALOGUE_DIFFERS = (
    "a catalogue torque goes as lead/sqrt(tan(lead angle)), friction between balls does not depend on the lead; "
    "measured on three new screws of lead 8 mm, all above theirs: 0.41 N.m (catalogue 0.25) at 1000 N, 0.40 and 0.52 "
    "N.m (0.34 to 0.38) at 1500 N"
)


def carried_over(friction_set: FrictionSet, parameters: Parameters) -> str:
    """One sentence if the friction numbers were measured on another screw or with another oil; else "".

    Numbers that the screw file states, all that the set fits, are those of its user.
    """
    if not friction_set.parameters_hash or friction_set.parameters_hash == parameters_hash(parameters):
        return ""
    friction = parameters.friction
    stated = {name for name in FITTED if getattr(friction, name) is not None}
    if friction.ball_thrust is not None:
        stated.add("net_sliding_coefficient")
    if stated >= set(SETS[friction_set.name]):
        return ""
    return (
        f"the numbers of friction set {friction_set.name} were measured on {friction_set.screw or 'another screw'}, "
        f"not on {parameters.name} with this oil: compare the catalogue torque ({CATALOGUE}, 100 r/min), or calibrate "
        "with measured torques"
    )


def with_set(parameters: Parameters, name: str) -> Parameters:
    """Parameters with a law of the same surface speeds; overrides in the screw file belong to its own law.

    Raises       ValueError: a law with other surface speeds
    """
    if name == parameters.friction.law:
        return parameters
    kinematics = parameters.friction.kinematics
    if name not in (known := Law.of_kinematics(kinematics)):
        raise ValueError(
            f"friction set = {name}; allowed with kinematics {kinematics}: {', '.join(known)}; the "
            "kinematics decides the friction law"
        )
    return changed(without_overrides(parameters, name), friction={"law": name})


def without_overrides(parameters: Parameters, name: str) -> Parameters:
    """Parameters without the fitted numbers of a law that the screw file states."""
    stated = set(overridable(Law(name))) & parameters.friction.model_fields_set
    return changed(parameters, friction=dict.fromkeys(stated)) if stated else parameters


def refuse_other_fit(friction: FrictionSet, parameters: Parameters) -> None:
    """Refuse a set of other kinematics, and one fitted to another screw or oil.

    Raises       MapError (a ValueError)
    """
    ours = parameters_hash(parameters)
    if friction.kinematics != parameters.friction.kinematics:
        raise MapError(
            f"friction set {friction.name}: kinematics = {friction.kinematics}; "
            f"expected {parameters.friction.kinematics}"
        )
    if friction.parameters_hash and friction.parameters_hash != ours:
        raise MapError(
            f"friction set {friction.name} is fitted for the screw {friction.screw} ({friction.parameters_hash}); "
            f"expected {parameters.name} ({ours}): calibrate again with this screw file"
        )
