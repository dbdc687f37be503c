"""Contacts of the mechanistic law, of the atlas or solved; the solver is imported where it solves only."""

from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.mechanistic import ContactValues
from ..parameters.file import Parameters


def contacts_of(parameters: Parameters, solved: bool = False) -> ContactValues:
    """Contacts from the atlas, or solved if it does not hold this oil or geometry; solved: in any case.

    Raises       OutsideAtlasError (a ValueError): the atlas does not hold them, and numba, which solves, is missing
    """
    outside = ""
    if not solved:
        try:
            return BallContacts(parameters)
        except OutsideAtlasError as error:
            outside = str(error)
    try:
        from .direct import DirectContacts
    except ModuleNotFoundError as error:
        if not outside:
            raise
        raise OutsideAtlasError(f"{outside}; {error.msg}") from error
    return DirectContacts(parameters)
