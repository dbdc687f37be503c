"""The tables of the variables of the FMUs."""
