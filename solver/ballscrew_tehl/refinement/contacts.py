"""Where the contacts of a screw come from: the atlas, or the solver, which needs numba."""

from typing import TYPE_CHECKING, Union

from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..parameters.file import Parameters

if TYPE_CHECKING:
    from .direct import DirectContacts


def contacts_of(parameters: Parameters) -> Union[BallContacts, "DirectContacts"]:
    """Contacts from the atlas, or solved if it does not hold this oil or geometry."""
    try:
        return BallContacts(parameters)
    except OutsideAtlasError:
        return solved_contacts(parameters)


def solved_contacts(parameters: Parameters) -> "DirectContacts":
    """Contacts by the solver, whatever the atlas holds."""
    from .direct import DirectContacts

    return DirectContacts(parameters)
