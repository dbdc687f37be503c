"""Packs the native FMUs, FMI 2.0 and FMI 3.0: libraries, sources, map, documentation, icon, reference results.

Same map, code and ziglang give the same bytes. The token in description and libraries is a hash of the files of the FMU
and of the sources and options that the libraries are compiled from.
"""

import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

from ballscrew_fmu.archive import NAMESPACE, BuiltFmu, built
from ballscrew_fmu.description.native import build_description, native_description, terminals
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.compile import (
    COMPILER_OPTIONS,
    PLATFORMS,
    build_libraries,
    find_compiler,
    universal_library,
)
from ballscrew_fmu.native_fmu.experiments import FOLDER, Reference, reference_files
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.sources import NATIVE_NAME as NATIVE_NAME
from ballscrew_fmu.native_fmu.sources import is_fmi_header, native_sources
from ballscrew_fmu.pages.page import icon, native_documentation
from ballscrew_fmu.python_fmu.solver_cache import digest
from ballscrew_tehl import __version__
from ballscrew_tehl.runtime.evaluate import NutMap

FMI2_FOLDERS = {
    "x86_64-linux": "linux64",
    "x86_64-windows": "win64",
    "aarch64-linux": "aarch64-linux",
    "aarch64-darwin": "aarch64-darwin",
}  # in addition darwin64, a universal library
UNIVERSAL = ("x86_64-darwin", "aarch64-darwin")


def native_files(
    nut_map: NutMap,
    fmi_version: int,
    reference: Reference | None = None,
    platforms: Sequence[str] = tuple(PLATFORMS),
    model: FmuModel = FRICTION,
    embed_map: bool = False,
    live_page: str = "",
) -> dict[str, bytes]:
    """Files of one native FMU by path, with its token.

    Parameters   fmi_version : 2 or 3;  platforms : names from compile.PLATFORMS
                 embed_map : compile the map into the libraries, which then open no file
                 live_page : for the documentation; "": none
    Raises       BuildError or SourceError, with a message of one line
    """
    header = nut_map.header
    compiler = find_compiler()
    tool = f"ballscrew-tehl {__version__} with {compiler.name}"
    files = {
        **({} if embed_map else {f"resources/{MAP_FILE}": map_bytes(nut_map)}),
        # FMILibrary refuses the file of FMI 3.0 in an FMI 2.0 FMU
        **({"terminalsAndIcons/terminalsAndIcons.xml": terminals(model)} if fmi_version == 3 else {}),
        "terminalsAndIcons/icon.svg": icon("svg"),
        "terminalsAndIcons/icon.png": icon("png"),
    }
    if fmi_version == 2:
        files["model.png"] = icon("png")
    built_for = f"libraries for {', '.join(platforms)}"
    documentation = native_documentation(header, fmi_version, built_for, model, embed_map, live_page)
    files |= {f"documentation/{name}": content for name, content in documentation.items()}
    if reference is not None:
        files |= {f"{FOLDER}/{name}": text for name, text in reference_files(reference, model).items()}

    def complete(token: str) -> tuple[dict[str, bytes], dict[str, bytes]]:
        """All sources; the files of the FMU among them, with the descriptions."""
        sources = native_sources(header, fmi_version, token, model, nut_map if embed_map else None)
        units = sorted(name for name in sources if name.endswith(".c"))
        shown = {f"sources/{name}": text for name, text in sources.items() if not is_fmi_header(name)}
        shown["sources/buildDescription.xml"] = build_description(units, model)
        shown["modelDescription.xml"] = native_description(header, fmi_version, token, tool, units, model)
        return sources, shown

    sources, shown = complete("")
    recipe = {"recipe": " ".join((compiler.name, *COMPILER_OPTIONS, *platforms)).encode()}
    token = str(uuid.uuid5(NAMESPACE, digest({**files, **shown, **sources, **recipe})))
    sources, shown = complete(token)
    libraries = build_libraries(sources, model.native_name, platforms)
    return {**files, **shown, **_binaries(libraries, fmi_version, model.native_name)}


def _binaries(libraries: Mapping[str, bytes], fmi_version: int, name: str) -> dict[str, bytes]:
    if fmi_version == 2:
        placed = {FMI2_FOLDERS[p]: (p, content) for p, content in libraries.items() if p in FMI2_FOLDERS}
        slices = [libraries[platform] for platform in UNIVERSAL if platform in libraries]
        if slices:
            placed["darwin64"] = (UNIVERSAL[0], universal_library(slices))
    else:
        placed = {platform: (platform, content) for platform, content in libraries.items()}
    return {
        f"binaries/{folder}/{name}{PLATFORMS[platform].suffix}": content
        for folder, (platform, content) in placed.items()
    }


def native_file_name(fmi_version: int, model: FmuModel = FRICTION) -> str:
    return f"{model.native_name}_fmi{fmi_version}.fmu"


def build_native_fmu(
    nut_map: NutMap,
    fmi_version: int,
    path: Path | str,
    reference: Reference | None = None,
    platforms: Sequence[str] = tuple(PLATFORMS),
    model: FmuModel = FRICTION,
    embed_map: bool = False,
    live_page: str = "",
) -> BuiltFmu:
    """Build one native FMU of a map, written to path. Other arguments as in native_files."""
    files = native_files(nut_map, fmi_version, reference, platforms, model, embed_map, live_page)
    return built(path, files)
