"""Version of the package, and the date of the version; before its release, of the start of the work on it."""

__version__ = "0.1.0"
__date__ = "2026-11-21"
