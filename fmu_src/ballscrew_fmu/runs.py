"""What the commands of the FMUs do. What needs the extra `fmu` is imported when a command runs."""

import ast
import json
from argparse import Namespace
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from ballscrew_tehl.cli.shared.files import check_output, new_folder, try_folder, written
from ballscrew_tehl.cli.shared.progress import progress_bar
from ballscrew_tehl.cli.shared.results import Answer, CommandError, say

#: progress of a live page
COMPILING = "live page: intervals computed, code compiled"


def run_build(args: Namespace) -> int:
    """Build, check and deliver the FMUs, with their torque over the measured one."""
    from ballscrew_fmu import build
    from ballscrew_fmu.checks.replay import CheckError
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_fmu.native_fmu.sources import SourceError
    from ballscrew_tehl.runtime.packed import map_hash

    folder = Path(args.output)
    try_folder(f"--output = {folder}", folder)
    if args.screw and args.screw_file:
        raise ValueError(f"{args.screw_file} and --screw = {args.screw}; give one screw file")
    wanted = build.kinds(args.only, args.fmi, args.python_only)
    inputs = build.read_inputs(args.screw_file or args.screw, args.map, args.kinematics, args.friction)
    steps = 2 * len(wanted) + any(kind.model is build.FRICTION for kind in wanted)  # and the live page
    columns = (TextColumn("{task.description:<40}"), BarColumn(24), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("packing", total=steps)

        def advance(text: str) -> None:
            progress.update(task, description=text, advance=1)
            if progress.disable:
                say(f"{progress.tasks[task].completed:.0f} of {steps}: {text}")

        try:
            steps += len(build.to_compile(inputs, wanted, args.embed_map))
            progress.update(task, total=steps)
            with new_folder(folder):
                fmus, tables, note = build.build(inputs, folder, wanted, advance, args.embed_map)
        except OSError as error:
            reason = error.strerror or error
            raise ValueError(f"--output {folder}: {reason}; needs a folder that can be written") from error
        except CheckError as error:
            raise CommandError(f"check failed, no FMU delivered: {error}") from error
        except (BuildError, SourceError) as error:
            raise CommandError(f"no FMU delivered: {error}") from error
    friction = inputs.nut_map.header.get("friction")
    if friction and friction["carried_over"]:
        say(friction["carried_over"])
    if note:
        say(note)
    if args.json:
        files = [
            {"file": str(path), "check": line, "sha256": fmu.sha256} for path, (fmu, line) in fmus.items()
        ]
        print(json.dumps({"fmus": files, "friction": friction, "map_hash": map_hash(inputs.nut_map.header)}))
        return 0
    print(
        "\n".join(
            (*((tables, "") if tables else ()), *(f"{path.name}: {line}" for path, (_, line) in fmus.items()))
        )
    )
    if friction:
        print(f"friction: {friction['set']}, {friction['loss'] or 'not fitted'}; {friction['provenance']}")
    for path, (fmu, _) in fmus.items():
        print(f"{path}  {fmu.size / 1024:.0f} kB\nsha256 {fmu.sha256}")
    return 0


def run_check(args: Namespace) -> int:
    """Validate an FMU and replay its reference."""
    from ballscrew_fmu.checks.file_check import check_file
    from ballscrew_fmu.checks.replay import CheckError

    try:
        lines = check_file(Path(args.fmu))
    except CheckError as error:
        raise CommandError(f"{args.fmu}: {error}") from error
    print(json.dumps({"file": args.fmu, "checks": lines}) if args.json else "\n".join(lines))
    return 0


def run_info(args: Namespace) -> int:
    """Kinds, platforms and variables of an FMU."""
    from ballscrew_fmu.checks.file_check import fmu_info

    info = fmu_info(Path(args.fmu))
    if args.json:
        print(json.dumps(info))
        return 0
    print(
        f"{info['model']}, FMI {info['fmi_version']}, {' and '.join(info['kinds'])}, {', '.join(info['platforms'])}"
    )
    print(f"{info['description']}\n{info['tool']}, {info['token']}")
    if info["map"]:
        print(info["map"])
    table = Table(box=None, pad_edge=False)
    for title in ("variable", "causality", "unit", "start", "min", "max"):
        table.add_column(title, justify="left" if title in ("variable", "causality", "unit") else "right")
    for v in info["variables"]:
        cells = (v["name"], v["causality"], v["unit"], v["start"], v["min"], v["max"])
        table.add_row(*("" if cell is None else str(cell) for cell in cells))
    Console(width=110).print(table)
    return 0


def run_page(args: Namespace) -> int:
    """Write the live page of a screw."""
    from ballscrew_fmu import build
    from ballscrew_fmu.archive import write_whole
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_fmu.native_fmu.sources import SourceError
    from ballscrew_tehl.runtime.packed import map_hash

    output = check_output("--output", args.output, "a file *.html, *.htm")
    inputs = build.read_inputs(args.screw, args.map, args.kinematics, args.friction)
    try:
        with progress_bar() as progress:
            progress(0, 1, COMPILING)
            content = inputs.live_page().encode()
            progress(1, 1, COMPILING)
    except (BuildError, SourceError) as error:
        raise CommandError(f"no page written: {error}") from error
    with written("--output", output):
        write_whole(output, content)
    found = {"file": str(output), "bytes": len(content), "map_hash": map_hash(inputs.nut_map.header)}
    print(json.dumps(found) if args.json else "{file}  {bytes} bytes, map {map_hash}".format(**found))
    return 0


def run_report(args: Namespace) -> Answer:
    """The report of ballscrew_tehl with the live page in it; without ziglang it has none."""
    from ballscrew_fmu import build
    from ballscrew_fmu.live_page.page import live_frame
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_tehl.cli.commands.report import run_report
    from ballscrew_tehl.cli.shared.chosen import Chosen
    from ballscrew_tehl.report.data import OperatingPoint
    from ballscrew_tehl.report.page import Html
    from ballscrew_tehl.runtime.evaluate import NutMap

    def live(chosen: Chosen, nut_map: NutMap, point: OperatingPoint) -> Html | None:
        try:
            inputs = build.Inputs(chosen.parameters, nut_map, chosen.friction_set)
            return live_frame(inputs.live_page(point))
        except BuildError as error:
            say(f"the report has no live page: {error}")
            return None

    return run_report(args, live)


def run_examples(args: Namespace) -> int:
    """List or copy the example scripts."""
    from ballscrew_fmu.example_files import copy_examples, examples_folder

    try:
        scripts = (
            sorted(examples_folder().glob("*.py")) if args.copy is None else copy_examples(Path(args.copy))
        )
    except OSError as error:
        raise ValueError(f"--copy {args.copy}: {error.strerror or error}") from error
    titles = {
        script.name if args.copy is None else str(script): (
            ast.get_docstring(ast.parse(script.read_bytes())) or ""
        ).partition("\n")[0]
        for script in scripts
    }
    print(
        json.dumps(titles) if args.json else "\n".join(f"{name}  {title}" for name, title in titles.items())
    )
    return 0
