"""The page on the own machine, at its HTTP level: numbers of the command line, jobs of tabs, what is refused."""

import base64
import http.client
import io
import json
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
import zipfile

import numpy as np
import pytest
from command_line import answer

from ballscrew_fmu.app.page import ASKED, app_of
from ballscrew_fmu.app.server import LARGEST
from ballscrew_fmu.command import main
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import screw_of
from ballscrew_tehl.parameters.units import RPM

pytestmark = pytest.mark.slow
SIZES = {"diameter_mm": "32", "lead_mm": "10"}


@pytest.fixture(scope="module")
def app():
    server = app_of()
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()


def request(app, method="POST", path=None, body="{}", **headers):
    """Status, headers, body of an answer; underscores of header names are dashes."""
    connection = http.client.HTTPConnection("127.0.0.1", app.server_port, timeout=60)
    given = {"Content-Type": "application/json"} | {k.replace("_", "-"): v for k, v in headers.items()}
    # a body that a server does not read makes it reset the connection
    sent = body if method == "POST" else None
    connection.request(method, f"/{app.token}/form" if path is None else path, sent, given)
    reply = connection.getresponse()
    return reply.status, dict(reply.getheaders()), reply.read()


def asked(app, name, tab="one", **content):
    """The last line of the answer to a question."""
    status, _, body = request(app, path=f"/{app.token}/{name}", body=json.dumps({"tab": tab, **content}))
    assert status == 200
    return json.loads(body.splitlines()[-1])


def test_requests_that_are_not_the_pages_are_refused(app):
    root, good = f"/{app.token}/", json.dumps({"tab": "x"})
    port = app.server_port
    for status, one in (
        (404, {"path": "/form", "body": good}), (404, {"path": f"/{app.token[:-1]}x/form", "body": good}),
        (404, {"Host": "evil.example"}), (404, {"Host": f"evil.example:{port}"}),
        (404, {"Host": f"127.0.0.1:{port + 1}"}), (404, {"method": "GET", "path": f"{root}%2e%2e/app.js"}),
        (403, {"Origin": "http://evil.example", "body": good}), (403, {"Origin": "null", "body": good}),
        (404, {"method": "GET", "path": f"{root}../../etc/passwd"}),
        (404, {"method": "GET", "path": f"{root}shown/x"}), (404, {"method": "GET", "path": f"{root}answers.py"}),
        (404, {"path": f"{root}__class__", "body": good}), (501, {"method": "PUT"}), (501, {"method": "OPTIONS"}),
        (400, {"body": "{"}), (400, {"body": "[1]"}), (400, {"body": "{}"}), (400, {"body": "[" * 100_000}),
        (415, {"body": good, "Content_Type": "text/plain"}), (413, {"body": b" " * (LARGEST + 1)}),
        (411, {"body": good, "Content_Length": "-1"}), (411, {"body": good, "Content_Length": "9" * 5000}),
        (400, {"body": json.dumps({"tab": "x", "sizes": 5})}),
    ):  # fmt: skip
        assert request(app, **one)[0] == status, one
    assert request(app, body=good, Origin=f"http://127.0.0.1:{port}", Host=f"localhost:{port}")[0] == 200
    assert app.server_address[0] == "127.0.0.1"


def test_pages_ask_nothing_elsewhere(app):
    for name in ("", "app.js", "app.css", "uPlot.iife.min.js", "page.css", "uPlot.min.css"):
        status, headers, body = request(app, "GET", f"/{app.token}/{name}")
        assert (status, headers["X-Content-Type-Options"], headers["Cache-Control"]) == (
            200,
            "nosniff",
            "no-store",
        )
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert b"http://" not in body.replace(b"http://www.w3.org", b"")
    assert {name for name in ASKED if name.encode() not in request(app, "GET", f"/{app.token}/app.js")[2]} <= {
        "fmus", "table"
    }  # fmt: skip


