"""The journal of solved contacts after interrupts and kills, and builds on a cluster."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from paths import SUPPORT
from synthetic_contacts import GRID, closed_build, closed_row, same_map, small_map

from ballscrew_tehl.nut_map import build
from ballscrew_tehl.nut_map.contacts import QUANTITIES
from ballscrew_tehl.nut_map.journal import Journal, Solved
from ballscrew_tehl.physics.hertz import RACEWAYS

SPEEDS = np.array([10.0, 20.0, 1.0 / 3.0])


def journal_of(path, parameters="{}", version="1"):
    return Journal(path, parameters, version)


def piece(shift=0.0):
    return {name: SPEEDS * np.pi + k + shift for k, name in enumerate(QUANTITIES)}


def test_numbers_are_read_back_to_the_last_bit(tmp_path):
    path = tmp_path / "a" / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())
    with journal_of(path) as journal:
        journal.add("screw", 0.2, SPEEDS, 303.15, piece(0.1))
        (first, second) = journal.pieces()
    assert (first[0], first[1], first[3], second[0]) == ("nut", 0.1, 303.15, "screw")
    np.testing.assert_array_equal(first[2], SPEEDS)
    for name in QUANTITIES:
        np.testing.assert_array_equal(first[4][name], piece()[name])
        np.testing.assert_array_equal(second[4][name], piece(0.1)[name])


@pytest.mark.parametrize("cut", [1, 7, 200])
def test_incomplete_line_is_cut_off(tmp_path, cut):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())
        journal.add("nut", 0.2, SPEEDS, 303.15, piece())
    path.write_bytes(path.read_bytes()[:-cut])
    with journal_of(path) as journal:
        assert [found[1] for found in journal.pieces()] == [0.1]
        journal.add("nut", 0.3, SPEEDS, 303.15, piece())
        assert [found[1] for found in journal.pieces()] == [0.1, 0.3]


@pytest.mark.parametrize("bytes_", [b"", b'{"format": 1, "ver'])
def test_file_without_complete_first_line_is_started_again(tmp_path, bytes_):
    path = tmp_path / "x.contacts"
    path.write_bytes(bytes_)
    with journal_of(path) as journal:
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())
        assert len(list(journal.pieces())) == 1


@pytest.mark.parametrize("other", [{"parameters": '{"a": 1}'}, {"version": "2"}])
def test_journal_of_another_map_is_refused(tmp_path, other):
    path = tmp_path / "x.contacts"
    with journal_of(path):
        pass
    before = path.read_bytes()
    with (
        pytest.raises(ValueError, match="another screw, oil or version; expected parameters"),
        journal_of(path, **other),
    ):
        pass
    path.write_bytes(b"not a journal\n")
    with pytest.raises(ValueError, match="remove or rename the file"), journal_of(path):
        pass
    assert before.startswith(b'{"format"')


def test_closed_journal_accepts_nothing(tmp_path):
    journal = journal_of(tmp_path / "x.contacts")
    with pytest.raises(ValueError, match="not open"):
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())


def test_solved_contains_only_what_is_in_the_journal():
    solved = Solved()
    solved.add("nut", 3.0, SPEEDS[:2], 303.15, {name: v[:2] for name, v in piece().items()})
    assert solved.missing("nut", 3.0, SPEEDS, 303.15).tolist() == [1.0 / 3.0]
    assert solved.missing("screw", 3.0, SPEEDS, 303.15).size == 3
    # a point that is computed again may differ in the last bits
    assert solved.missing("nut", 3.0 * (1.0 + 1e-15), SPEEDS, 303.15).size == 1


def test_contacts_are_taken_by_their_points_in_any_order():
    solved = Solved()
    solved.add("nut", 3.0, SPEEDS, 303.15, piece())
    solved.add("nut", 4.0, SPEEDS[:1], 300.0, {name: np.array([np.nan]) for name in QUANTITIES})
    points = np.array([[4.0, 10.0, 300.0], [3.0, 1.0 / 3.0, 303.15], [3.0, 10.0, 303.15]])
    contacts = solved.contacts("nut", points)
    assert len(solved) == 4
    assert len(contacts) == 3
    assert contacts.good.tolist() == [False, True, True]
    np.testing.assert_array_equal(contacts.points, points)
    for name in QUANTITIES:
        np.testing.assert_array_equal(contacts.values[name], [np.nan, piece()[name][2], piece()[name][0]])
    with pytest.raises(KeyError):
        solved.contacts("screw", points)


def test_contact_that_did_not_converge_is_not_solved_again(tmp_path):
    """NaN is read back."""
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        Solved(journal).add("nut", 0.1, SPEEDS[:1], 303.15, {name: np.array([np.nan]) for name in QUANTITIES})
    with journal_of(path) as journal:
        solved = Solved(journal)
        assert solved.missing("nut", 0.1, SPEEDS, 303.15).tolist() == SPEEDS[1:].tolist()
        assert not solved.contacts("nut", np.array([[0.1, SPEEDS[0], 303.15]])).good.any()


def test_second_build_of_the_same_map_is_refused_while_the_first_one_runs(tmp_path):
    path = tmp_path / "x.contacts"
    with journal_of(path) as journal:
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())
        before = path.read_bytes()
        with (
            pytest.raises(ValueError, match=r"x.contacts: another build is writing it; remedy: wait"),
            journal_of(path),
        ):
            pass
        assert path.read_bytes() == before
        journal.add("nut", 0.2, SPEEDS, 303.15, piece())
    with journal_of(path) as journal:
        assert len(list(journal.pieces())) == 2
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.contacts"]


class InterruptError(Exception):
    pass


def test_interrupted_build_continues_where_it_stopped(tmp_path, monkeypatch):
    journal, solved = tmp_path / "x.contacts", []

    def row(*arguments):
        solved.append(arguments)
        return closed_row(*arguments)

    def stop(finished, total, what):
        if finished > total / 3:
            raise InterruptError

    monkeypatch.setattr(build, "_solve_row", row)
    with pytest.raises(InterruptError):
        closed_build(row=row, progress=stop, journal=journal)
    done = len(journal.read_bytes().splitlines()) - 1
    assert 0 < done <= len(solved)
    solved.clear()
    resumed = closed_build(row=row, journal=journal)
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
            row=slow_row, executor=client.get_executor(retries=3), progress=kill, journal=tmp_path / "x"
        )
        assert killed
    same_map(built, small_map())


def slow_row(*arguments):
    """Slow closed_row, so that a worker is killed during a call."""
    time.sleep(0.05)
    return closed_row(*arguments)


def test_journal_is_plain_text(tmp_path):
    with journal_of(tmp_path / "x") as journal:
        journal.add("nut", 0.1, SPEEDS, 303.15, piece())
    head, line = (tmp_path / "x").read_text().splitlines()
    assert json.loads(head)["version"] == "1"
    assert json.loads(line)["raceway"] == "nut"
