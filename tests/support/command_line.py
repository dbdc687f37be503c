"""The command line, run in this process."""

import json

from ballscrew_tehl.applications.cli.main import main


def run(capsys, *arguments):
    """Exit code, stdout, stderr."""
    try:
        code = main([*map(str, arguments)])
    except SystemExit as leave:
        code = leave.code
    return code, *capsys.readouterr()


def answer(capsys, *arguments):
    """What --json prints, stderr."""
    code, out, err = run(capsys, *arguments, "--json")
    assert code == 0, err
    return json.loads(out), err


def refused(capsys, *arguments):
    """The line of the error message."""
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, ""), err
    (line,) = [line for line in err.splitlines() if "error" in line]
    assert "Traceback" not in err
    return line
