"""The process of the host ends without error when it has loaded libraries after the FMU (process_end.py)."""

import atexit
import json
import signal
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest
from paths import ROOT

from ballscrew_fmu.python_fmu import process_end

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the fault is one on Linux"),
]

# Blocks of many sizes, half of them freed: memory freed by the binary then has neighbours in the lists of malloc.
# scipy.linalg brings libgfortran, which frees memory when the process ends, after the library of the FMU.
HOST = """
import random, sys
from ballscrew_fmu.checks.replay import FmuInstance

generator = random.Random(int(sys.argv[2]))
with FmuInstance(sys.argv[1]) as one:
    assert one.step(speed=40.0)
    blocks = [bytes(generator.randrange(50, 6000)) for _ in range(5000)]
    generator.shuffle(blocks)
    del blocks[::2]
import scipy.linalg.lapack
print("end of the script")
"""

COUNT = """
import atexit, json, sys
from ballscrew_fmu.checks.replay import FmuInstance

before, found = atexit._ncallbacks(), []
for folder in sys.argv[1:]:
    with FmuInstance(folder):
        found.append(atexit._ncallbacks() - before)
print(json.dumps(found))
"""


@pytest.mark.parametrize("seed", range(8))
def test_libraries_can_free_memory_at_the_end(unpacked, seed):
    """Without the reset two of three such processes abort with "corrupted double-linked list"."""
    done = subprocess.run([sys.executable, "-c", HOST, unpacked, str(seed)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "end of the script\n"


def test_every_library_is_reset_once(fmu, unpacked, tmp_path):
    other = fmpy.extract(str(fmu), unzipdir=str(tmp_path / "other"))
    command = [sys.executable, "-c", COUNT, unpacked, unpacked, other, unpacked]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [1, 1, 2, 2]


def test_a_library_that_is_not_loaded_is_not_reset(tmp_path):
    file = tmp_path / process_end.BINARIES / "BallScrewFriction.so"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"no library")
    before = atexit._ncallbacks()
    process_end.reset_at_exit(str(tmp_path / "resources"))
    process_end.reset_at_exit(str(Path("nowhere", "resources")))
    assert atexit._ncallbacks() == before
    assert str(file) not in process_end._libraries


def indented_blocks(page):
    """Indented code of a page of the docs, in its order."""
    found, block = [], []
    for line in [*page.read_text(encoding="utf-8").splitlines(), "end"]:
        if line.startswith("    ") or (block and not line):
            block.append(line[4:])
        elif block:
            found.append("\n".join(block))
            block = []
    return found


def test_the_case_of_the_docs_runs_as_printed(tmp_path):
    """The case of docs/pythonfmu_at_exit.md. Whether a process aborts is chance (contents of the heap), that the
    binary still has the function which frees the pointer twice is not: if it is gone, pythonfmu is mended, and page,
    workaround and these tests can be deleted."""
    slave, host, _ = indented_blocks(ROOT / "docs" / "pythonfmu_at_exit.md")
    (tmp_path / "slave.py").write_text(slave)
    (tmp_path / "host.py").write_text(host)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slave.py"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    for seed in range(1, 5):
        command = [sys.executable, "host.py", str(seed)]
        run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert run.stdout == "end of the script\n"
        assert run.returncode in (0, -signal.SIGABRT, -signal.SIGSEGV)
    folder = fmpy.extract(str(tmp_path / "Slave.fmu"), unzipdir=str(tmp_path / "Slave"))
    binary = Path(folder, process_end.BINARIES, "Slave.so").read_bytes()
    assert process_end.RESET.encode() in binary, "mended"
