"""The report on a user's own screw: its numbers against those of the commands, figures, refusals, interruption."""

import dataclasses
import json
import math
import shlex
import signal
import subprocess
import sys

import numpy as np
import pytest
from command_line import interruptible, refused, run
from html_page import Page
from synthetic_contacts import GRID, closed_build

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.cli.parser import build_parser
from ballscrew_tehl.nut_map.file import save_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.load import double_nut_loads
from ballscrew_tehl.physics.rating import dynamic_rating
from ballscrew_tehl.report import contact_figures, figures, material
from ballscrew_tehl.report.figures import SMALL, WIDTH

pytestmark = pytest.mark.slow

SCREW_FILE = PACKAGED_DATA / "example_25x10.toml"
SCREW = load_parameters(SCREW_FILE)
#: certificate of the map, as `map build` writes it
CERTIFICATE = {
    "points": 12,
    "points_not_solved": 0,
    **{
        f"{name}_error_{key}": 0.001 * (5 * i + k)
        for i, name in enumerate(("torque", "film", "temperature_rise"))
        for k, key in enumerate(("mean", "50", "99", "999", "max"), start=1)
    },
    "regions": {
        "preload alone": {
            "points": 7, "torque_error_99": 0.011, "torque_error_max": 0.012, "film_error_99": 0.013,
            "temperature_rise_error_99": 0.014,
        }
    },
}  # fmt: skip
#: speeds and temperatures up to films so thick that the supply of oil decides
WIDE = dataclasses.replace(
    GRID, speed=(100.0 * RPM, 6000.0 * RPM, 14), temperature=(10.0 + CELSIUS, 40.0 + CELSIUS, 7)
)
PARTS = ["screw", "torque", "film", "balls", "contacts", "map", "friction"]
#: width that a phone of 390 px shows of a figure [pt]
PHONE = 271.0


@pytest.fixture(scope="module")
def options(tmp_path_factory):
    """--screw and --map of the example screw, its map from contacts in closed form."""
    path = tmp_path_factory.mktemp("own") / "my.nc"
    save_map(path, closed_build(SCREW, WIDE), CERTIFICATE)
    return "--screw", SCREW_FILE, "--map", path


@pytest.fixture(scope="module")
def written(options, tmp_path_factory):
    """File, answer, numbers and matplotlib figures of a report with its contacts solved."""
    path = tmp_path_factory.mktemp("report") / "own.html"
    gathered, drawn = [], []
    gather, address = material.gather, figures.figure_address

    def keep(*arguments):
        gathered.append(gather(*arguments))
        return gathered[-1]

    def look(figure, kind):
        drawn.append(figure)
        return address(figure, kind)

    with pytest.MonkeyPatch.context() as patch:
        from ballscrew_tehl.report import screw_figures

        out = []
        patch.setattr(material, "gather", keep)
        for module in (figures, contact_figures, screw_figures):
            patch.setattr(module, "figure_address", look)
        patch.setattr(sys, "stdout", type("", (), {"write": lambda self, text: out.append(text)})())
        assert cli.main(["report", *map(str, options), "--output", str(path), "--json"]) == 0
    return path, json.loads("".join(out)), gathered[0], drawn


@pytest.fixture(scope="module")
def shown(written):
    return Page(written[0].read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def found(written):
    return written[2]


def answer(capsys, *arguments):
    code, out, err = run(capsys, *arguments, "--json")
    assert code == 0, err
    return json.loads(out)


def number(cell):
    return float(cell.split()[0])


# --- the page ---


def test_page_has_the_parts_of_a_screw_and_none_of_the_paper(written, shown):
    path, said, _, _ = written
    assert [name for name in shown.ids if name in PARTS] == PARTS
    assert (said["measured"], said["screw"], said["contacts_converged"]) == (False, "example 25x10", True)
    assert said["figures"] == len(shown.images) == 22
    assert not {"table2", "table4", "claims", "errata", "section5", "validation"} & (
        set(shown.tables) | set(shown.ids)
    )
    assert "report without --screw" in shown.text
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]
    text = path.read_text(encoding="utf-8")
    assert text.isascii()
    assert all(value.startswith("data:image/") for _, _, value in shown.loaded)


def test_operating_point_is_that_of_catalogues(found, shown):
    point = found.screw.point
    assert point.preload == float(f"{0.05 * dynamic_rating(SCREW.screw):.2g}") == 820.0
    assert (point.speed, point.temperature) == (pytest.approx(1000.0 * RPM), pytest.approx(40.0 + CELSIUS))
    assert "preload 820 N, 1000 r/min, oil at 40.0 C" in shown.text


