"""Runs a command of a face: `ballscrew` (ballscrew_fmu.command), python -m ballscrew_tehl, python -m ballscrew_fmu.

Exit codes: 0 done; 1 a computation or check failed; 2 bad input, with one line on stderr that names what is
allowed. Results go to stdout, everything else to stderr. Modules are imported when a command runs: results from the
map must not wait for the import of the solver, nor completion for that of any.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from pkgutil import resolve_name

from .parser import SOLVER, Command, build_parser
from .shared.extras import missing_extra
from .shared.files import os_error_text
from .shared.results import CommandError

#: exit code after Ctrl-C: 128 and the number of the signal
INTERRUPTED = 130


def main(
    arguments: Sequence[str] | None = None,
    prog: str = "python -m ballscrew_tehl",
    command: Command = SOLVER,
) -> int:
    """Run one command.

    Parameters   arguments : without the program's name; None = those of the process
                 prog : name of the program in help and messages;  command : its commands, or its only one
    Returns      exit code, see the top of this file
    """
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

    def ended(code: int, text: str) -> int:
        print(f"{args.prog}: {' '.join(text.split())}", file=sys.stderr)
        return code

    try:
        code = int(resolve_name(args.run)(args))
        print(end="", flush=True)
        return code
    except ModuleNotFoundError as err:
        remedy = missing_extra(err)
        if remedy is None:
            raise
        return ended(2, f"error: {remedy}")
    except (KeyboardInterrupt, SystemError) as err:
        # an interrupt inside compiled code comes as the cause of a SystemError, or as that of its cause
        cause: BaseException | None = err
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__
        if cause is None:
            raise
        return ended(INTERRUPTED, "; ".join(filter(None, ("interrupted", args.interrupted))))
    except BrokenPipeError:
        # the reader of a pipe (head, less) has exited: no error message, also not from the interpreter's own flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except CommandError as err:
        return ended(1, f"error: {err}")
    except (ValueError, OSError) as err:
        return ended(2, f"error: {os_error_text(err) if isinstance(err, OSError) else err}")
    except MemoryError as err:
        reason = str(err) or "no number given"
        return ended(2, f"error: not enough memory ({reason}): fewer nodes or a smaller domain")
    except ArithmeticError as err:
        return ended(1, f"not converged: {err}")
