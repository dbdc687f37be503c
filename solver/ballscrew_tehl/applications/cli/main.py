"""Runs a command of a face: `ballscrew` (ballscrew_fmu.command), python -m ballscrew_tehl, python -m ballscrew_fmu.

Exit codes: 0 done; 1 a computation or check failed; 2 bad input, with one line on stderr that names what is
allowed. Results go to stdout, everything else to stderr. Modules are imported when a command runs: results from the
map must not wait for the import of the solver, nor completion for that of any.
"""

import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from pkgutil import resolve_name

from .parser import SOLVER, Command, build_parser
from .shared.output import REMEDIES, CommandError, say, show

#: optional package: extra of pyproject.toml that brings it
EXTRAS = {"matplotlib": "report", "jinja2": "report", "markupsafe": "report", "fmpy": "fmu", "pythonfmu": "fmu",
          "distributed": "dask", "numba": "direct"}  # fmt: skip
#: exception, exit code, what stands before its text
FAILURES = (
    (CommandError, 1, "error"),
    (ValueError, 2, "error"),
    (MemoryError, 2, "error: not enough memory, take fewer nodes or a smaller domain"),
    (ArithmeticError, 1, "not converged"),
)


def main(
    arguments: Sequence[str] | None = None,
    prog: str = "python -m ballscrew_tehl",
    command: Command = SOLVER,
) -> int:
    """Exit code of one command; arguments without the program's name, prog: that name in help and messages."""
    # the solver's matrices are small: BLAS threads would cost more than they save (read when numpy is imported)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if isinstance(sys.stdout, TextIOWrapper):
        # names from a file in a terminal or pipe without their letters
        sys.stdout.reconfigure(errors="backslashreplace")
    parser = build_parser(prog, command)
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser)
    args = parser.parse_args(arguments)
    try:
        code = show(resolve_name(args.run)(args), args.json)
        print(end="", flush=True)
        return code
    except BrokenPipeError:
        # the reader of a pipe (head, less) has exited: no error message, also not from the interpreter's own flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except (Exception, KeyboardInterrupt) as error:
        code, text = _failure(error)
        if not text:
            raise
        say(f"{args.prog}: {' '.join(text.split())}")
        return code


def _failure(error: BaseException) -> tuple[int, str]:
    """Exit code and line of an exception; line "": a defect of the program."""
    if isinstance(error, OSError):
        remedy = REMEDIES.get(error.errno or 0, "check path and permissions")
        named = f"{error.filename}: {error.strerror}; remedy: {remedy}"
        return 2, f"error: {named if error.filename and error.strerror else error}"
    for kind, code, words in FAILURES:
        if isinstance(error, kind):
            return code, f"{words}: {error}"
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or "").partition(".")[0]
        remedy = f"remedy: python -m pip install 'ballscrew-tehl[{EXTRAS.get(package)}]'"
        return 2, f"error: {package} is not installed; {remedy}" if package in EXTRAS else ""
    # an interrupt inside compiled code comes as the cause of a SystemError, or as that of its cause
    cause: BaseException | None = error
    while isinstance(cause, SystemError):
        cause = cause.__cause__
    if isinstance(cause, KeyboardInterrupt):
        # 128 and the number of the signal
        return 130, "interrupted"
    return 1, ""
