"""The page of `ballscrew app` as a user has it: the command in a process, its page in a browser, keys and clicks."""

import functools
import json
import re
import signal
import subprocess
import sys

import pytest
from command_line import answer

pytestmark = pytest.mark.slow
COMMAND = "from ballscrew_fmu.command import main; raise SystemExit(main(['app', '--no-browser']))"
#: of the page: it takes entries; the numbers without and with the map are there
READY = "document.body?.dataset.ready === 'yes'"
QUICK = f"{READY} && last && !document.body.classList.contains('old')"
WHOLE = f"{QUICK} && !job && !element('live').hidden"
#: what Tab reaches, and what it has reached
VISIBLE = (
    "[...document.querySelectorAll('input, select, button, summary')]"
    ".filter((one) => !one.disabled && one.checkVisibility())"
)
NAME = "(one) => one.id || one.textContent"
#: assumed entries: reason, border
ASSUMED = (
    "[...document.querySelectorAll('.assumed')].map((row) => [row.querySelector('small').textContent, "
    "getComputedStyle(row.querySelector('input, select')).borderTopStyle])"
)
MEASURED = (
    "preload [N],speed [r/min],temperature [degC],torque [N.m]\n"
    "2000,100,30,0.8\n2000,500,30,0.75\n2000,1000,30,0.8\n"
)


@pytest.fixture(scope="module")
def start():
    """Function -> address of the command, in the cache of the tests."""
    programs = []

    @functools.cache
    def started():
        programs.append(subprocess.Popen([sys.executable, "-c", COMMAND], stdout=subprocess.PIPE, text=True))
        return programs[0].stdout.readline().strip()

    yield started
    for program in programs:
        program.send_signal(signal.SIGINT)
        assert program.wait(120) == 0


@pytest.fixture
def tab(start, open_page):
    """Function (state or address of a page, width) -> the page."""

    def opened(state=None, width=1280):
        page = open_page(start(), width)
        page.until(READY)
        if state:
            text = page.evaluate(f"packed({json.dumps(json.dumps(state))})")
            page.now(f"location.hash = {json.dumps(text)}")
        return page

    return opened


def screw(diameter, lead, **changes):
    """State of a page."""
    return {"sizes": {"diameter_mm": diameter, "lead_mm": lead}, "changes": changes}


def field(name):
    return f'[name="{name}"]'


def shown(number, digits):
    """A number as the page shows it."""
    return f"{float(f'{number:.{digits}g}'):g}"


def test_a_screw_by_keyboard(tab, capsys, tmp_path):
    page = tab()
    page.now("(globalThis.order = [], addEventListener('focusin', (event) => order.push(event.target)))")
    page.now("element('group-screw').open = true")
    fields = page.now(f"{VISIBLE}.map({NAME})")
    page.keys(*["Tab"] * len(fields))
    page.until(f"order.length >= {len(fields)}")
    assert page.now(f"order.map({NAME})") == fields
    page.click("label[for=field-diameter_mm]")
    page.type("32")
    page.keys("Tab")
    page.type("10")
    page.until(QUICK)
    assert re.fullmatch(r"about [\d.]+ N m", page.text("#torque"))
    assert re.match(r"interval [\d.]+ to [\d.]+ N m", page.text("#interval"))
    assumed = page.now(ASSUMED)
    assert len(assumed) > 5
    assert all(re.match("assumed: .+", reason) and border == "dashed" for reason, border in assumed)
    at = page.now("last.at")
    page.until(WHOLE)
    page.click("#save")
    name, content = page.kept()
    assert (name, content.decode()) == ("screw_32x10.toml", page.now("last.text"))
    (tmp_path / name).write_bytes(content)
    options = [f"--{key.replace('_', '-')}={value}" for key, value in page.now("last.point").items()]
    wanted, _ = answer(capsys, "torque", "--screw", tmp_path / name, *options)
    torque, interval = page.text("#torque"), page.text("#interval")
    assert torque == f"{shown(wanted['friction_torque_nm'], 4)} N m"
    ends = [shown(wanted[f"torque_{end}_nm"], 3) for end in ("low", "high")]
    assert f"interval {ends[0]} to {ends[1]} N m" in interval

    page.fill(field("screw.ball_diameter_mm"), "12")
    page.until("document.querySelector('.wrong')")
    assert re.match(r"Allowed: .*\d", page.text(".wrong small"))
    assert page.now("one.name", ".wrong input") == "screw.ball_diameter_mm"
    assert page.now("getComputedStyle(one).opacity", "#torque") == "0.35"
    assert (page.text("#torque"), page.now("job")) == (torque, None)
    page.click("#undo")
    page.until(f"{QUICK} && !document.querySelector('.wrong')")
    assert (page.now("last.at"), page.now("state.changes")) == (at, {})

    page.fill(field("speed_rpm"), "-250,5")
    page.until(f"{QUICK} && last.point.speed_rpm === -250.5")
    everything = "[state, location.hash, last.at, last.text]"
    before = page.evaluate(everything)
    page.now("(globalThis.before = true, location.reload())")
    page.until(f"!globalThis.before && {QUICK}")
    assert page.evaluate(everything) == before


