"""What the commands of the FMUs do. What needs the extra `fmu` is imported when a command runs."""

import ast
import contextlib
import shutil
import site
import sysconfig
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ballscrew_tehl.applications.cli.shared.output import (
    Answer,
    CommandError,
    check_output,
    new_folder,
    progress_bar,
    say,
    table,
    try_folder,
    written,
)

if TYPE_CHECKING:
    from ballscrew_fmu.build import Inputs
    from ballscrew_tehl.applications.report.data import OperatingPoint
    from ballscrew_tehl.applications.report.page import Html
    from ballscrew_tehl.applications.screw_model import ScrewModel
    from ballscrew_tehl.runtime.evaluate import NutMap

#: where a wheel puts the examples, below the prefix of the environment (pyproject.toml)
INSTALLED = Path("share", "ballscrew-tehl", "examples")
#: progress of a live page
COMPILING = "live page: intervals computed, code compiled"


@contextlib.contextmanager
def _failing(nothing: str) -> Iterator[None]:
    """Errors of checks, compiler and sources as those of a command, after these words."""
    from ballscrew_fmu.checks.replay import CheckError
    from ballscrew_fmu.native_fmu.compile import BuildError

    try:
        yield
    except CheckError as error:
        raise CommandError(f"check failed, {nothing}: {error}") from error
    except BuildError as error:
        raise CommandError(f"{nothing}: {error}") from error


def inputs_of(args: Namespace) -> "Inputs":
    """Screw, map and friction set of the options INPUTS."""
    from ballscrew_fmu.build import Inputs
    from ballscrew_tehl.applications.cli.shared.inputs import chosen_of, map_of

    chosen = chosen_of(args)
    return Inputs(chosen.parameters, map_of(chosen), chosen.friction_set)


def run_build(args: Namespace) -> Answer:
    """Build, check and deliver the FMUs, with their torque over the measured one."""
    from ballscrew_fmu import build
    from ballscrew_tehl.runtime.packed import map_hash

    folder = Path(args.output)
    try_folder(f"--output = {folder}", folder)
    if args.screw and args.screw_file:
        raise ValueError(f"{args.screw_file} and --screw = {args.screw}; give one screw file")
    selected = build.kinds(args.only, args.fmi, args.python_only)
    args.screw = args.screw_file or args.screw
    inputs = inputs_of(args)
    columns = (TextColumn("{task.description:<40}"), BarColumn(24), TimeElapsedColumn())
    console = Console(stderr=True)
    with (
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress,
        written("--output", folder),
        _failing("no FMU delivered"),
    ):
        total = build.steps(selected)
        task = progress.add_task("packing", total=total)

        def advance(text: str, steps: int) -> None:
            progress.update(task, description=text, advance=steps)
            if progress.disable:
                say(f"{progress.tasks[task].completed:.0f} of {total}: {text}")

        with new_folder(folder):
            fmus, note = build.build(inputs, folder, selected, advance, args.embed_map)
    friction = inputs.nut_map.header.get("friction")
    for text in (friction and friction["carried_over"], note):
        if text:
            say(text)
    files = [{"file": str(path), "check": line, "sha256": fmu.sha256} for path, (fmu, line) in fmus.items()]
    tables = build.torque_tables(inputs)
    lines = [tables, ""] if tables else []
    lines += [f"{path.name}: {line}" for path, (_, line) in fmus.items()]
    if friction:
        lines.append(
            f"friction: {friction['set']}, {friction['loss'] or 'not fitted'}; {friction['provenance']}"
        )
    lines += [f"{path}  {fmu.size / 1024:.0f} kB" for path, (fmu, _) in fmus.items()]
    result = {"fmus": files, "friction": friction, "map_hash": map_hash(inputs.nut_map.header)}
    return Answer([result], text="\n".join(lines))


def run_check(args: Namespace) -> Answer:
    """Validate an FMU and replay its reference."""
    from ballscrew_fmu.checks.check import check_file
    from ballscrew_fmu.checks.replay import CheckError

    try:
        lines = check_file(Path(args.fmu))
    except CheckError as error:
        raise CommandError(f"{args.fmu}: {error}") from error
    return Answer([{"file": args.fmu, "checks": lines}], text="\n".join(lines))


