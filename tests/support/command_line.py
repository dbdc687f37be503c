"""The command line, run in this process."""

import signal

from ballscrew_tehl.cli import main as cli


def run(capsys, *arguments):
    """Exit code, stdout, stderr."""
    try:
        code = cli.main([*map(str, arguments)])
    except SystemExit as leave:
        code = leave.code
    return code, *capsys.readouterr()


def refused(capsys, *arguments):
    """The line of the error message."""
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    (line,) = [line for line in err.splitlines() if "error" in line]
    assert "Traceback" not in err
    return line


def interruptible():
    """Ctrl-C reaches a child also where the tests themselves run in the background of a script, which ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
