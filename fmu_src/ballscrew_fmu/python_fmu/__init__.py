"""The FMUs for Python hosts, built with pythonfmu."""
