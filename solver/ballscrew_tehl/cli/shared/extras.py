"""Optional dependencies: which extra of the installation brings a package that is missing."""

#: package to be imported: extra of pyproject.toml that brings it
EXTRAS = {
    **dict.fromkeys(("matplotlib", "jinja2", "markupsafe"), "report"),
    **{"fmpy": "fmu", "pythonfmu": "fmu", "distributed": "dask"},
}


def missing_extra(error: ModuleNotFoundError) -> str | None:
    """One line with the remedy for a package of an extra that is not installed; None: it is of none.

    >>> missing_extra(ModuleNotFoundError("No module named 'matplotlib.figure'", name="matplotlib.figure"))
    "matplotlib is not installed; remedy: python -m pip install 'ballscrew-tehl[report]'"
    >>> missing_extra(ModuleNotFoundError("No module named 'ballscrew'", name="ballscrew"))
    """
    package = (error.name or "").partition(".")[0]
    if package not in EXTRAS:
        return None
    return f"{package} is not installed; remedy: python -m pip install 'ballscrew-tehl[{EXTRAS[package]}]'"
