"""Contacts of the mechanistic law, of the atlas or solved: the solver, with numba, is imported only there."""

from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.mechanistic import ContactValues
from ..parameters.file import Parameters


def contacts_of(parameters: Parameters, solved: bool = False) -> ContactValues:
    """Contacts from the atlas, or solved.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    solved : bool, optional
        Solve them in any case; else only what the atlas does not include.

    Returns
    -------
    ContactValues
        Contacts of the balls.

    Raises
    ------
    OutsideAtlasError
        Not in the atlas, and numba is missing.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> type(contacts_of(load_screw("example_25x10.toml"))).__name__
    'BallContacts'
    """
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
