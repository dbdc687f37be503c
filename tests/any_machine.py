"""The tests on machines that this one is not: other instruction sets, BLAS kernels, compilers, users, load.

    python tests/any_machine.py                    the quick tests, one machine after the other
    python tests/any_machine.py --all              all tests
    python tests/any_machine.py --only zen -- tests/physics

Each machine is a set of environment variables: the kernels of OpenBLAS, what NumPy and Numba may use of the processor,
the flags of the C runtime. Exit code 1 if one of them is red. What follows -- goes to pytest.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from numpy._core._multiarray_umath import __cpu_dispatch__

from ballscrew_tehl.runtime.user_cache import user_cache

ROOT = Path(__file__).resolve().parents[1]
#: beginnings of the names of what NumPy may leave unused: AVX-512; and all above SSE
AVX512, ALL = ("AVX512", "X86_V4", "AVX10"), ("",)


class Machine(NamedTuple):
    """A machine to emulate."""

    blas: str  # OPENBLAS_CORETYPE
    without: tuple[str, ...]  # features of the processor that NumPy does not use
    c_flags: str  # of the C runtime, after its own
    generic: bool = False  # Numba for any processor of this kind, without FMA
    ordinary: bool = False  # a user without the rights of root, no UTF-8 locale
    busy: bool = False  # two processes that compute all the time


MACHINES = {
    "zen": Machine("Zen", AVX512, "-O3 -ffp-contract=fast", ordinary=True),
    "haswell": Machine("Haswell", AVX512, "-O3 -ffp-contract=off", busy=True),
    "nehalem": Machine("Nehalem", ALL, "-O0 -ffp-contract=off", generic=True),
    "skylakex": Machine("SkylakeX", (), "-O0 -ffp-contract=fast", ordinary=True, busy=True),
}


def environment(machine: Machine) -> dict[str, str]:
    """Environment variables of a machine."""
    env = dict(os.environ, OPENBLAS_CORETYPE=machine.blas, BALLSCREW_CFLAGS=machine.c_flags)
    env["NPY_DISABLE_CPU_FEATURES"] = " ".join(f for f in __cpu_dispatch__ if f.startswith(machine.without))
    if machine.generic:
        # compiled kernels of the two kinds lie side by side in a cache
        env |= {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    if machine.ordinary:
        env |= {"LC_ALL": "POSIX", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "TZ": "Asia/Kathmandu"}
    return env


def run(name: str, arguments: list[str]) -> bool:
    """Run the tests on a machine and print their outcome; whether they pass."""
    machine, begun = MACHINES[name], time.monotonic()
    print(f"{name}: {machine}", flush=True)
    # made on another machine, they differ in the last digits
    shutil.rmtree(user_cache() / "maps", ignore_errors=True)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments]
    if machine.ordinary and os.geteuid() == 0 and shutil.which("setpriv"):
        command = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", *command]
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2 * machine.busy)]
    try:
        process = subprocess.run(
            command, cwd=ROOT, env=environment(machine), check=False, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, encoding="utf-8", errors="replace",
        )  # fmt: skip
    finally:
        for other in others:
            other.kill()
    shown = process.stdout[-6000:] if process.returncode else process.stdout.strip().rpartition("\n")[2]
    print(f"{shown}\n{name}: exit code {process.returncode}, {time.monotonic() - begun:.0f} s", flush=True)
    return process.returncode == 0


def main() -> int:
    """Run the machines one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--all", action="store_true", help="all tests, not only the quick ones")
    parser.add_argument("--only", choices=MACHINES, action="append", help="this machine, may be repeated")
    parser.add_argument("pytest", nargs="*", help="arguments of pytest, after --")
    args = parser.parse_args()
    chosen = ["-n", "auto", "--dist", "loadfile"] + ([] if args.all else ["-m", "not slow"]) + args.pytest
    return int(not all([run(name, chosen) for name in args.only or MACHINES]))


if __name__ == "__main__":
    sys.exit(main())
