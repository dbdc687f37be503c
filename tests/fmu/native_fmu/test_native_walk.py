"""All functions of both FMI versions in random order under sanitizers, from the C host native/walk.c."""

import subprocess

import pytest
from native_host import sanitized_c_host
from synthetic_map import LAWS, make_map

pytestmark = pytest.mark.slow

CALLS = 300_000
# not supported by the FMU: no call may succeed
CANNOT = {
    "fmi2SetRealInputDerivatives", "fmi2GetRealOutputDerivatives", "fmi2CancelStep", "fmi2GetStatus",
    "fmi2GetIntegerStatus", "fmi2GetBooleanStatus", "fmi2GetStringStatus", "fmi3EvaluateDiscreteStates",
    "fmi3GetNumberOfVariableDependencies", "fmi3GetVariableDependencies", "fmi3EnterConfigurationMode",
    "fmi3ExitConfigurationMode", "fmi3ActivateModelPartition", "fmi3GetOutputDerivatives",
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_random_calls_give_no_sanitizer_report(tmp_path, law):
    try:
        program = sanitized_c_host(tmp_path, make_map(law=law), "walk", "-fsanitize=address,undefined")
    except FileNotFoundError as error:
        pytest.skip(str(error))
    command = [str(program), str(tmp_path), str(CALLS)]
    environment = {"ASAN_OPTIONS": "detect_leaks=1", "UBSAN_OPTIONS": "print_stacktrace=1"}
    run = subprocess.run(command, capture_output=True, text=True, timeout=600, env=environment)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stderr == ""
    *failures, summary = run.stdout.splitlines()
    assert {line.removeprefix("never succeeded: ") for line in failures} == CANNOT
    assert int(summary.split()[2]) > CALLS // 2  # most calls have succeeded


def test_the_sanitizers_find_a_leak(tmp_path):
    """A host that frees nothing must fail, otherwise the test above could not."""
    try:
        program = sanitized_c_host(tmp_path, make_map(), "leak", "-fsanitize=address,undefined")
    except FileNotFoundError as error:
        pytest.skip(str(error))
    run = subprocess.run([str(program), str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert run.returncode != 0
    assert "LeakSanitizer" in run.stderr