def test_wrong_entries_are_named_at_their_fields(app):
    for content, entries in (
        ({"sizes": {}}, ["diameter_mm", "lead_mm"]),
        ({"sizes": SIZES | {"turns": "many", "starts": "0"}}, ["starts", "turns"]),
        # the unit of another field, and what is cut off nowhere
        ({"sizes": SIZES | {"ball_mm": "5 N"}}, ["ball_mm"]),
        ({"sizes": SIZES, "point": {"preload_n": f"8{' ' * 300}9"}}, ["preload_n"]),
        ({"sizes": SIZES | {"lead_mm": "1,000"}}, ["lead_mm"]),
        ({"sizes": SIZES, "changes": {"screw.ball_diameter_mm": "12"}}, ["screw.ball_diameter_mm"]),
        ({"sizes": SIZES, "changes": {"screw.turns": "x", "motor.ratio": "0"}}, ["screw.turns", "motor.ratio"]),
        ({"sizes": SIZES, "changes": {"guide.seal_resistance_N": "4"}}, ["axis.moved_mass_kg"]),
        ({"sizes": SIZES, "changes": {"screw.__class__": "4"}}, ["screw.__class__"]),
        ({"sizes": SIZES, "point": {"temperature_c": "300"}}, ["temperature_c"]),
    ):  # fmt: skip
        found = asked(app, "torque", **content)
        assert [one["entry"] for one in found["problems"]] == entries, found
        assert all(one["allowed"] and one["remedy"] for one in found["problems"])
    assert "no valid TOML" in asked(app, "torque", text="[screw")["problem"]
    # a change that the text has no place for is not lost, and no name ends its line
    text = asked(app, "torque", sizes=SIZES)["result"]["text"]
    lead = {"screw.lead_mm": "12"}
    assert asked(app, "torque", text=text.replace("[screw]", '["screw"]'), changes=lead)["problem"]
    own = text, "# a\u2028b\u0085\n" + text
    longer = [asked(app, "torque", text=one, changes=lead)["result"] for one in own]
    assert longer[0]["at"] == longer[1]["at"]
    assert "lead_mm = 12.0" in longer[0]["text"]
    for name in ("x\nsystem('calc')", "a\u2028lead_mm = 99"):
        assert asked(app, "torque", sizes=SIZES, changes={"name": name})["problems"][0]["entry"] == "name"
    assert "result" in asked(app, "torque", sizes=SIZES, changes={"lubricant.nlgi": "2"})
    assert asked(app, "torque", sizes=SIZES, changes={"wipers.friction_torque_Nm": "[]"})["problems"]
    assert asked(app, "torque", text='name = "a\u0000b"')["problem"]


@pytest.mark.parametrize(
    ("sizes", "changes", "point"),
    [
        (SIZES, {}, {}),
        (SIZES, {}, {"preload_n": "0", "axial_load_n": "1500"}),  # clearance
        ({"diameter_mm": "25,4", "lead_mm": "-6.35", "ball_mm": "3.969"}, {"screw.ball_material": "silicon_nitride"},
         {"preload_n": "700", "speed_rpm": "-850", "temperature_c": "31"}),
        (SIZES | {"nut_kind": "single_nut_oversize_ball", "lubricant": "grease"},
         {"screw.seal_torque_Nm": "0.05", "motor.friction_torque_Nm": "0.1 to 0.2"},
         {"preload_n": "900", "axial_load_n": "400", "temperature_difference_k": "1"}),
    ],
)  # fmt: skip
def test_numbers_are_those_of_the_command_line(app, capsys, tmp_path, sizes, changes, point):
    quick = asked(app, "torque", sizes=sizes, changes=changes, point=point)["result"]
    found = asked(app, "page", sizes=sizes, changes=changes, point=point)["result"]
    file = tmp_path / "screw.toml"
    file.write_text(quick["text"])
    options = [f"--{name.replace('_', '-')}={value}" for name, value in quick["point"].items()]
    wanted, _ = answer(capsys, "torque", "--screw", file, *options)
    signed = [abs(wanted[f"{key}_nm"]) for key in ("friction_torque", "torque_low", "torque_high")]
    assert [found["at"][0], *sorted(found["at"][1:])] == pytest.approx(
        [signed[0], *sorted(signed[1:])], rel=1e-9
    )
    # the answer without a map, by the law at each point
    assert quick["at"] == pytest.approx(found["at"], rel=0.02)
    for name, text in changes.items():
        assert text in (quick["values"][name]["value"], "0.1 to 0.2")
    assert (found["budget"] is None) == ("motor.friction_torque_Nm" not in changes)
    if found["budget"]:
        budget, _ = answer(capsys, "axis", file, *options)
        assert found["budget"]["parts"] == pytest.approx(budget["parts"], rel=1e-9)
    status, headers, page = request(app, "GET", f"/{app.token}/{found['shown']}")
    assert status == 200
    assert "frame-ancestors 'self'" in headers["Content-Security-Policy"]
    assert b"WebAssembly" in page


