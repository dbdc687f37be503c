"""Packs the native FMUs, FMI 2.0 and FMI 3.0: libraries, sources, map, documentation, icon, reference results.

Same map, code and ziglang give the same bytes. The libraries are the same for all screws: what an FMU is of is in its
resources. The token in description and resources is a hash of the files of the FMU.
"""

import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

from ballscrew_fmu.archive import NAMESPACE, BuiltFmu, built
from ballscrew_fmu.description.model_description import build_description, native_description, terminals
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.compile import PLATFORMS, build_libraries, universal_library
from ballscrew_fmu.native_fmu.libraries import contents, native_library, provider
from ballscrew_fmu.native_fmu.resource_files import MAP_FILE, SCREW_FILE, map_bytes, screw_bytes
from ballscrew_fmu.native_fmu.sources import Embedded, is_fmi_header, native_sources, table_hash, units_of
from ballscrew_fmu.native_fmu.validation import Reference, reference_files
from ballscrew_fmu.pages.page import documentation_files, icon
from ballscrew_tehl import __version__
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.user_cache import digest

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

    fmi_version: 2 or 3; platforms: names from compile.PLATFORMS; embed_map: compile map and screw into the libraries,
    which then open no file; needs a compiler; live_page: for the documentation; "": none. BuildError or SourceError,
    with a message of one line.
    """
    header, units = nut_map.header, units_of(model)
    tool = f"ballscrew-tehl {__version__} with {provider(header, embed_map).name}"
    hash_of_table = table_hash(header, model)
    map_file = {f"resources/{MAP_FILE}": map_bytes(nut_map)}
    files = {f"terminalsAndIcons/icon.{kind}": icon(kind) for kind in ("svg", "png")}
    if fmi_version == 2:
        files["model.png"] = icon("png")
    else:  # FMILibrary refuses this file in an FMI 2.0 FMU
        files["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(model)
    built_for = f"libraries for {', '.join(platforms)}"
    documentation = documentation_files(header, model, live_page, (fmi_version, built_for))
    files |= {f"documentation/{name}": content for name, content in documentation.items()}
    if reference is not None:
        files |= reference_files(reference)

    def of_token(token: str) -> tuple[dict[str, bytes], bytes]:
        description = native_description(header, fmi_version, token, tool, units, model)
        return {"modelDescription.xml": description}, screw_bytes(header, model, hash_of_table, token)

    sources = native_sources(header, (fmi_version,), model)
    files["sources/buildDescription.xml"] = build_description(units, model)
    files |= _in_fmu(sources)
    if not embed_map:
        files |= _binaries(contents(native_library(header, model), platforms), fmi_version, model.native_name)
    description, screw = of_token("")
    token = str(uuid.uuid5(NAMESPACE, digest({**files, **map_file, **description, SCREW_FILE: screw})))
    description, screw = of_token(token)
    files |= description
    if not embed_map:
        return {**files, **map_file, f"resources/{SCREW_FILE}": screw}
    sources = native_sources(header, (fmi_version,), model, Embedded(nut_map, screw))
    libraries = build_libraries(sources, units, model.native_name, platforms)
    return {**files, **_in_fmu(sources), **_binaries(libraries, fmi_version, model.native_name)}


def _in_fmu(sources: Mapping[str, bytes]) -> dict[str, bytes]:
    return {f"sources/{name}": text for name, text in sources.items() if not is_fmi_header(name)}


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
    """Build one native FMU of a map.

    Parameters
    ----------
    nut_map : NutMap
        Map of the screw.
    fmi_version : int
        Version of FMI, 2 or 3.
    path : path or str
        The file, replaced if it exists.
    reference : Reference, optional
        Reference results in the FMU.
    platforms : sequence of str, optional
        Names from compile.PLATFORMS.
    model : FmuModel, optional
        Model of the FMU.
    embed_map : bool, optional
        Compile map and screw into the libraries, which then open no file; needs a compiler.
    live_page : str, optional
        Page for the documentation; "": none.

    Returns
    -------
    BuiltFmu
        Path, token, hash and size.

    Raises
    ------
    BuildError
        With a message of one line.
    OSError
        The folder cannot be written.

    Notes
    -----
    Same map, code and compiler give the same bytes.

    Examples
    --------
    >>> from ballscrew_tehl import load_map
    >>> build_native_fmu(load_map(), 2, "friction.fmu").size  # doctest: +SKIP
    2369590
    """
    files = native_files(nut_map, fmi_version, reference, platforms, model, embed_map, live_page)
    return built(path, files)
