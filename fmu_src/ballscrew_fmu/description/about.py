"""Version, author, copyright, licence and date in all FMUs, from the metadata of the package and its licence file."""

import os
from datetime import UTC, datetime
from importlib.metadata import distribution

from ballscrew_tehl import __date__, __version__


def licence_text() -> str:
    """Text of the licence of this package."""
    files = distribution("ballscrew-tehl").files or ()
    return next(file.read_text(encoding="utf-8") for file in files if file.name == "LICENSE")


def about() -> dict[str, str]:
    """Attributes of the model description by name, the same in FMI 2.0 and 3.0.

    The date is that of the version, so that the same input gives the same FMU; the variable SOURCE_DATE_EPOCH of
    reproducible builds [s since 1970] replaces it.

    Raises       ValueError: SOURCE_DATE_EPOCH is not a number of seconds
    """
    notice = next(line for line in licence_text().splitlines() if line.startswith("Copyright"))
    made = datetime.fromisoformat(__date__).replace(tzinfo=UTC)
    if epoch := os.environ.get("SOURCE_DATE_EPOCH"):
        made = datetime.fromtimestamp(int(epoch), UTC)
    return {
        "author": notice.split(" ", 3)[3],  # Copyright (c) year author
        "version": __version__,
        "copyright": notice,
        "license": distribution("ballscrew-tehl").metadata["License-Expression"],
        "generationDateAndTime": made.strftime("%Y-%m-%dT%H:%M:%SZ"),
    }
