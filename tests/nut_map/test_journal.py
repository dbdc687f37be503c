"""The journal of solved contacts after interrupts and kills, and builds on a cluster."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from paths import SUPPORT
from synthetic_contacts import GRID, closed_build, closed_contact, same_map, small_map

from ballscrew_tehl.nut_map.contacts import QUANTITIES
from ballscrew_tehl.nut_map.journal import Journal, Solved
from ballscrew_tehl.nut_map.workers import interrupt_held
from ballscrew_tehl.physics.hertz import RACEWAYS

POINT = [0.1, 1.0 / 3.0, 303.15]
LOST = dict.fromkeys(QUANTITIES, math.nan)


def journal_of(path, parameters="{}", version="1"):
    return Journal(path, parameters, version)


def contact(shift=0.0):
    return {name: np.pi / 3.0 + k + shift for k, name in enumerate(QUANTITIES)}


def at(load):
    return [load, *POINT[1:]]


def loads(path):
    """Loads of the contacts in a file."""
    with journal_of(path) as journal:
        return [point[0] for _, point, _ in journal.contacts]


def test_numbers_are_read_back_to_the_last_bit(tmp_path):
    path = tmp_path / "a" / "x.contacts"
    for raceway, shift in (("nut", 0.0), ("screw", 0.1)):
        with journal_of(path) as journal:
            journal.add(raceway, at(0.1 + shift), contact(shift))
    with journal_of(path) as journal:
        assert journal.contacts == [("nut", POINT, contact()), ("screw", at(0.2), contact(0.1))]


@pytest.mark.parametrize("cut", [1, 7, 200])
def test_incomplete_line_is_cut_off(tmp_path, cut):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", at(0.1), contact())
        journal.add("nut", at(0.2), contact())
    path.write_bytes(path.read_bytes()[:-cut])
    with journal_of(path) as journal:
        assert [point[0] for _, point, _ in journal.contacts] == [0.1]
        journal.add("nut", at(0.3), contact())
    assert loads(path) == [0.1, 0.3]


@pytest.mark.parametrize(
    "bad",
    [
        b"\0" * 40,
        b"{}",
        b"[]",
        b"null",
        b'{"raceway": "nut", "point": [1.0, 2.0], "values": {}}',
        b"\xff\xfe",
        b"",
    ],
)
def test_contacts_from_a_damaged_line_on_are_solved_again(tmp_path, bad):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        for load in (0.1, 0.2, 0.3):
            journal.add("nut", at(load), contact())
    lines = path.read_bytes().splitlines()
    lines[2] = bad
    path.write_bytes(b"\n".join(lines) + b"\n")
    assert loads(path) == [0.1]
    assert path.read_bytes() == b"\n".join(lines[:2]) + b"\n"


@pytest.mark.parametrize("bytes_", [b"", b'{"format": 1, "ver'])
def test_file_without_complete_first_line_is_started_again(tmp_path, bytes_):
    path = tmp_path / "x.contacts"
    path.write_bytes(bytes_)
    with journal_of(path) as journal:
        journal.add("nut", POINT, contact())
    assert loads(path) == [0.1]


@pytest.mark.parametrize(
    ("other", "what"),
    [
        ({"parameters": '{"a": 1}'}, "contacts of another screw, oil or kinematics"),
        ({"version": "2"}, "contacts of version 1; expected 2"),
    ],
)
def test_journal_of_another_map_is_refused(tmp_path, other, what):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", POINT, contact())
    before = path.read_bytes()
    with (
        pytest.raises(ValueError, match=f"{what}: remove or rename it, or another"),
        journal_of(path, **other),
    ):
        pass
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]


@pytest.mark.parametrize(
    ("head", "what"),
    [
        (b"not a journal", "not a file of solved contacts"),
        (b"[1]", "not a file of solved contacts"),
        (b'{"format": 5}', "not a file of solved contacts"),
        (b'{"format": 3, "version": "1", "parameters": "x"}', "contacts in format 3; expected 5"),
    ],
)
def test_file_that_is_no_journal_of_this_format_is_refused_and_kept(tmp_path, head, what):
    path = tmp_path / "x.contacts"
    path.write_bytes(head + b"\n")
    with pytest.raises(ValueError, match=f"{what}: remove or rename it"), journal_of(path):
        pass
    assert path.read_bytes() == head + b"\n"


def test_closed_journal_accepts_nothing(tmp_path):
    journal = journal_of(tmp_path / "x.contacts")
    with pytest.raises(ValueError, match="not open"):
        journal.add("nut", POINT, contact())


def test_journal_without_contacts_leaves_no_file(tmp_path):
    with journal_of(tmp_path / "x.contacts"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_discarded_journal_leaves_no_file(tmp_path):
    with journal_of(tmp_path / "x.contacts") as journal:
        journal.add("nut", POINT, contact())
        journal.discard()
        # the lock is kept until the build leaves
        assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts.lock"]
    assert list(tmp_path.iterdir()) == []


def test_solved_contains_only_what_was_added():
    solved = Solved()
    solved.add("nut", POINT, contact())
    assert solved.holds("nut", POINT)
    assert not solved.holds("screw", POINT)
    assert not any(solved.holds("nut", [*POINT[:k], 1.001 * POINT[k], *POINT[k + 1 :]]) for k in range(3))
    # a point that is computed again may differ in the last bits
    assert solved.holds("nut", [(1.0 + 1e-15) * value for value in POINT])


def test_contacts_are_taken_by_their_points_in_any_order():
    solved = Solved()
    for load, values in ((3.0, contact()), (5.0, contact(1.0)), (4.0, LOST)):
        solved.add("nut", at(load), values)
    points = np.array([at(4.0), at(5.0), at(3.0)])
    contacts = solved.contacts("nut", points)
    assert len(solved) == len(contacts) == 3
    assert contacts.good.tolist() == [False, True, True]
    np.testing.assert_array_equal(contacts.points, points)
    for name in QUANTITIES:
        np.testing.assert_array_equal(contacts.values[name], [np.nan, contact(1.0)[name], contact()[name]])
    with pytest.raises(KeyError):
        solved.contacts("screw", points)


def test_contact_that_did_not_converge_is_not_solved_again(tmp_path):
    """NaN is read back."""
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        Solved(journal).add("nut", POINT, LOST)
    with journal_of(path) as journal:
        solved = Solved(journal)
        assert solved.holds("nut", POINT)
        assert not solved.contacts("nut", np.array([POINT])).good.any()


def test_second_build_of_the_same_map_is_refused_while_the_first_one_runs(tmp_path):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", at(0.1), contact())
        before = path.read_bytes()
        with (
            pytest.raises(ValueError, match=r"x.contacts: another build is writing it; remedy: wait"),
            journal_of(path),
        ):
            pass
        assert path.read_bytes() == before
        journal.add("nut", at(0.2), contact())
    assert loads(path) == [0.1, 0.2]
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
    with journal_of(path) as journal:
        journal.add("nut", at(0.1), contact())
    size = path.stat().st_size + 20
    with pytest.raises(OSError, match=r"x\.contacts"), full_disk(size), journal_of(path) as journal:
        journal.add("nut", at(0.2), contact())
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]
    assert not path.read_bytes().endswith(b"\n")
    assert loads(path) == [0.1]


@pytest.mark.parametrize("size", [0, 20])
def test_full_disk_that_takes_no_header_leaves_nothing(tmp_path, size):
    path = tmp_path / "x.contacts"
    with pytest.raises(OSError, match=r"x\.contacts"), full_disk(size), journal_of(path):
        pass
    assert list(tmp_path.iterdir()) == []


class InterruptError(Exception):
    pass


def test_interrupted_build_continues_where_it_stopped(tmp_path):
    journal, solved = tmp_path / "x.contacts", []

    def solve(*arguments):
        solved.append(arguments)
        return closed_contact(*arguments)

    def stop(finished, total, what):
        if finished > total / 3:
            raise InterruptError

    with pytest.raises(InterruptError):
        closed_build(solve=solve, progress=stop, journal=journal)
    done = len(journal.read_bytes().splitlines()) - 1
    assert 0 < done <= len(solved)
    solved.clear()
    resumed = closed_build(solve=solve, journal=journal)
    assert len(solved) == len(RACEWAYS) * GRID.contact_first - done
    same_map(resumed, small_map())


@pytest.mark.slow
def test_killed_process_loses_no_finished_contact(tmp_path):
    journal = tmp_path / "x.contacts"
    script = f"""
