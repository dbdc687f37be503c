"""Command line: python -m ballscrew_tehl COMMAND.

Exit codes: 0 done; 1 a computation did not converge; 2 bad input, with one line on stderr that names what is
allowed. Results go to stdout, everything else to stderr. Modules are imported when a command runs: results from the
map must not wait for the import of the solver.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence

from .parser import build_parser
from .shared.extras import missing_extra
from .shared.files import os_error_text

#: exit code after Ctrl-C: 128 and the number of the signal
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters   arguments : without the program's name; None = those of the process
    Returns      exit code, see the top of this file
    """
    # the solver's matrices are small: BLAS threads would cost more than they save (read when numpy is imported)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    args = build_parser().parse_args(arguments)
    module, function = args.run.split(".")

    def ended(code: int, text: str) -> int:
        print(f"ballscrew_tehl {args.command}: {' '.join(text.split())}", file=sys.stderr)
        return code

    try:
        return int(getattr(importlib.import_module(f".commands.{module}", __package__), function)(args))
    except ModuleNotFoundError as err:
        remedy = missing_extra(err)
        if remedy is None:
            raise
        return ended(2, f"error: {remedy}")
    except KeyboardInterrupt:
        kept = "; the same command again continues it" if function == "run_map_build" else ""
        return ended(INTERRUPTED, f"interrupted{kept}")
    except BrokenPipeError:
        # the reader of a pipe (head, less) has exited: no error message, also not from the interpreter's own flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ValueError, OSError) as err:
        return ended(2, f"error: {os_error_text(err) if isinstance(err, OSError) else err}")
    except MemoryError as err:
        reason = str(err) or "no number given"
        return ended(2, f"error: not enough memory ({reason}): fewer nodes or a smaller domain")
    except ArithmeticError as err:
        return ended(1, f"not converged: {err}")