def run_info(args: Namespace) -> Answer:
    """Kinds, platforms and variables of an FMU."""
    from ballscrew_fmu.checks.check import fmu_info

    info = fmu_info(Path(args.fmu))
    kinds, platforms = " and ".join(info["kinds"]), ", ".join(info["platforms"])
    head = ("variable", "causality", "unit", "start", "min", "max")
    rows = [[str(v[key] or "") for key in ("name", *head[1:])] for v in info["variables"]]
    lines = [
        f"{info['model']}, FMI {info['fmi_version']}, {kinds}, {platforms}",
        info["description"],
        f"{info['tool']}, {info['token']}",
        *filter(None, [info["map"]]),
        table(head, rows, left=3),
    ]
    return Answer([info], text="\n".join(lines))


def run_page(args: Namespace) -> Answer:
    """Write the live page of a screw."""
    from ballscrew_fmu.archive import write_whole
    from ballscrew_tehl.runtime.packed import map_hash

    output = check_output("--output", args.output, "a file *.html, *.htm")
    inputs = inputs_of(args)
    with _failing("no page written"), progress_bar() as progress:
        progress(0, 1, COMPILING)
        content = inputs.live_page().encode()
        progress(1, 1, COMPILING)
    with written("--output", output):
        write_whole(output, content)
    result = {"file": str(output), "bytes": len(content), "map_hash": map_hash(inputs.nut_map.header)}
    return Answer([result], text="{file}  {bytes} bytes".format(**result))


def run_report(args: Namespace) -> Answer:
    """The report of ballscrew_tehl with the live page in it; without ziglang it has none."""
    from ballscrew_fmu.build import Inputs
    from ballscrew_fmu.live_page.page import live_frame
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_tehl.applications.cli.commands.report import run_report

    def live(chosen: "ScrewModel", nut_map: "NutMap", point: "OperatingPoint") -> "Html | None":
        try:
            return live_frame(Inputs(chosen.parameters, nut_map, chosen.friction_set).live_page(point))
        except BuildError as error:
            say(f"the report has no live page: {error}")
            return None

    return run_report(args, live)


def run_app(args: Namespace) -> Answer:
    """Serve the page of the app until it is interrupted."""
    import threading
    import webbrowser

    from ballscrew_fmu.app.page import app_of
    from ballscrew_tehl.parameters.toml import parsed_toml

    text = ""
    if args.screw_file:
        file = Path(args.screw_file)
        try:
            text = file.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise ValueError(f"{file}: cannot be read ({error}); give the path of a screw file") from error
        parsed_toml(text, str(file))
    try:
        server = app_of(text, int(args.port or 0))
    except OSError as error:
        raise ValueError(
            f"--port = {args.port}: {error.strerror}; allowed: a free port, 1024 to 65535"
        ) from error
    print(server.address, flush=True)
    if not args.no_browser:
        # some browsers return when they are closed
        threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
    with server, contextlib.suppress(KeyboardInterrupt):
        server.serve_forever()
    return Answer([{"address": server.address}], text="")


def run_examples(args: Namespace) -> Answer:
    """List or copy the example scripts."""
    try:
        folder = examples_folder() if args.copy is None else copy_examples(Path(args.copy))
    except OSError as error:
        raise ValueError(f"--copy {args.copy}: {error.strerror or error}") from error
    titles = {}
    for script in sorted(folder.glob("*.py")):
        documentation = ast.get_docstring(ast.parse(script.read_bytes())) or ""
        titles[script.name if args.copy is None else str(script)] = documentation.partition("\n")[0]
    return Answer([titles], text="\n".join(f"{name}  {title}" for name, title in titles.items()))


def examples_folder() -> Path:
    """The folder of the examples: of the source tree, or as installed by a wheel.

    FileNotFoundError: neither is there.
    """
    package = Path(__file__).resolve().parent
    prefixes = sysconfig.get_path("data"), site.getuserbase(), package.parent  # of `pip install --target`
    for folder in (package.parents[1] / "examples", *(Path(prefix, INSTALLED) for prefix in prefixes)):
        if (folder / "torque_over_speed.py").is_file():
            return folder
    raise FileNotFoundError("the examples are not installed: pip install the wheel of ballscrew-tehl")


def copy_examples(folder: Path) -> Path:
    """Copy the examples into a new folder, which is returned.

    ValueError: the folder has files; FileNotFoundError: the examples are not installed.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"{folder} exists and is not empty: give a new folder")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(examples_folder(), folder, ignore=ignored, dirs_exist_ok=True)
    return folder