import sys, time
sys.path.insert(0, {str(SUPPORT)!r})
from pathlib import Path
from synthetic_contacts import closed_build
def slow(*call):
    print(call[0], flush=True)
    time.sleep(0.05)
closed_build(progress=slow, journal=Path({str(journal)!r}))
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    for _ in range(5):
        assert process.stdout is not None
        process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    done = len(journal.read_bytes().splitlines()) - 1
    assert done >= 5
    same_map(closed_build(journal=journal), small_map())


@pytest.mark.slow
def test_workers_of_a_killed_build_stop():
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
        except ProcessLookupError:
            break
        # a stopped worker stays a zombie until the new parent process reaps it
        if Path(f"/proc/{worker}/stat").read_text().split()[2] == "Z":
            break
        time.sleep(0.1)
    else:
        pytest.fail("the worker is still running")


@pytest.mark.skipif(sys.platform == "win32", reason="a signal is sent")
@pytest.mark.parametrize("ignored", [False, True])
def test_interrupt_is_raised_after_what_must_not_be_cut_off_or_never(ignored):
    done = []

    def cut_off():
        with interrupt_held(ignored):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
            done.append("held")
        done.append("after")

    before = signal.getsignal(signal.SIGINT)
    if ignored:
        cut_off()
        assert done == ["held", "after"]
    else:
        with pytest.raises(KeyboardInterrupt):
            cut_off()
        assert done == ["held"]
    assert signal.getsignal(signal.SIGINT) is before


# --- a cluster ---


@pytest.mark.slow
def test_cluster_that_loses_a_worker_builds_the_same_map(tmp_path):
    distributed = pytest.importorskip("distributed")
    here = str(SUPPORT)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        preload=[f"import sys; sys.path.insert(0, {here!r})"],
    ) as cluster, distributed.Client(cluster, set_as_default=False) as client:  # fmt: skip
        pids = list(client.run(os.getpid).values())
        killed = []

        def kill(finished, total, what):
            if finished > total / 4 and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        built = closed_build(
            solve=slow_contact, executor=client.get_executor(retries=3), progress=kill, journal=tmp_path / "x"
        )
        assert killed
    same_map(built, small_map())


def slow_contact(*arguments):
    """Slow closed_contact, so that a worker is killed during a call."""
    time.sleep(0.05)
    return closed_contact(*arguments)


def test_journal_is_plain_text(tmp_path):
    with journal_of(tmp_path / "x") as journal:
        journal.add("nut", POINT, contact())
    head, line = (tmp_path / "x").read_text().splitlines()
    assert json.loads(head)["version"] == "1"
    assert json.loads(line)["raceway"] == "nut"