def test_what_does_not_hold_is_said(app):
    """Beyond the map the numbers are those of its edge; of another screw; of a grease; sizes that are swapped."""
    found = asked(app, "page", sizes=SIZES, point={"speed_rpm": "20000", "preload_n": "1000 N"})["result"]
    assert "outside the map of this screw: speed (its range" in found["notes"][0]
    assert asked(app, "page", sizes=SIZES, point={"axial_load_n": "400"})["result"]["notes"] == []
    quick = asked(app, "torque", sizes=SIZES | {"lubricant": "grease", "diameter_mm": "32 mm"})["result"]
    assert "not on screw 32x10 with this oil" in quick["notes"][0]
    assert "run it in" in quick["notes"][0]
    swapped = asked(app, "torque", sizes={"diameter_mm": "10", "lead_mm": "40"})["problem"]
    assert "are lead and diameter swapped?" in swapped


def test_a_tab_has_one_job_and_a_closed_one_none(app):
    """Sizes of their own, so that their maps are made."""
    content = {"tab": "busy", "sizes": {"diameter_mm": "33", "lead_mm": "9"}}
    body = json.dumps(content).encode()
    head = f"POST /{app.token}/page HTTP/1.0\r\nHost: 127.0.0.1:{app.server_port}\r\nContent-Type: application/json\r\n"
    head = f"{head}Content-Length: {len(body)}\r\n\r\n".encode()
    first = socket.create_connection(("127.0.0.1", app.server_port), timeout=60)
    first.sendall(head + body)
    assert b"200" in first.recv(4096)
    time.sleep(0.2)
    assert "result" in asked(app, "torque", tab="busy", sizes=SIZES)
    with first:
        text = b"".join(iter(lambda: first.recv(65536), b""))
    assert json.loads(text.splitlines()[-1]) == {"cancelled": True}
    with socket.create_connection(("127.0.0.1", app.server_port), timeout=60) as closed:
        closed.sendall(head.replace(b"busy", b"gone") + body)
        closed.recv(4096)
    # the next job has its turn, long before a map and a page would be made
    assert app.heavy.submit(int).result(timeout=60.0) == 0


def test_files_to_take_away(app):
    found = asked(app, "report", sizes=SIZES)["result"]
    assert found["file"] == "screw_32x10_report.html"
    assert b"Friction of screw 32x10" in base64.b64decode(found["base64"])
    for name in ("csv", "modelica", "matlab", "json"):
        assert base64.b64decode(asked(app, "table", sizes=SIZES, format=name)["result"]["base64"])
    assert (
        asked(app, "table", sizes=SIZES, format="twincat")["problems"][0]["entry"] == "torque_constant_nm_a"
    )
    listed = asked(app, "table", sizes=SIZES, format="twincat", torque_constant_nm_a="0,8")["result"]
    assert b"frict_comp" in base64.b64decode(listed["base64"])
    built = asked(app, "fmus", sizes=SIZES)["result"]
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(built["base64"]))) as archive:
        names = archive.namelist()
        assert screw_of(archive.read("screw.toml").decode()).name == "screw 32x10"
        listed = archive.read("README.txt").decode()
    fmus = [name for name in names if name.endswith(".fmu")]
    assert len(fmus) == 9
    assert all(f"{name}: " in listed for name in fmus)