def test_two_tabs_and_measured_torques(tab):
    page, other = tab(screw("32", "10")), tab(screw("25", "5"))
    for one in (page, other):
        one.until(WHOLE)
    assert [one.text("h1") for one in (page, other)] == ["Friction of screw 32x10", "Friction of screw 25x5"]
    at = [one.now("last.at") for one in (page, other)]
    other.fill(field("speed_rpm"), "100")
    page.drop("#measured", "bad.csv", "a,b\n1,2\n")
    page.until("element('found').textContent.includes('column preload missing')")
    assert page.now(QUICK)
    page.drop("#measured", "sheet.csv", MEASURED)
    page.until("!element('picture').hidden && element('picture').naturalWidth > 0")
    assert "3 torques of sheet.csv" in page.text("#found")
    page.until(f"{QUICK} && state.fitted")
    other.until(f"{QUICK} && last.point.speed_rpm === 100")
    relative = "(last.at[2] - last.at[1]) / last.at[0]"
    assert page.now(relative) < 0.5 * other.now(relative)
    page.now("(globalThis.before = true, location.reload())")
    page.until(f"!globalThis.before && {QUICK} && state.fitted")
    page.now("one.focus()", "#forget")
    page.keys("Space")
    other.click("#undo")
    page.until(f"{QUICK} && !state.fitted")
    other.until(f"{QUICK} && last.point.speed_rpm !== 100")
    assert [one.now("last.at") for one in (page, other)] == at
    assert page.now("element('picture').hidden")


def test_a_job_is_cancelled_and_all_is_taken_back(tab):
    page = tab()
    before = page.text("main")
    for name, text in (("diameter_mm", "32"), ("lead_mm", "10")):
        page.fill(field(name), text)
    page.until(QUICK)
    page.click("[data-run=fmus]")
    page.until("element('doing').textContent")
    page.click("#cancel")
    page.until("!job && element('job').hidden")
    assert (page.text("#done"), page.now("element('problem').hidden"), page.saved()) == ("", True, "")
    page.fill(field("turns"), "-1")
    page.until("document.querySelector('.wrong')")
    for _ in range(3):
        page.click("#undo")
    page.until(f"{READY} && !last && !job && !document.body.classList.contains('old')")
    assert page.text("main") == before
    assert page.now(
        "[...document.querySelectorAll('#save, #undo, #print, .take')].every((one) => one.disabled)"
    )


def test_nothing_is_wider_than_the_window(tab, tmp_path):
    axis = {
        "motor.friction_torque_Nm": "0.1 to 0.2",
        "guide.seal_resistance_N": "8",
        "axis.moved_mass_kg": "200",
    }
    page = tab(screw("32", "10", **axis), 1920)
    page.until(f"{WHOLE} && !element('axis').hidden")
    assert page.now("document.querySelectorAll('#budget tbody tr').length") == 4
    page.now("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    page.fill(field("screw.ball_diameter_mm"), "12")
    page.until("document.querySelector('.wrong')")
    for width in (1920, 1280):
        page.resize(width, 900)
        page.until(f"innerWidth === {width}")
        page.until("document.documentElement.scrollWidth <= innerWidth", 20.0)
    page.picture(str(tmp_path / "page.png"))