def test_mechanics_are_those_of_the_command_screw(shown, options, capsys):
    rows = shown.tables["mechanics"][1:]
    assert len(rows) == 9
    keys = (
        ("ball_load_max_n", 1.0, 0.06), ("contact_pressure_max_pa", 1e-9, 6e-4), ("pressure_over_static", 1.0, 6e-4),
        ("static_safety", 1.0, 6e-3), ("life_turns", 1e-6, None), ("axial_stiffness_n_per_m", 1e-6, 0.06),
        ("axial_deflection_m", 1e6, 6e-4), ("lost_motion_m", 1e6, 6e-4),
    )  # fmt: skip
    for preload, axial_load, *cells in rows:
        given = ("--preload-n", preload, "--axial-load-n", axial_load)
        said = answer(capsys, "screw", *options[:2], *given)
        # the table rounds the axial load to 1 N
        steps = [answer(capsys, "screw", *options[:2], "--preload-n", preload, "--axial-load-n", float(axial_load) + d)
                 for d in (-0.5, 0.5)]  # fmt: skip
        for cell, (key, factor, digits) in zip(cells, keys, strict=True):
            spread = factor * abs(steps[1][key] - steps[0][key])
            rounding = 6e-4 * factor * said[key] if digits is None else digits
            assert abs(float(cell) - factor * said[key]) <= rounding + spread, (key, preload, axial_load)
    sizes = dict(shown.tables["screw_sizes"])
    said = answer(capsys, "screw", *options[:2], "--preload-n", "820")
    for name in ("dynamic", "static"):
        assert number(sizes[f"{name} load rating"]) == round(said[f"{name}_load_rating_n"])
    assert f"{said['separation_load_n']:.0f} N at 820 N" in sizes["preload released at an axial load of"]


def test_interval_at_the_point_is_that_of_the_command_torque(found, shown, options, capsys):
    point = "--preload-n", "820", "--speed-rpm", "1000", "--temperature-c", "40"
    said = answer(capsys, "torque", *options, *point)
    assert f"(interval {said['torque_low_nm']:.3f} to {said['torque_high_nm']:.3f})" in shown.text
    rows = shown.tables["shares"][1:]
    assert said["torque_interval"].endswith(", ".join(f"{name} {float(share):.0f} %" for name, share in (
        (row[0].replace(" ", "_"), row[1]) for row in rows[:2])))  # fmt: skip
    assert abs(sum(float(share) for _, share in rows) - 100.0) <= 1.0


def test_efficiency_is_that_of_the_command_screw(found, shown, options, capsys):
    half = 0.5 * found.balls.separation
    for rpm, driving, back in shown.tables["efficiency"][1:]:
        said = answer(capsys, "screw", *options, "--preload-n", "820", "--axial-load-n", half, "--speed-rpm", rpm,
                      "--temperature-c", "40")  # fmt: skip
        assert said["in_range"]
        assert driving == f"{100.0 * said['efficiency']:.2f}"
        assert back == f"{100.0 * said['efficiency_backdriving']:.2f}"
    # where a nut leaves the map there is no line
    heavy = found.screw.lines[-1][-1].nut_force_a
    assert heavy < 12000.0
    assert np.isfinite(found.screw.driving[:, 1:]).any()


def test_torques_intervals_and_films_are_those_of_the_command_torque(found, shown, options, capsys):
    def at(preload, rpm, celsius):
        point = "--preload-n", preload, "--speed-rpm", rpm, "--temperature-c", celsius
        return answer(capsys, "torque", *options, *point)

    speeds = [number(cell) for cell in shown.tables["torques"][0][1:-1]]
    assert speeds == [100.0, 500.0, 1000.0, 2500.0]
    for preload, *cells, catalogue in shown.tables["torques"][1:]:
        said = [at(preload, rpm, 40) for rpm in speeds]
        assert cells == [f"{one['friction_torque_nm']:.3f}" for one in said]
        assert catalogue == f"{said[0]['catalogue_torque_nm']:.3f}"
    band = found.lines.over_speed.band
    assert band.meaning in shown.text
    for row, preload in enumerate(found.lines.over_speed.rows):
        for k in (0, 4, 8):
            said = at(preload, band.x[k] / RPM, 40)
            for end, key in ((band.low, "torque_low_nm"), (band.high, "torque_high_nm")):
                assert abs(end[row, k] / said[key] - 1.0) <= 1e-9
    for preload, *cells in shown.tables["intervals"][1:]:
        said = at(preload, band.x[0] / RPM, 40)
        assert cells[0] == f"{said['torque_low_nm']:.3f} to {said['torque_high_nm']:.3f}"
    for celsius, rpm, *cells in shown.tables["films"][1:]:
        said = at(820, rpm, celsius)
        films = ("central_screw_m", "central_nut_m", "min_m")
        expected = [f"{1e9 * said[f'film_thickness_{name}']:.1f}" for name in films]
        assert cells == [*expected, f"{said['lambda_ratio']:.2f}", f"{said['film_temperature_rise_k']:.2f}"]


