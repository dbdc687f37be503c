"""The command `map build`: its range, its plan, a family of screws, an interrupt, its certificate."""

import itertools
import math
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
import pytest
from command_line import answer, refused, run
from reference_screw import GD4008
from synthetic_contacts import closed_contact

from ballscrew_tehl.cli.commands import map_build
from ballscrew_tehl.cli.main import INTERRUPTED
from ballscrew_tehl.nut_map import build, certificate
from ballscrew_tehl.nut_map.certificate import BELOW_SPEED, WHOLE, Deviation, region_points
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.nut_map.grid import MapGrid, map_grid
from ballscrew_tehl.parameters.identity import map_parameters_json
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import CELSIUS, RPM

SCREW = (PACKAGED_DATA / "gd4008.toml").read_text(encoding="utf-8")
#: few nodes and contacts; the range is that of the command
SMALL = MapGrid(
    force=(1.0, 2.0, 9), speed=(1.0, 2.0, 9), temperature=(300.0, 310.0, 7), preload=(1.0, 2.0, 7),
    contact_first=28, contact_batch=8, contact_max=44, contact_largest=100.0, atlas=False,
)  # fmt: skip
NARROW = ("--preload-n", "500", "4000", "--speed-rpm", "100", "1000", "--temperature-c", "20", "40")
WORST = ("--tolerance", "0.1", "--count", "1")


@contextmanager
def thread(workers, dask):
    with ThreadPoolExecutor(1) as pool:
        yield pool


def deviation(nut_map, parameters, point):
    """Different deviations in every place of the result."""
    share = (point[0] % 7.0) / 7.0
    return Deviation(0.01 * share, 0.1 * share, share)


@pytest.fixture
def solved(monkeypatch):
    """Contacts in closed form, solved in one thread, collected here; of a screw named "bad" none converges."""
    found = []

    def solve(parameters, *place):
        found.append(place)
        values = closed_contact(parameters, *place)
        return dict.fromkeys(values, math.nan) if parameters.name == "bad" else values

    monkeypatch.setattr(build, "_solve_contact", solve)
    monkeypatch.setattr(map_build, "MapGrid", lambda: SMALL)
    monkeypatch.setattr(map_build, "build_executor", thread)
    monkeypatch.setattr(certificate, "deviation_at", deviation)
    return found


def built(capsys, path, *options):
    """The map of a build with a certificate of one point, and its log."""
    _, err = answer(capsys, "map", "build", "--output", path, *WORST, *options)
    return load_map(path, GD4008), err


def ends(nut_map, name):
    return pytest.approx(nut_map.header["axes"][name][:2], rel=1e-12)


@pytest.mark.slow
def test_range_of_the_screw_its_table_and_the_options(solved, tmp_path, capsys):
    """--tolerance chooses the number of contacts, here the least and the largest."""
    whole, _ = built(capsys, tmp_path / "whole.nc")
    assert whole.header["contacts"] == 4 * 28
    grid = map_grid(GD4008)
    for name in ("preload", "speed", "temperature"):
        assert getattr(grid, name)[:2] == ends(whole, name), name
    table = "preload_min_N = 300.0\npreload_max_N = 3000.0\nspeed_min_rpm = 50.0\nspeed_max_rpm = 800.0"
    screw = tmp_path / "screw.toml"
    screw.write_text(f"{SCREW}\n[map]\n{table}\n", encoding="utf-8")
    words = "--screw", screw, "--speed-rpm", "100", "1000", "--temperature-c", "20", "40"
    own, _ = built(capsys, tmp_path / "own.nc", *words, "--tolerance", "1e-5")
    assert own.header["contacts"] == 4 * 44
    assert ends(own, "preload") == (300.0, 3000.0)
    assert ends(own, "speed") == (100.0 * RPM, 1000.0 * RPM)
    assert ends(own, "temperature") == (20.0 + CELSIUS, 40.0 + CELSIUS)
    # an axial load relieves one nut
    assert own.header["axes"]["force"][0] < 0.2 * 300.0
    # another range belongs to the same screw
    assert own.header["parameters_json"] == map_parameters_json(GD4008)


