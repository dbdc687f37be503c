"""Contacts of the mechanistic law, of the atlas or solved: the solver, with numba, is imported only there."""

from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.mechanistic import ContactValues
from ..parameters.file import Parameters


def contacts_of(parameters: Parameters, solved: bool = False) -> ContactValues:
    """Contacts from the atlas, or solved if it does not hold this oil or geometry, or in any case."""
    try:
        if not solved:
            return BallContacts(parameters)
    except OutsideAtlasError as outside:
        try:
            from . import direct
        except ModuleNotFoundError as error:
            raise OutsideAtlasError(f"{outside}; {error.msg}") from error
    from . import direct

    return direct.DirectContacts(parameters)
