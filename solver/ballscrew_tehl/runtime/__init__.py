"""What a step of an FMU computes; numpy and the standard library only, because it travels inside the Python FMU."""
