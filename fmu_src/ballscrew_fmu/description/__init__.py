"""Model descriptions of the FMUs as XML."""
