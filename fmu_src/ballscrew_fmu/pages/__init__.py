"""Documentation pages inside the FMUs."""
