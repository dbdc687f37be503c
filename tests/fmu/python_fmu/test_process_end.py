"""The process of the host ends without error when it has loaded libraries after the FMU (process_end.py)."""

import atexit
import json
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

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


SLAVE = """
from pythonfmu import Fmi2Slave


class Slave(Fmi2Slave):
    def do_step(self, current_time, step_size):
        return True
"""


def test_pythonfmu_still_has_the_function_that_frees_twice(tmp_path):
    """If not, pythonfmu is fixed: the section of docs/change_the_model.md, the workaround and these tests can go."""
    (tmp_path / "slave.py").write_text(SLAVE)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slave.py"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    folder = fmpy.extract(str(tmp_path / "Slave.fmu"), unzipdir=str(tmp_path / "Slave"))
    binary = Path(folder, process_end.BINARIES, "Slave.so").read_bytes()
    assert process_end.RESET.encode() in binary
