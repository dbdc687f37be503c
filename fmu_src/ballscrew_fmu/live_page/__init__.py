"""The live page: the C text of the FMU as WebAssembly, with a map, in one HTML file."""
