"""Commands in processes of their own."""

import multiprocessing
import os
import platform
import shlex
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

from paths import ROOT

RUNS_HERE = sys.platform == "linux" and platform.machine() == "x86_64"


def output(*arguments, program=sys.executable, folder=ROOT, refused=False, **environment):
    """What a program, by default Python, prints; it must end with exit code 0, or with another one if `refused`."""
    command, variables = [program, *map(str, arguments)], os.environ | environment
    run = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    report = f"{shlex.join(command)}\n{run.stdout[-2000:]}\n{run.stderr[-3000:]}"
    assert (run.returncode != 0) == refused, report
    return run.stdout


def elsewhere(function, *arguments):
    """Result of a function in a new process, which has another hash seed."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()
