"""The native FMUs: C sources, compiler, package."""
