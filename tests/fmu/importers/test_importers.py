"""The friction FMUs in importers: replay, special paths, two FMUs, zero inputs.

Numbers: rounding of the C library against that of numpy.
"""

import numpy as np
import pytest
from importers import REPLAYS, STEP, needs
from paths import writable
from processes import RUNS_HERE

from ballscrew_fmu.checks.reference import friction_results, reference_input, reference_of
from ballscrew_fmu.checks.replay import largest_difference
from ballscrew_fmu.models import FRICTION, MONITOR

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not RUNS_HERE, reason="run on x86_64 Linux only")]
CASES = [(case, v) for case in REPLAYS for v in case.versions]
CASES += [(case, "python") for case in REPLAYS if case.kind == "CS"]
SPECIAL_FOLDER = (
    "a blank, hash#, plus+, umlaut \u00fc"  # no %: ecos 0.7 does not encode it in the URI of the resources
)


@pytest.mark.parametrize(("case", "kind"), CASES, ids=lambda x: getattr(x, "way", str(x)))
def test_replay_gives_the_numbers_of_the_map(case, kind, built, tmp_path, monkeypatch, synthetic_nut_map):
    """Below a path with special characters, in turns with a second FMU; then with all inputs left at zero."""
    needs(case.tool)
    rows = list(reference_input(synthetic_nut_map.header))
    if case.kind == "CS":
        expected = friction_results(synthetic_nut_map, rows, STEP)
    else:  # without presliding, which is then a matter of the solver; no event gives off heat
        found = friction_results(synthetic_nut_map, rows, STEP, presliding=False)
        expected = [row | {"heat": 0.0} for row in found]
    folder = tmp_path / writable(SPECIAL_FOLDER)
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    fmu, monitor = (folder / f"{model.name}.fmu" for model in (FRICTION, MONITOR))
    fmu.write_bytes(built(FRICTION, kind).read_bytes())
    if case.kind == "CS":
        monitor.write_bytes(built(MONITOR, 2 if kind == "python" else kind).read_bytes())
        reference = reference_of(synthetic_nut_map, MONITOR)
        found, preloads = zip(
            *zip(case.run(fmu, rows), case.run(monitor, reference.inputs), strict=True), strict=True
        )
        assert largest_difference(preloads, reference.outputs)[0] <= 1e-9  # of its search
    else:
        found = list(case.run(fmu, rows))
    assert largest_difference(found, expected)[0] <= 1e-12
    last = list(case.run(fmu, [dict.fromkeys(rows[0], 0.0)] * 4))[-1]
    assert np.isfinite(list(last.values())).all()
    assert (last["friction_torque"], last["power_loss"], last["in_range"]) == (0.0, 0.0, False)