def test_measured_torques_and_a_log(app, capsys, tmp_path):
    quick = asked(app, "torque", sizes=SIZES)["result"]
    screw = screw_of(quick["text"])
    law = load_map(None, screw)
    rows = [
        (2000.0, rpm, 30.0, 1.1 * float(law.evaluate(2000.0, rpm * RPM, 303.15).friction_torque))
        for rpm in (50, 200, 800)
    ]
    text = "preload [N],speed [r/min],temperature [degC],torque [N.m]\n"
    text += "\n".join(",".join(f"{x:.6g}" for x in row) for row in rows)
    data = base64.b64encode(text.encode()).decode()
    found = asked(app, "calibrate", sizes=SIZES, data=data)["result"]
    assert len(found["points"]) == 3
    assert base64.b64decode(found["picture"]).startswith(b"\x89PNG")
    point = {"preload_n": "2000", "speed_rpm": "200", "temperature_c": "30"}
    fitted = asked(app, "torque", sizes=SIZES, point=point, fitted=found["fitted"])["result"]
    assert fitted["at"][0] == pytest.approx(rows[1][3], rel=0.01)
    assert fitted["at"][2] - fitted["at"][1] < 0.3 * fitted["at"][0]
    time_, step = np.arange(0.0, 12.0, 2e-3), 2e-3
    speed = 60.0 * np.sin(2.0 * np.pi * time_ / 3.0) + 25.0 * np.sin(2.0 * np.pi * time_ / 1.1)
    torque = 2e-3 * np.gradient(speed, step)
    torque += np.sign(speed) * law.evaluate(2000.0, np.maximum(np.abs(speed), 0.1), 303.15).friction_torque
    torque += np.random.default_rng(3).normal(0.0, 5e-3, len(time_))
    lines = np.column_stack([time_, np.cumsum(speed) * step, torque])
    log = io.StringIO()
    np.savetxt(log, lines, "%.7g", ",", header="time [s],position [rad],torque [N.m]", comments="")
    data = base64.b64encode(log.getvalue().encode()).decode()
    found = asked(app, "identify", sizes=SIZES, data=data, answers={"temperature_c": "30"})["result"]
    assert found["answer"]["inertia_kgm2"] == pytest.approx(2e-3, rel=0.05)
    assert found["answer"]["preload_is_upper_bound"]
    assert found["answer"]["preload_n"] == pytest.approx(2000.0, rel=0.1)
    for answers, line in (
        ({"torque_constant_nm_a": "x"}, "--torque-constant-nm-a = x; allowed: 1e-06 to 10000"),
        ({"guide_force_n": "80+-x"}, "--guide-force-n: standard error = x; allowed: 0 to"),
        ({"guide_force_n": "1,234+-5"}, "write 1234 or 1.234"),
    ):
        assert line in asked(app, "identify", sizes=SIZES, data=data, answers=answers)["problem"]
    names = [one["name"] for one in asked(app, "questions")["result"]["questions"]]
    assert "torque_constant_nm_a" in names
    assert (
        "the file: column preload missing"
        in asked(app, "calibrate", sizes=SIZES, data=base64.b64encode(b"a,b\n1,2").decode())["problem"]
    )
    assert asked(app, "calibrate", sizes=SIZES, data="!")["problem"]
    # a field of 200 000 digits is no number: a pattern would take minutes
    row = f"preload [N],speed [r/min],temperature [degC],torque [N.m]\n{'9' * 200_000},100,30,0.5\n"
    assert asked(app, "calibrate", sizes=SIZES, data=base64.b64encode(row.encode()).decode())["problem"]


def test_the_command_prints_its_address_and_ends_by_an_interrupt():
    text = "from ballscrew_fmu.command import main; raise SystemExit(main(['app', '--no-browser']))"
    with subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True) as program:
        address = program.stdout.readline().strip()
        with urllib.request.urlopen(address, timeout=60) as page:
            assert b"Numbers of the catalogue" in page.read()
        program.send_signal(signal.SIGINT)
        assert (program.wait(60), program.stdout.read().strip()) == (0, "")


def test_a_file_that_is_none_is_refused(capsys, tmp_path):
    missing, other = tmp_path / "no.toml", tmp_path / "other.toml"
    other.write_text("[screw")
    for file, line in ((missing, "no.toml: cannot be read"), (other, "no valid TOML")):
        assert main(["app", str(file), "--no-browser"]) == 2
        assert line in capsys.readouterr().err
