"""The live page computes the numbers of `torque --json`, in Node and in a browser, where it also works as a page."""

import json
import re
import shutil

import numpy as np
import pytest
from command_line import answer
from processes import output

from ballscrew_fmu.__main__ import main
from ballscrew_fmu.command import main as run_init
from ballscrew_tehl.applications.cli.commands.torque import EXTREMES
from ballscrew_tehl.applications.cli.shared.inputs import key_of

pytestmark = pytest.mark.slow
LARGEST = 4_000_000  # [bytes]
#: keys of the command torque by name on the page
NUMBERS = {
    f"{part}_torque": f"{part}_torque_nm" for part in ("friction", "viscous", "hysteresis", "sliding")
} | {name: key_of(name) for name in EXTREMES}
ENDS = {f"torque_{end}": f"torque_{end}_nm" for end in ("low", "high")}
COMPUTED = "points.map((at) => ({ ...live.model(at) }))"
#: the page without a browser: its elements are objects with the texts of its scripts
IN_NODE = """
const page = require("fs").readFileSync(process.argv[1], "utf8"), points = JSON.parse(process.argv[2]), texts = {};
for (const [, id, text] of page.matchAll(/<script type="[^"]*" id="(\\w+)">([^]*?)<\\/script>/g)) texts[id] = text;
globalThis.window = globalThis;
globalThis.document = { getElementById: (id) => ({ textContent: texts[id] }) };
(0, eval)(page.slice(page.lastIndexOf("<script>") + 8, page.lastIndexOf("</script>")));
const wait = () => (globalThis.live ? console.log(JSON.stringify(eval(process.argv[3]))) : setTimeout(wait, 10));
wait();
"""
AXIS = """
[guide]
seal_resistance_N = [8.0, 12.0]
viscous_Ns_m = 50
[motor]
friction_torque_Nm = 0.1
[axis]
moved_mass_kg = 200
"""
GOOD = "preload [kN]; speed [1/min]; temperature [K]; torque [N mm]\n1,0; 1000; 303,15; 627,1\n2;100;303,15;1e3\n"


@pytest.fixture(scope="session")
def options(tmp_path_factory):
    """Options of each page: packaged sets, and another screw, with seals."""
    sealed = tmp_path_factory.mktemp("screw") / "sealed.toml"
    assert run_init(["init", str(sealed), "--diameter-mm", "32", "--lead-mm", "10"]) == 0
    text = re.sub(r"(?m)^#? *seal_torque_Nm.*$", "seal_torque_Nm = 0.08", sealed.read_text())
    sealed.write_text(text + AXIS)
    assert "seal_torque_Nm = 0.08" in sealed.read_text()
    own = {name: ["--friction", name] for name in ("three_parameter", "mechanistic")}
    return own | {"sealed": ["--screw", str(sealed)]}


@pytest.fixture(scope="session")
def pages(options, tmp_path_factory):
    files = {name: tmp_path_factory.mktemp("live") / f"{name}.html" for name in options}
    for name, file in files.items():
        assert main(["page", *options[name], "--output", str(file)]) == 0
        assert file.stat().st_size <= LARGEST
    return files


@pytest.fixture
def opened(open_page):
    """Function (file, address, width) -> the page."""
    return lambda file, address="", width=1280: open_page(f"{file.as_uri()}{address}", width)


def drawn(page):
    page.until("document.querySelector('#headline:not(:empty)')")
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
    return page