@pytest.mark.slow
def test_interrupted_build_continues_and_a_second_one_is_refused(solved, tmp_path, monkeypatch, capsys):
    refusals = []
    words = "map", "build", "--output", tmp_path / "map.nc", *NARROW, *WORST
    left = iter(range(20))

    def interrupted(*arguments):
        if next(left, None) is None:
            raise KeyboardInterrupt
        return closed_contact(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(build, "_solve_contact", interrupted)
        assert run(capsys, *words)[0] == INTERRUPTED
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc.contacts"]

    def row(*arguments):
        """With contacts and certificate in one thread, the second command runs within the first one."""
        refusals.append(refused(capsys, *words))
        return deviation(*arguments)

    monkeypatch.setattr(certificate, "deviation_at", row)
    code, out, err = run(capsys, *words)
    assert code == 0
    assert out.endswith(f"ballscrew build --map {tmp_path / 'map.nc'} --output {tmp_path / 'map_fmus'}\n")
    assert "the certificate holds" in err or "a poor map" in err
    assert len(solved) == 4 * 28 - 20
    assert all("map.nc.contacts: another build is writing it" in line for line in refusals)
    assert refusals
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc"]


@pytest.mark.slow
def test_contacts_that_do_not_converge_are_said(solved, tmp_path, monkeypatch, capsys):
    numbers = itertools.count()

    def partly(failed, of):
        def solve(*arguments):
            values = closed_contact(*arguments)
            return dict.fromkeys(values, math.nan) if next(numbers) % of < failed else values

        monkeypatch.setattr(build, "_solve_contact", solve)

    partly(3, 5)
    code, _, err = run(capsys, "map", "build", "--output", tmp_path / "none.nc", *NARROW, *WORST)
    assert code == 1
    assert "56 contacts of the range did not converge" in err.splitlines()[-1]
    assert not (tmp_path / "none.nc").exists()


@pytest.mark.slow
def test_family_gets_a_map_for_every_screw_that_converges(solved, tmp_path, capsys):
    folder = tmp_path / "screws"
    folder.mkdir()
    for name in "abc":
        text = SCREW.replace('"GD4008-3"', '"bad"' if name == "b" else '"GD4008-3"')
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    words = "map", "build", "--family", folder, *NARROW, *WORST
    found, err = answer(capsys, *words)
    assert [one["file"] for one in found] == [str(folder / name) for name in ("a.nc", "c.nc")]
    assert "2 of 3 maps built; not converged: b.nc: 56 of 56 contacts of the range" in err.splitlines()[-1]
    # what was solved of the second one is kept
    names = [path.name for path in sorted(folder.iterdir())]
    assert names == ["a.nc", "a.toml", "b.nc.contacts", "b.toml", "c.nc", "c.toml"]
    # bad input of the last screw before the first contact
    (folder / "z.toml").write_text(SCREW, encoding="utf-8")
    (folder / "z.nc.contacts").write_text("notes\n", encoding="ascii")
    count = len(solved)
    assert "z.nc.contacts: not a file of solved contacts: remove or rename it" in refused(capsys, *words)
    assert len(solved) == count


@pytest.mark.slow
def test_certificate_is_the_statistics_of_its_points(solved, tmp_path, capsys):
    """Mean, quantiles, largest; one point below the lowest speed."""
    narrow_map, _ = built(capsys, tmp_path / "map.nc", *NARROW, "--count", "7")
    regions, stored = region_points(narrow_map, GD4008, 7), narrow_map.header["certificate"]
    points = [point for name in WHOLE for point in regions[name].tolist()]
    for k, name in enumerate(Deviation._fields):
        column = [deviation(None, None, point)[k] for point in points]
        expected = np.mean(column), *np.quantile(column, (0.5, 0.99, 0.999)), np.max(column)
        found = [stored[f"{name}_error_{key}"] for key in ("mean", "50", "99", "999", "max")]
        assert found == pytest.approx(expected, rel=1e-6)
    assert stored["each"]["preload"] == pytest.approx([point[0] for point in points], rel=1e-5)
    assert stored["regions"][BELOW_SPEED]["points"] == 1