def test_marked_parts_of_the_lines_are_those_of_the_command_torque(found, shown, options, capsys):
    lines = found.lines.by_temperature
    marks = set()
    for row, temperature in enumerate(lines.rows):
        for k in range(0, 161, 20):
            said = answer(capsys, "torque", *options, "--preload-n", lines.fixed, "--speed-rpm", lines.x[k] / RPM,
                          "--temperature-c", temperature - CELSIUS)  # fmt: skip
            marks.add(bool(lines.marked.unphysical[row, k]))
            assert ("unphysical_trend" in said) == bool(lines.marked.unphysical[row, k])
    assert marks == {True, False}


def test_contact_is_that_of_the_heaviest_ball_at_the_point(found, shown):
    load, speed, temperature = found.contact_point
    count = SCREW.screw.loaded_ball_count
    assert load == double_nut_loads(SCREW.screw, 820.0, 0.0, count).Q_a.max()
    assert (speed, temperature) == found.screw.point[1:]
    rows = shown.tables["solved_contacts"][1:]
    assert [row[:2] for row in rows] == [["rolling frame", "screw"], ["rolling frame", "nut"]]
    for row, (_, _, s) in zip(rows, found.contacts, strict=True):
        assert s.conditions.load == load
        assert row[4:6] == [f"{1e9 * s.h_c:.1f}", f"{1e9 * s.h_m:.1f}"]


def test_certificate_and_limits_of_the_map(found, shown):
    names = ("torque", "film", "temperature_rise")
    for row, name in zip(shown.tables["certificate"][1:], names, strict=True):
        values = [100.0 * CERTIFICATE[f"{name}_error_{key}"] for key in ("mean", "50", "99", "999", "max")]
        assert [number(cell) for cell in row[1:]] == pytest.approx(values, rel=0.06)
    (region,) = shown.tables["certificate_regions"][1:]
    assert region == ["preload alone", "7", "1.1 %", "1.2 %", "1.3 %", "1.4 %"]
    limits = dict(shown.tables["limits"])
    assert limits["contacts solved, not solved"].startswith("192, 0;")
    share = float(np.mean(found.lines.by_temperature.marked.unphysical))
    assert 0.0 < share < 1.0
    assert f"{100.0 * share:.0f} % of those over speed by temperature" in limits["dashed lines of torque"]
    assert "GD4008-3" in limits["friction numbers"]
    # contacts in closed form, without the atlas; two nuts
    assert not {"inside the atlas of contacts", "oversize balls under axial load"} & set(limits)
    axes = {row[0]: row[1:] for row in shown.tables["axes"][1:]}
    assert axes["speed"][:2] == ["100 r/min", "6000 r/min"]


# --- figures ---


def test_letters_are_at_least_8_pt_on_a_phone(written):
    from matplotlib.text import Text

    drawn = written[3]
    assert len(drawn) == 22
    for figure in drawn:
        wide = figure.get_size_inches()[0]
        # the picture of the map is 720 pt wide and scrolls
        shown = min(PHONE / (72.0 * wide), 1.0) if wide == WIDTH else 1.0
        texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
        sizes = np.array([text.get_fontsize() for text in texts])
        assert len(sizes) > 5
        assert sizes.min() * shown >= 8.0
    assert SMALL * PHONE / (72.0 * WIDTH) >= 8.0


@pytest.mark.parametrize("name", list(contact_figures.FIELDS))
def test_fields_are_interpolated_within_their_values_and_exact_on_the_middle_line(found, name):
    for _, _, solution in found.contacts:
        x, y, field = contact_figures.whole_field(solution, name)
        fine_x, fine_y, fine = contact_figures.fine_field(solution, name)
        middle = np.interp(fine_x, x, field[np.argmin(np.abs(y))])
        scale = np.ptp(field[np.abs(y) < 1.0][:, np.abs(x) < 1.0])
        row = int(np.argmin(np.abs(fine_y)))
        assert abs(fine_y[row]) <= 1e-12
        # straight between the nodes there and between other places here: not the same at a spike of one or two nodes
        assert np.quantile(np.abs(fine[row] - middle), 0.95) <= 0.01 * scale
        assert np.max(fine) <= np.max(field)
        assert np.min(fine) >= np.min(field)


