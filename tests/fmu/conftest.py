"""FMUs of the closed-form map, each built once for all tests and all workers."""

import contextlib
import functools
import os
from pathlib import Path
from urllib.parse import urlsplit

import fmpy
import pytest
import stub_solver
from browser import NEEDS, Browser
from filelock import FileLock
from native_library import CS, NativeInstance
from processes import RUNS_HERE
from synthetic_map import closed_form

from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import this_platform
from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.runtime.packed import Law
from ballscrew_tehl.runtime.user_cache import user_cache as user_cache_folder


def _common_folder(tmp_path_factory) -> Path:
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "built_fmus"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """Function (model, kind, law) -> FMU file; kind: python, or 2 or 3 for the native one of this FMI version.

    Those for Python hosts refine with the stub; native ones are for this machine and have the reference of a build.
    """
    folder = _common_folder(tmp_path_factory)

    @functools.cache
    def build(model=FRICTION, kind="python", law=Law.THREE_PARAMETER):
        path = folder / f"{law}_{kind}_{model.name}.fmu"
        with FileLock(f"{path}.lock"):
            if not path.exists() and kind == "python":
                build_fmu(closed_form(law), path, solver=stub_solver.SOURCES)
            elif not path.exists():
                nut_map = closed_form(law)
                reference = reference_of(nut_map, model)
                platforms = (this_platform(),)
                build_native_fmu(nut_map, kind, path, reference, platforms=platforms, model=model)
        return path

    return build


@pytest.fixture(scope="session")
def folder_of(built):
    def unpack(*arguments):
        fmu = built(*arguments)
        with FileLock(f"{fmu}.lock"):
            if not (folder := fmu.with_suffix("")).exists():
                fmpy.extract(str(fmu), unzipdir=str(folder))
        return folder

    return functools.cache(unpack)


@pytest.fixture(scope="session")
def opened(folder_of):
    """Function (version, kind, model, law) -> instance; python: of the FMU for Python hosts, FMI 2."""

    def instance(version, kind=CS, model=FRICTION, law=Law.THREE_PARAMETER, **options):
        options = {"model": model, "nut_map": closed_form(law)} | options
        if version == "python":
            if not RUNS_HERE:
                pytest.skip("opens the library for x86_64 Linux")
            folder = folder_of(model, "python", law)
            (library,) = folder.glob(f"binaries/linux64/{model.name}.so")
            token = fmpy.read_model_description(folder).guid
            resources = (folder / "resources").as_uri()
            options = {"library": library, "token": token, "resources": resources} | options
        return NativeInstance(2 if version == "python" else version, kind, **options)

    return instance


@pytest.fixture(scope="session")
def fmu(built):
    return built()


@pytest.fixture(scope="session")
def unpacked(folder_of):
    return str(folder_of())


#: of the C compiler, outside the environment of the tests: an empty cache costs compiling the stubs of five libraries
COMPILER_CACHE = os.environ.get("ZIG_GLOBAL_CACHE_DIR") or os.path.join(
    os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "zig"
)

LIBRARIES = user_cache_folder() / "libraries"  # the same of the compiled libraries


@pytest.fixture(autouse=True)
def user_cache(monkeypatch, tmp_path_factory):
    folder = tmp_path_factory.getbasetemp() / "cache"
    (folder / "ballscrew_tehl").mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(OSError):  # there already; or Windows, which compiles again
        LIBRARIES.mkdir(parents=True, exist_ok=True)
        (folder / "ballscrew_tehl" / "libraries").symlink_to(LIBRARIES)
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", COMPILER_CACHE)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(folder))
    return folder


@pytest.fixture(scope="session")
def browser():
    try:
        engine = Browser()
    except RuntimeError as error:
        pytest.skip(f"the browser does not start; {NEEDS}: {str(error).splitlines()[-1]}")
    yield engine
    engine.close()


@pytest.fixture
def open_page(browser):
    """Function (address, width) -> its page in a browser; no message of the console, no request to another place."""
    pages = {}

    def opened(address, width=1280):
        page = browser.open(address, width)
        pages[page] = (f"{urlsplit(address).scheme}://{urlsplit(address).netloc}", "data:", "blob:")
        return page

    yield opened
    found = [message for page in pages for message in page.messages()]
    found += [url for page, own in pages.items() for url in page.requests() if not url.startswith(own)]
    for page in pages:
        page.close()
    assert found == []
