"""The benchmark of maps in a small form."""

import csv
import math
from types import SimpleNamespace

import bench_maps
import pytest

from ballscrew_tehl.cli.commands import map_build as map_commands
from ballscrew_tehl.nut_map.grid import MapGrid

#: few contacts and nodes
SMALL = MapGrid(
    force=(1.0, 2.0, 9), speed=(1.0, 2.0, 7), temperature=(300.0, 310.0, 5), preload=(1.0, 2.0, 7),
    contact_first=8, contact_most=8, atlas=False,
)  # fmt: skip


def narrow_copy(folder, name="example_16x05"):
    """One of the screws with a narrow range of its map."""
    table = """
[map]
preload_min_N = 300.0
preload_max_N = 600.0
speed_min_rpm = 200.0
speed_max_rpm = 600.0
temperature_min_degC = 30.0
temperature_max_degC = 40.0
"""
    text = (bench_maps.SCREWS / f"{name}.toml").read_text(encoding="utf-8")
    folder.mkdir()
    (folder / f"{name}.toml").write_text(text + table, encoding="utf-8")
    return folder


@pytest.mark.slow
def test_benchmark_builds_a_map_and_continues(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(map_commands, "QUICK", SMALL)
    output = tmp_path / "maps.csv"
    arguments = ["--screws", str(narrow_copy(tmp_path / "screws")), "--only", "example_16x05", "--quick"]
    arguments += ["--count", "2", "--workers", "1", "--output", str(output)]
    (row,) = bench_maps.main(arguments)
    assert (row.screw, row.code, row.contacts, row.kept, row.points) == ("example_16x05", 0, 32, 0, 2)
    assert row.not_solved == row.points_not_solved == 0
    assert 0.0 < row.torque_mean <= row.torque_99 <= row.torque_max < 0.05
    # one process and this one that waits for it
    assert 0.0 < row.core_seconds < 2.0 * row.seconds
    assert (tmp_path / "maps.maps" / "example_16x05.nc").is_file()
    shown = capsys.readouterr().out
    assert "torque 99 [%]" in shown
    assert "example_16x05" in shown
    with output.open(newline="", encoding="utf-8") as stream:
        (kept,) = csv.DictReader(stream)
    assert float(kept["torque_99"]) == row.torque_99
    monkeypatch.setattr(bench_maps, "build", None)  # nothing is left to build
    assert bench_maps.main(arguments) == [row]


@pytest.mark.slow
def test_ratio_is_of_one_worker_over_two(tmp_path, capsys, monkeypatch):
    """The same map twice; seconds are those of the builds."""
    monkeypatch.setattr(map_commands, "QUICK", SMALL)
    built, build = [], bench_maps.build

    def counted(*arguments):
        built.append(build(*arguments))
        return built[-1]

    monkeypatch.setattr(bench_maps, "build", counted)
    (case,) = bench_maps.cases(narrow_copy(tmp_path / "screws"), ["example_16x05"])
    row = bench_maps.workers_ratio(case, True, 1)
    assert (row.screw, row.contacts) == ("example_16x05", 32)
    assert (row.one, row.two) == (built[0].seconds, built[1].seconds)
    assert row.ratio == row.one / row.two
    monkeypatch.setattr(bench_maps, "workers_ratio", lambda *arguments: row)
    arguments = ["--screws", str(tmp_path / "screws"), "--only", "example_16x05", "--workers-ratio"]
    assert bench_maps.main(arguments) == []
    head, cells = capsys.readouterr().out.splitlines()
    assert head.split() == ["screw", "contacts", "one", "two", "ratio", "load", "before", "load", "after"]
    assert float(cells.split()[4]) == pytest.approx(row.ratio, abs=0.005)


def test_ratio_of_maps_that_differ_is_refused(monkeypatch):
    def build(case, maps, quick, count, workers):
        (maps / f"{case.name}.nc").write_bytes(bytes([workers]))
        return SimpleNamespace(code=0, seconds=1.0, contacts=1)

    monkeypatch.setattr(bench_maps, "build", build)
    with pytest.raises(ArithmeticError, match="x: two workers write other bytes than one"):
        bench_maps.workers_ratio(bench_maps.Case("x", ()), True, 1)


def test_cases_are_the_folder_and_the_packaged_screw():
    found = bench_maps.cases(bench_maps.SCREWS)
    assert len(found) == 12
    assert [case.name for case in found[-2:]] == ["gd4008_published", "gd4008_rolling_frame"]
    assert [case.name for case in bench_maps.cases(bench_maps.SCREWS, ["example_80x20"])] == ["example_80x20"]
    with pytest.raises(ValueError, match="allowed: example_08x02"):
        bench_maps.cases(bench_maps.SCREWS, ["example_8x2"])


@pytest.mark.parametrize(("code", "raised"), [(2, SystemExit), (130, KeyboardInterrupt)])
def test_bad_input_and_an_interrupt_leave_no_row(tmp_path, monkeypatch, code, raised):
    monkeypatch.setattr(bench_maps, "command", lambda words: code)
    with pytest.raises(raised):
        bench_maps.build(bench_maps.Case("x", ()), tmp_path, True, 1, None)
    output = tmp_path / "maps.csv"
    if raised is KeyboardInterrupt:
        assert bench_maps.main(["--output", str(output)]) == []
    assert not output.exists()


def test_a_map_that_is_not_built_is_a_row_without_figures(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench_maps, "command", lambda words: 1)
    (row,) = bench_maps.main(["--only", "gd4008_published", "--maps", str(tmp_path)])
    assert (row.code, row.contacts) == (1, 0)
    assert all(math.isnan(value) for value in (row.asymptotic, row.torque_max, row.rise_99))
    assert "nan" in capsys.readouterr().out