@pytest.mark.parametrize(
    ("engine", "name", "count"),
    [("node", "three_parameter", 200), ("node", "sealed", 50), ("browser", "mechanistic", 8)],
)
def test_numbers_are_those_of_the_command_torque(
    pages, options, request, capsys, tmp_path, engine, name, count
):
    place = np.random.default_rng(7).uniform(size=(count, 4))
    lo, hi = np.array([130.0, 6.0, 11.0, -4000.0]), np.array([9000.0, 5500.0, 79.0, 4000.0])
    keys = ("preload", "speed", "temperature", "axial_load")
    points = [dict(zip(keys, row, strict=True)) for row in np.round(lo + place * (hi - lo), 3).tolist()]
    if engine == "browser":
        found = drawn(request.getfixturevalue("opened")(pages[name])).evaluate(
            f"((points) => {COMPUTED})({json.dumps(points)})"
        )
    elif shutil.which("node") is None:
        pytest.skip("needs Node")
    else:
        found = json.loads(output("-e", IN_NODE, pages[name], json.dumps(points), COMPUTED, program="node"))
    file = tmp_path / "points.csv"
    rows = [",".join(map(str, point.values())) for point in points]
    file.write_text("\n".join(["preload_n,speed_rpm,temperature_c,axial_load_n", *rows]))
    wanted, _ = answer(capsys, "torque", *options[name], "--points", file)

    def ratios(columns):
        return np.array(
            [[f[ours] / w[key] for ours, key in columns.items()] for f, w in zip(found, wanted, strict=True)]
        )

    assert np.max(np.abs(ratios(NUMBERS) - 1.0)) <= 1e-9
    assert [f["clamped"] == 0.0 for f in found] == [w["clamped"] == [] for w in wanted]
    if name == "mechanistic":  # from a table
        assert np.max(np.abs(ratios(ENDS) - 1.0)) <= 0.02


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node")
def test_friction_of_the_whole_axis_is_that_of_the_command_axis(pages, options, capsys):
    at = {"preload": 1500.0, "speed": -700.0, "temperature": 33.0, "axial_load": 0.0}
    parts = "Object.assign(live.state, points[0]) && live.axisParts(live.model(points[0]))"
    found = json.loads(output("-e", IN_NODE, pages["sealed"], json.dumps([at]), f"({parts})", program="node"))
    point = "--preload-n", "1500", "--speed-rpm", "700", "--temperature-c", "33"
    wanted, _ = answer(capsys, "axis", *options["sealed"], *point)
    own = wanted["parts"]
    assert [label for label, *_ in found] == ["nut", "guide", "motor", "sum"]
    values = np.array([own["nut"] + own["wipers"], own["guide"], own["motor"], wanted["friction_torque_nm"]])
    # viscous friction is bilinear between nodes over ln speed
    assert np.max(np.abs([row[1] / value - 1.0 for row, value in zip(found, values, strict=True)])) <= 0.02
    assert found[1][2:] == pytest.approx(
        [wanted["parts_low"]["guide"], wanted["parts_high"]["guide"]], rel=0.02
    )
    assert found[-1][2] < found[-1][1] < found[-1][3]


@pytest.mark.parametrize("width", [390, 1280])
def test_page_by_keyboard_and_address(opened, pages, width):
    page = drawn(opened(pages["mechanistic"], "#preload=1000&speed=1000", width))
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    text = page.text("#headline")
    page.keys("Tab")
    page.type("2000")
    page.until("live.state.preload === 2000")
    assert drawn(page).text("#headline") != text
    page.keys("Tab", "Tab", "Tab", "Right", *["Tab"] * 5, "Space", "Tab", "Return")
    drawn(page).until("location.hash.includes('log=0')")
    state = page.evaluate("({ ...live.state })")
    assert (state["preload"], state["speed"] > 1000.0, state["log"]) == (2000.0, True, False)
    page.until("document.querySelectorAll('#curve tbody tr').length === 13")
    other = drawn(opened(pages["mechanistic"], page.evaluate("location.hash"), width))
    for shown in (
        "document.querySelector('#torque canvas').toDataURL()",
        "document.getElementById('results').innerText",
    ):
        assert other.evaluate(shown) == page.evaluate(shown)


def test_fields_and_files_take_commas_and_refuse_other_texts(opened, pages, tmp_path):
    page = drawn(opened(pages["mechanistic"], "#preload=-5&speed=1e999&points=0_1_1_1_1~1_-1_1_1_1"))
    assert page.evaluate(
        "INPUTS.every((key) => live.state[key] === about.start[key]) && !live.state.points.length"
    )
    for text in ("1600,5", " 1600.5"):
        page.fill("#preload", text)
        assert drawn(page).evaluate("live.state.preload") == 1600.5
    for text in ("-5", "", "abc", "1e999", "1.600,5", "1,600", "1 600", "0x10"):
        page.fill("#preload", text)
        assert drawn(page).evaluate("live.state.preload") == 1600.5
        assert (page.evaluate("element('preload').value"), page.text("#headline")) == (text, "-")
    page.fill("#preload", "2000")
    page.fill("#speed", "9000")
    assert "speed 9000 r/min (the map ends at 6000 r/min)" in drawn(page).text("#outside")
    other = drawn(opened(pages["three_parameter"], "#preload=130&speed=10&temperature=75"))
    assert "no continuum" in other.text("#outside")  # as the command torque
    file = tmp_path / "points.csv"
    file.write_text(GOOD)
    page.choose("label:has(#file)", file)
    page.until("element('deviation').innerText.includes('2 points: mean deviation')")
    assert page.evaluate("live.state.points[0].torque") == pytest.approx(0.6271)
    for bad, line in (
        ("preload [N], speed [r/min]\n1,2", "no column torque"), (f"{GOOD}3;x;1;1", "line 4: speed = 'x'"),
        ("# preload [N];speed [RPM];Moment in NM\n1.500;100;0.4\n800;100;0.3", "can be read in two ways, 1.500 or"),
    ):  # fmt: skip
        file.write_text(bad)
        page.choose("label:has(#file)", file)
        page.until(f"element('bad-file').innerText.includes({json.dumps(line)})")
        assert page.evaluate("live.state.points.length") == 2
    page.click("#published")
    assert drawn(page).evaluate("live.state.points.length") == 11
