"""The command `map build` with solved contacts: the same file whatever is killed while it runs."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import run

from ballscrew_tehl.cli import map as map_commands
from ballscrew_tehl.cli.main import main
from ballscrew_tehl.nut_map.grid import MapGrid

#: few contacts and nodes, over a range without slow contacts
FEW = MapGrid(
    (1.0, 2.0, 9), (1.0, 2.0, 7), (300.0, 310.0, 5), (1.0, 2.0, 7), contact_first=8, contact_most=8
)  # fmt: skip
NARROW = ("--preload-n", "1000", "2000", "--speed-rpm", "200", "600", "--temperature-c", "30", "40")
#: one thread of BLAS, as own workers have; others round otherwise
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="a process is killed by its signal"),
]


@pytest.fixture(autouse=True)
def few_contacts(monkeypatch):
    monkeypatch.setattr(map_commands, "QUICK", FEW)


def words(path, *options):
    return ["map", "build", "--output", str(path), "--quick", "--count", "1", *NARROW, *options]


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """Bytes of the map that one worker builds without interruption."""
    path = tmp_path_factory.mktemp("expected") / "map.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_commands, "QUICK", FEW)
        assert main(words(path, "--workers", "1")) == 0
    return path.read_bytes()


def progress_that_calls(function, share):
    """In place of the progress bar: calls a function once when a share of the contacts is solved."""

    @contextmanager
    def bar():
        called = []

        def progress(finished, total, what):
            if what == "contacts solved" and finished >= share * total and not called:
                called.append(finished)
                function()

        yield progress
        assert called

    return bar


def test_two_workers_write_the_bytes_of_one(expected, tmp_path):
    path = tmp_path / "map.nc"
    assert main(words(path, "--workers", "2")) == 0
    assert path.read_bytes() == expected


def test_killed_command_continues_to_the_same_bytes(expected, tmp_path, capsys):
    path, journal = tmp_path / "map.nc", tmp_path / "map.nc.contacts"
    script = f"""
import sys
from ballscrew_tehl.cli import main, map
from ballscrew_tehl.nut_map.grid import MapGrid
if __name__ == "__main__":
    map.QUICK = {FEW!r}
    main.main(sys.argv[1:])
"""
    (tmp_path / "command.py").write_text(script, encoding="ascii")
    command = [sys.executable, str(tmp_path / "command.py"), *words(path, "--workers", "1")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as killed:
        for line in killed.stderr:
            if "contacts solved" in line and not line.startswith("2 of"):
                killed.kill()
                break
        killed.stderr.read()
    assert killed.returncode == -signal.SIGKILL
    assert not path.exists()
    kept = len(journal.read_bytes().splitlines()) - 1
    assert 2 <= kept < 16
    code, _, err = run(capsys, *words(path, "--workers", "1"))
    assert code == 0
    # isothermal and thermal
    assert err.splitlines()[1].startswith(f"{2 * (kept + 1)} of 32 contacts solved")
    assert path.read_bytes() == expected
    assert sorted(file.name for file in tmp_path.iterdir()) == ["command.py", "map.nc"]


def test_dead_worker_ends_the_build_in_one_line_that_says_how_to_go_on(
    expected, tmp_path, monkeypatch, capsys
):
    path = tmp_path / "map.nc"

    def kill():
        (worker,) = [child for child in children() if "spawn_main" in child[1]]
        os.kill(worker[0], signal.SIGKILL)

    with monkeypatch.context() as patch:
        patch.setattr(map_commands, "progress_bar", progress_that_calls(kill, 0.25))
        code, out, err = run(capsys, *words(path, "--workers", "1"))
    assert (code, out) == (2, "")
    assert err.splitlines()[-1] == (
        "ballscrew_tehl map: error: a worker process has died, killed or out of memory: the same command again "
        "continues with the contacts that are solved"
    )
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc.contacts"]
    assert main(words(path, "--workers", "1")) == 0
    assert path.read_bytes() == expected


def children():
    """Processes that this one has started, and their commands."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
            command = (folder / "cmdline").read_text()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if parent == os.getpid():
            found.append((int(folder.name), command))
    return found


# --- a cluster ---


@contextmanager
def cluster_worker(address):
    """A worker of a Dask cluster that nobody starts again."""
    command = [
        sys.executable,
        "-m",
        "dask",
        "worker",
        address,
        "--no-nanny",
        "--nthreads",
        "1",
        "--no-dashboard",
    ]
    with subprocess.Popen(command, env=os.environ | ONE_THREAD, stderr=subprocess.DEVNULL) as worker:
        try:
            yield worker
        finally:
            worker.kill()


@pytest.fixture
def cluster():
    """Address of a scheduler, and two workers of it."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None) as scheduler,
        cluster_worker(scheduler.scheduler_address) as one,
        cluster_worker(scheduler.scheduler_address) as two,
        distributed.Client(scheduler, set_as_default=False) as client,
    ):
        client.wait_for_workers(2, timeout=60)
        yield scheduler.scheduler_address, one, two


def test_cluster_that_loses_one_of_two_workers_writes_the_same_bytes(
    cluster, expected, tmp_path, monkeypatch
):
    address, one, two = cluster
    monkeypatch.setattr(map_commands, "progress_bar", progress_that_calls(one.kill, 0.25))
    path = tmp_path / "map.nc"
    assert main(words(path, "--dask", address)) == 0
    assert one.wait() == -signal.SIGKILL
    assert two.poll() is None
    assert path.read_bytes() == expected
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc"]
