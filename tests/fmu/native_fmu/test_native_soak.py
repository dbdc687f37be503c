"""The native runtime over many steps and in threads, from C hosts: memory, drift, independence.

The long run by hand: build native/soak.c as here and give it 100000000 steps.
"""

import subprocess

import pytest
from native_host import c_host, sanitized_c_host
from synthetic_map import LAWS, make_map

from ballscrew_fmu.models import TRANSMISSION
from ballscrew_tehl.runtime.packed import MECHANISTIC

pytestmark = pytest.mark.slow

STEPS = 2_000_000
COUNTED = ("-Wl,--wrap=malloc", "-Wl,--wrap=calloc", "-Wl,--wrap=realloc")


@pytest.fixture(scope="module", params=LAWS)
def soak(request, tmp_path_factory):
    return c_host(tmp_path_factory.mktemp("soak"), make_map(law=request.param), "soak", "-O2", *COUNTED)


@pytest.fixture(scope="module")
def transmission(tmp_path_factory):
    options = ("-O2", "-DTRANSMISSION", *COUNTED)
    return c_host(
        tmp_path_factory.mktemp("transmission"), make_map(law=MECHANISTIC, free=0.3), "soak", *options,
        model=TRANSMISSION,
    )  # fmt: skip


@pytest.fixture(scope="module")
def threads_host(tmp_path_factory):
    return c_host(tmp_path_factory.mktemp("threads"), make_map(), "threads", "-O2")


def run(program, *arguments):
    command = [str(program), str(program.parent), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


def test_millions_of_steps_allocate_nothing_and_change_no_result(soak):
    report = run(soak, STEPS)
    assert report.count("random steps: 0 allocations, heap +0 bytes") == 2
    assert report.count("equal to the bit") == 2
    assert report.count("early returns: 0 allocations") == 1


def test_millions_of_steps_of_the_transmission(transmission):
    report = run(transmission, STEPS)
    assert report.count("random steps: 0 allocations, heap +0 bytes") == 2
    assert report.count("equal to the bit") == 2


def test_transmissions_in_threads_under_sanitizers(tmp_path):
    for name in ("thread", "address,undefined"):
        try:
            program = sanitized_c_host(
                tmp_path / name,
                make_map(),
                "threads",
                f"-fsanitize={name}",
                "-DTRANSMISSION",
                model=TRANSMISSION,
            )
        except FileNotFoundError as error:
            pytest.skip(str(error))
        assert ": 0 differ" in run(program, 10, 500)


def test_an_allocation_in_a_step_is_found(soak):
    command = [str(soak), str(soak.parent), "8000", "allocate"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "not so: allocations == before" in done.stdout


@pytest.mark.parametrize(("threads", "steps"), [(2, 20000), (100, 2000)])
def test_instances_in_threads_equal_a_serial_run(threads_host, threads, steps):
    assert ": 0 differ" in run(threads_host, threads, steps)


def test_thread_sanitizer_reports_nothing(tmp_path):
    try:
        program = sanitized_c_host(tmp_path, make_map(), "threads", "-fsanitize=thread")
    except FileNotFoundError as error:
        pytest.skip(str(error))
    for threads, steps in ((2, 2000), (100, 100)):
        assert ": 0 differ" in run(program, threads, steps)
