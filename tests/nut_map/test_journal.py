"""The journal of solved contacts after interrupts, kills and a full disk; the processes of a build."""

import math
import os
import subprocess
import sys
import time

import pytest
from paths import SUPPORT
from synthetic_contacts import FEW, LAW, closed_build, closed_contact, same_map

from ballscrew_tehl.nut_map.journal import JOURNAL_FORMAT, Journal
from ballscrew_tehl.nut_map.workers import worker_pool

CONTACT = {"film": math.pi / 3.0, "rise": 1e-300}
LOST = dict.fromkeys(CONTACT, math.nan)


def journal_of(path, **identity):
    return Journal(CONTACT, path, {"version": "1", "screw and oil": "a"} | identity)


def filled(path, *names):
    """The keys after some more contacts."""
    with journal_of(path) as journal:
        for name in names:
            journal.add((name, "nut"), CONTACT)
        return [key for key, _ in journal.contacts]


def test_contacts_are_read_back_to_the_last_bit_also_those_without_a_solution(tmp_path):
    """After an error too; without contacts, or discarded, the file goes."""
    path = tmp_path / "a" / "x.contacts"
    journal = journal_of(path).__enter__()
    journal.add(("one", "nut"), CONTACT)
    journal.add(("two", "nut"), LOST)
    with pytest.raises(ValueError, match=r"x.contacts: another build is writing it"), journal_of(path):
        pass
    journal.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    with journal_of(path) as journal:
        assert ("one", "nut") in journal
        assert ("one", "screw") not in journal
        assert journal.contacts["one", "nut"] == CONTACT
        assert all(math.isnan(value) for value in journal.contacts["two", "nut"].values())
        assert len(journal) == 2
        journal.discard()
    assert list(path.parent.iterdir()) == []
    with journal_of(path):
        assert path.exists()
    assert list(path.parent.iterdir()) == []
    with pytest.raises(ValueError, match="the journal is not open"):
        journal.add(("a",), CONTACT)


@pytest.mark.parametrize("damage", [1, 40, b'["c", {"film": 1.0}]\n', b'["c", 7]\n', b"\xff\n"])
def test_contacts_from_a_damaged_line_on_are_solved_again(tmp_path, damage):
    """A line that was cut off takes itself alone, one that is damaged also those that follow."""
    path = tmp_path / "x.contacts"
    filled(path, "a", "b")
    whole = path.read_bytes()
    last = whole.splitlines(keepends=True)[-1].replace(b'"b"', b'"d"')
    path.write_bytes(whole[:-damage] if isinstance(damage, int) else whole + damage + last)
    kept = ["a"] if isinstance(damage, int) else ["a", "b"]
    # what follows begins on a line of its own
    assert filled(path, "e") == [*kept, "e"] == filled(path)


def test_file_of_another_identity_is_refused_unchanged(tmp_path):
    path = tmp_path / "x.contacts"
    filled(path, "a")
    whole = path.read_bytes()
    format_ = f'"format": {JOURNAL_FORMAT}'.encode()
    for content, identity, words in (
        (whole, {"version": "2"}, "contacts of version 1; expected 2"),
        (whole, {"screw and oil": "b"}, "contacts of screw and oil a; expected b"),
        (whole.replace(format_, b'"format": 3'), {}, f"contacts of format 3; expected {JOURNAL_FORMAT}"),
        (b"text\n", {}, "not a file of"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"{words}.*: remove or rename it"), journal_of(path, **identity):
            pass
        assert path.read_bytes() == content
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]


def test_full_disk_is_an_error_that_names_the_file_and_keeps_what_is_written(tmp_path):
    """The limit of the size of a file stands for a full disk: in both a write ends in the middle of a line."""
    resource = pytest.importorskip("resource")
    path, before = tmp_path / "x.contacts", resource.getrlimit(resource.RLIMIT_FSIZE)

    def add_on_full_disk(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            with pytest.raises(OSError, match=r"x\.contacts"):
                filled(path, "b")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    for size in (0, 20):
        add_on_full_disk(size)
        assert list(tmp_path.iterdir()) == []
    filled(path, "a")
    add_on_full_disk(path.stat().st_size + 20)
    assert not path.read_bytes().endswith(b"\n")
    assert filled(path) == ["a"]


@pytest.mark.slow
def test_killed_build_loses_no_finished_contact_and_continues(tmp_path):
    """The map is that of a build in one go; contacts of the journal are not solved again."""
    journal, solved = tmp_path / "x.contacts", []
    script = f"""
import sys, time
sys.path.insert(0, {str(SUPPORT)!r})
from pathlib import Path
from synthetic_contacts import FEW, LAW, closed_build
def slow(*call):
    print(call[0], flush=True)
    time.sleep(0.05)
closed_build(LAW, FEW, slow, journal=Path({str(journal)!r}))
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        for _ in range(5):
            process.stdout.readline()
        process.kill()
    done = len(journal.read_bytes().splitlines()) - 1
    assert done >= 5

    def counted(*arguments):
        solved.append(arguments)
        return closed_contact(*arguments)

    whole = closed_build(LAW, FEW)
    same_map(closed_build(LAW, FEW, solve=counted, journal=journal), whole)
    assert len(solved) + done == whole.header["contacts"]


@pytest.mark.slow
def test_workers_have_one_thread_each_and_stop_with_a_killed_build():
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    with worker_pool(1) as pool:
        assert list(pool.map(os.getenv, names)) == ["1", "1", "1"]
    assert {name: os.environ.get(name) for name in names} == before
    script = """
import os, time
from ballscrew_tehl.nut_map.workers import worker_pool
if __name__ == "__main__":
    with worker_pool(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 60).result()
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        worker = int(process.stdout.readline())
        process.kill()

    def running() -> bool:
        try:
            with open(f"/proc/{worker}/stat") as status:
                # a stopped worker stays a zombie until the new parent process reaps it
                return status.read().split()[2] != "Z"
        except OSError:
            return False

    for _ in range(100):
        if not running():
            return
        time.sleep(0.1)
    pytest.fail("the worker is still running")
