"""Checks of a built FMU: validation, replay in fmpy, comparison with the map."""
