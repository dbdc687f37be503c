"""The journal of solved contacts after interrupts, kills and a full disk; the processes of a build."""

import math
import os
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from paths import SUPPORT
from synthetic_contacts import FEW, closed_build, closed_contact, same_map

from ballscrew_tehl.nut_map.journal import JOURNAL_FORMAT, Journal
from ballscrew_tehl.nut_map.workers import worker_pool

NAMES = ("film", "rise")
LOST = dict.fromkeys(NAMES, math.nan)


def journal_of(path, **identity):
    return Journal(NAMES, path, {"version": "1", "screw and oil": "a"} | identity)


def contact(shift=0.0):
    return {name: math.pi / 3.0 + k + shift for k, name in enumerate(NAMES)}


def keys(path):
    with journal_of(path) as journal:
        return [key for key, *_ in journal.contacts]


def filled(path, *names):
    with journal_of(path) as journal:
        for name in names:
            journal.add((name, "nut"), contact())
    return path


def test_contacts_are_read_back_to_the_last_bit_also_those_without_a_solution(tmp_path):
    path = tmp_path / "a" / "x.contacts"
    filled(path, "one")
    with journal_of(path) as journal:
        journal.add(("two", "nut"), LOST)
        assert ("one", "nut") in journal
        assert ("one", "screw") not in journal
    with journal_of(path) as journal:
        assert journal.contacts[("one", "nut")] == contact()
        assert all(math.isnan(value) for value in journal.contacts[("two", "nut")].values())
        assert len(journal) == 2
    memory = Journal(NAMES)
    memory.add(("one",), LOST)
    assert ("one",) in memory


@pytest.mark.parametrize(
    "damage", [1, 7, 40, b'["c", {"film": 1.0}]\n', b'["c", 7]\n', b"\xff\n", b'{"film": 1}\n']
)
def test_contacts_from_a_damaged_line_on_are_solved_again(tmp_path, damage):
    """A line that was cut off takes itself alone, one that is damaged also those that follow."""
    path = filled(tmp_path / "x.contacts", "a", "b")
    whole = path.read_bytes()
    if isinstance(damage, int):
        path.write_bytes(whole[:-damage])
        kept = ["a"]
    else:
        path.write_bytes(whole + damage + whole.splitlines(keepends=True)[-1].replace(b'"b"', b'"d"'))
        kept = ["a", "b"]
    assert keys(path) == kept
    # what follows begins on a line of its own
    filled(path, "e")
    assert keys(path) == [*kept, "e"]


def test_file_of_another_identity_is_refused_unchanged(tmp_path):
    path = filled(tmp_path / "x.contacts", "a")
    whole = path.read_bytes()
    for identity, words in (
        ({"version": "2"}, "contacts of version 1; expected 2"),
        ({"screw and oil": "b"}, "contacts of screw and oil a; expected b"),
    ):
        with pytest.raises(ValueError, match=words), journal_of(path, **identity):
            pass
    assert path.read_bytes() == whole
    old = whole.replace(f'"format": {JOURNAL_FORMAT}'.encode(), b'"format": 3')
    for content, words in (
        (old, f"contacts of format 3; expected {JOURNAL_FORMAT}"),
        (b"text\n", "not a file of"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"{words}.*: remove or rename it"), journal_of(path):
            pass
        assert path.read_bytes() == content
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]


def test_file_stays_after_an_error_and_goes_without_contacts_or_when_discarded(tmp_path):
    path = tmp_path / "x.contacts"
    journal = journal_of(path).__enter__()
    journal.add(("a",), contact())
    journal.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert keys(path) == ["a"]
    with journal_of(path) as journal:
        journal.discard()
    assert list(tmp_path.iterdir()) == []
    with journal_of(path):
        assert path.exists()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ValueError, match="the journal is not open"):
        journal.add(("a",), contact())


def test_second_build_is_refused_while_the_first_one_runs(tmp_path):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        with pytest.raises(ValueError, match=r"x.contacts: another build is writing it"), journal_of(path):
            pass
        journal.add(("a",), contact())
    assert keys(path) == ["a"]
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]


@contextmanager
def full_disk(size):
    """The limit of the size of a file stands for a full disk: in both a write ends in the middle of a line."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_full_disk_is_an_error_that_names_the_file_and_keeps_what_is_written(tmp_path):
    path = tmp_path / "x.contacts"
    for size in (0, 20):
        with pytest.raises(OSError, match=r"x\.contacts"), full_disk(size), journal_of(path):
            pass
        assert list(tmp_path.iterdir()) == []
    filled(path, "a")
    with (
        pytest.raises(OSError, match=r"x\.contacts"),
        full_disk(path.stat().st_size + 20),
        journal_of(path) as journal,
    ):
        journal.add(("b",), contact())
    assert not path.read_bytes().endswith(b"\n")
    assert keys(path) == ["a"]


@pytest.mark.slow
def test_killed_build_loses_no_finished_contact_and_continues(tmp_path):
    """The map is that of a build in one go; contacts of the journal are not solved again."""
    journal, solved = tmp_path / "x.contacts", []
    script = f"""
import sys, time
sys.path.insert(0, {str(SUPPORT)!r})
from pathlib import Path
from synthetic_contacts import FEW, closed_build
def slow(*call):
    print(call[0], flush=True)
    time.sleep(0.05)
closed_build(grid=FEW, progress=slow, journal=Path({str(journal)!r}))
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for _ in range(5):
        process.stdout.readline()
    process.kill()
    process.wait()
    process.stdout.close()
    done = len(journal.read_bytes().splitlines()) - 1
    assert done >= 5

    def counted(*arguments):
        solved.append(arguments)
        return closed_contact(*arguments)

    resumed, whole = closed_build(grid=FEW, solve=counted, journal=journal), closed_build(grid=FEW)
    same_map(resumed, whole)
    assert 2 * (len(solved) + done) == whole.header["contacts"]


@pytest.mark.slow
def test_workers_have_one_thread_each_and_stop_with_a_killed_build():
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    with worker_pool(1) as pool:
        assert list(pool.map(os.getenv, names)) == ["1", "1", "1"]
    assert {name: os.environ.get(name) for name in names} == before
    script = """
import os, time
from ballscrew_tehl.nut_map.build import worker_pool
if __name__ == "__main__":
    with worker_pool(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 60).result()
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    worker = int(process.stdout.readline())
    process.kill()
    process.wait()
    process.stdout.close()
    for _ in range(100):
        try:
            os.kill(worker, 0)
            with open(f"/proc/{worker}/stat") as status:
                # a stopped worker stays a zombie until the new parent process reaps it
                if status.read().split()[2] == "Z":
                    break
        except OSError:
            break
        time.sleep(0.1)
    else:
        pytest.fail("the worker is still running")