@pytest.mark.parametrize("name", list(contact_figures.FIELDS))
def test_scale_is_that_of_the_ellipse_and_leaves_its_surroundings_blank(found, name):
    solutions = [s.solution for s in found.contacts]
    ranges = [contact_figures.inside_range(s, name) for s in solutions]
    factor = contact_figures.FIELDS[name][2]
    levels = contact_figures.contour_levels(ranges, name)
    assert 5 <= levels.size <= contact_figures.LEVELS + 2
    assert np.all(np.diff(levels) > 0.0)
    step = levels[1] - levels[0]
    top = factor * np.max([most for _, most in ranges])
    assert top <= levels[-1] <= top + step
    for solution in solutions:
        _, _, field = contact_figures.fine_field(solution, name)
        corners = factor * field[np.ix_([0, -1], [0, -1])]
        if name == "film":
            assert np.all(corners > levels[-1])
            assert np.all(levels[0] <= factor * np.array([least for least, _ in ranges]))
        if name == "pressure":
            assert np.all(corners < levels[0])


# --- options and refusals ---


@pytest.fixture
def not_solved(found, monkeypatch):
    """Reuse solved contacts, do not write pictures; the points that were asked for."""
    points = []

    def contacts(parameters, kinematics, point, progress):
        points.append(point)
        return found.contacts

    monkeypatch.setattr(material, "solved_contacts", contacts)
    from ballscrew_tehl.report import screw_figures

    for module in (figures, contact_figures, screw_figures):
        monkeypatch.setattr(module, "figure_address", lambda figure, kind: "data:image/png;base64,AAAA")
    return points


def test_operating_point_by_options(not_solved, options, tmp_path, capsys):
    target = tmp_path / "r.html"
    given = ("--preload-n", "1500", "--speed-rpm", "300", "--temperature-c", "30")
    code, _, err = run(capsys, "report", *options, *given, "--output", target)
    assert code == 0
    ((load, speed, temperature),) = not_solved
    count = SCREW.screw.loaded_ball_count
    assert load == double_nut_loads(SCREW.screw, 1500.0, 0.0, count).Q_a.max()
    assert (speed, temperature) == (pytest.approx(300.0 * RPM), pytest.approx(30.0 + CELSIUS))
    page = Page(target.read_text(encoding="utf-8"))
    assert [row[0] for row in page.tables["torques"][1:]] == ["750", "1500", "3000"]
    assert "choose another point" not in page.text
    steps = [line.partition(",")[0] for line in err.splitlines()]
    assert "54 of 54 intervals of the torque" in steps
    assert steps[-1] == "7 of 7 parts of the page"


def test_screw_without_a_map_is_told_the_command_that_builds_it(tmp_path, capsys):
    screw = tmp_path / "my screw.toml"
    screw.write_text(SCREW_FILE.read_text(encoding="utf-8"), encoding="utf-8")
    line = refused(capsys, "report", "--screw", screw, "--output", tmp_path / "r.html")
    command = line.partition("build it with: ")[2].partition("; then give ")[0]
    words = shlex.split(command)
    assert words[:5] == ["python", "-m", "ballscrew_tehl", "map", "build"]
    parsed = build_parser().parse_args(words[3:])
    assert (parsed.screw, parsed.output) == (str(screw), "my screw_map.nc")
    assert line.endswith("--map 'my screw_map.nc'")
    assert [entry.name for entry in tmp_path.iterdir()] == [screw.name]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupted_report_is_one_line_and_leaves_nothing(options, tmp_path):
    target = tmp_path / "r.html"
    target.write_text("old")
    words = [sys.executable, "-m", "ballscrew_tehl", "report", *map(str, options), "--output", str(target)]
    with subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=interruptible,
    ) as process:
        first = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    assert first == "0 of 45 intervals of the torque\n"
    assert (process.returncode, out) == (130, "")
    others = [
        line for line in err.splitlines() if not line.partition(",")[0].endswith("intervals of the torque")
    ]
    assert others == ["ballscrew_tehl report: interrupted"]
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("r.html", "old")]


def test_fixed_numbers_of_the_interval_are_not_the_torque(found):
    """The torque lies within its interval, whose ends are apart."""
    lines = found.lines.over_speed
    at = found.chosen.torque(lines.rows[:, None], lines.band.x, lines.fixed)
    assert np.all(lines.band.low <= at)
    assert np.all(at <= lines.band.high)
    assert np.all(lines.band.high / lines.band.low > 1.2)
    assert math.isclose(lines.band.x[0], lines.x[0])
