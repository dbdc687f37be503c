"""Logs as drives export them: read with one result, or refused in one line with the remedy."""

import numpy as np
import pytest
from command_line import answer, refused
from servo_log import CONSTANT, INERTIA, screw_log

from ballscrew_tehl.nut_map.file import VG100, load_map, packaged_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

AXIS = ("--torque-constant-nm-a", CONSTANT, "--lead-mm", "8")
MAP = ("--screw", PACKAGED_VG100, "--map", packaged_map(VG100), "--temperature-c", "30")
SCOPE = (
    "Name\tX\nFile\tx.svdx\n\nName\tAxis 1.Pos\tName\tAxis 1.Trq\n"
    "SampleTime[ms]\t1\tSampleTime[ms]\t1\nUnit\tdeg\tUnit\tmNm"
)


def axes(*units):
    return "time [{}],position [{}],current [{}]".format(*units)


def column(*texts):
    return tuple(word for text in texts for word in ("--column", text))


PLAIN, SAME = axes("s", "deg", "A"), (1, 1, 1)
SCOPE_AXIS = column("position=Axis 1.Pos", "torque=Axis 1.Trq")
MAPPED = column("time=t_ms [ms]", "position=phi [deg]", "current=Iq[0] [A]")
CONFIRMED = column("time=time [s]", "current=current [mA]")
#: head of the log, its columns (time [s], position [deg], current [A]) and their factors, options, notes
READ = {
    "German": ("Zeit in s;Lage-Istwert (\u00b0);Strom / A", "txi", SAME, (), ""),
    "German torque": ("Zeit [ms];Winkel [Grad];Moment (Ncm)", "txi", (1e3, 1, 100 * CONSTANT), (), ""),
    "row of units": (
        "Trace\nSample Time,0.001,s\nTime,Position,Current\n[s],[deg],[A]", "txi", SAME, (),
        "",
    ),
    "mapped": ("t_ms,phi,torque [Nm],Iq[0]", "txti", (1e3, 1, 0, 1), MAPPED, "columns not used: torque [Nm]"),
    "scope": (SCOPE, "txti", (1e3, 1, 1e3, 1e3 * CONSTANT), SCOPE_AXIS, ""),
    "savetxt": (f"# run 3\n# {PLAIN}", "txi", SAME, (), ""),
    "stated": (axes("ms", "deg", "mA"), "txi", SAME, (*CONFIRMED, AXIS[0], "800"), ""),
    "time of day": ("Timestamp,position [deg],current [A]", "cxi", SAME, (), ""),
    "date": ("Zeit;Winkel [Grad];Strom [A]", "dxi", SAME, (), ""),
    "nanoseconds": (axes("ns", "deg", "Arms"), "nxi", SAME, (), "the torque constant has to be one per Arms"),
    "blocks": (axes("s", "deg", "A"), "bxi", SAME, (), "time begins again at 0 s 2 times: blocks that are apart"),
    "time of each": ("time [s],position [deg],time [s],current [A]", "txti", (1, 1, 1, 1), (), ""),
    "pull one way": ("time [s],position [Degrees],Moment [in-lbs]", "txg", (1, 1, CONSTANT / 0.11298483), (), ""),
}  # fmt: skip
#: and what the line says
REFUSED = {
    "ms for s": (axes("ms", "deg", "A"), "txi", SAME, (), 'time in s, 1000 times: --column "time=time [s]"'),
    "mm for m": (axes("s", "mm", "A"), "txi", (1, 2e-5, 1), (), "position in m, 1000 times"),
    "A for mA": (PLAIN, "txi", (1, 1, 500), MAP, "); likely current in mA, 0.001 times"),
    "rad for deg": (axes("s", "rad", "A"), "txi", (1, 0.25, 1), MAP, "(plausible: 5 to 18000); likely position in deg"),
    "constant": (PLAIN, "txi", SAME, (*MAP, AXIS[0], "800"), "'current [A]' in A and --torque-constant"),
    "no column": (PLAIN, "txi", SAME, column("force=F [N]"), "force=F [N]: no such columns"),
    "no signal": (PLAIN, "txi", SAME, column("M=M [Nm]"), "--column = M=M [Nm]; allowed: QUANTITY="),
    "unit": ("time [s],position [deg],Moment (Nx)", "txi", SAME, (), "'Moment (Nx)': unit 'Nx'; allowed: N.m, dN.m"),
    "left-hand": (PLAIN, "txi", (1, -1, 1), (), "check both signs; a left-hand thread has a negative --lead-mm"),
    "s for ms": (axes("s", "deg", "A"), "txi", (1e3, 1, 1), (), 'likely 0.001 s: --column "time=time [ms]"'),
    "s of a speed": ("time [ms],speed [rad/s],current [A]", "tvi", SAME, (), 'likely time in s, 1000 times: --column'),
    "epoch": (axes("ms", "deg", "A"), "nxi", SAME, (), '<= 1e+11 s; likely --column "time=time [ns]"'),
    "times": ("time [s],time [s],position [deg],current [A]", "ttxi", (1, 2, 1, 1), (), "have unlike times; allowed"),
    "no time": ("Sample,position [deg],current [A]", "txi", SAME, (), "row numbers, with the sample time: --column"),
    "magnitude": (PLAIN, "txq", SAME, ("--inertia-kgm2", str(INERTIA)), "torque never changes its sign: a magnitude"),
    "speed": ("time [s],speed [rad/s],current [A]", "tsi", SAME, (), "the speed never changes its sign: a magnitude"),
    "per cent": ("time [s],position [deg],torque [0.1 %]", "txi", SAME, (), "is a part of the rated value"),
    "row": ("Time;Position;Moment\n[s];[deg];[%]", "txi", SAME, (), "unit '%' is a part of the rated value"),
    "counts": ("time [s],position [INC],torque [Nm]", "txi", SAME, (), "with 4096 a turn state [1/4096 rev]"),
    "twice": ("time [s],position [deg],current [A],current [A]", "txii", (1, 1, 1, 2), (), "allowed: one: rename the"),
    "two": ("time [s],Weg [deg],Lage [deg],Strom [A]", "txxi", (1, 1, 1, 1), (), "both are position; allowed: one, or"),
    "damaged": (PLAIN, "txi", SAME, (), "line 2: 5 fields under 3 headings; allowed: "),
    "unlike times": (SCOPE, "txti", (1e3, 1, 2e3, 1e3), SCOPE_AXIS, "position and torque have unlike times"),
}  # fmt: skip


@pytest.fixture(scope="module")
def signals():
    nut_map = load_map(packaged_map(VG100), load_screw(PACKAGED_VG100))
    time, angle, current = screw_log(nut_map, 1800.0, 1, speeds=(150, 600, 1500))
    speed, start = np.gradient(angle, time), np.datetime64("2026-12-31T23:59:58")
    stamps = [str(start + np.timedelta64(round(1e6 * t), "us")) for t in time]
    block = len(time) // 3 + 1
    return {
        "t": time, "x": np.degrees(angle), "i": current, "v": speed, "s": np.abs(speed), "q": np.abs(current),
        "g": current + 10.0, "b": time[np.arange(len(time)) % block], "c": [f"{text[11:]}Z" for text in stamps],
        "d": [f"31.12.2026 {text[11:].replace('.', ',')}" for text in stamps],
        "n": [f"{1798761600 + t:.6f}000".replace(".", "") for t in time],
    }  # fmt: skip


def write(path, columns, head, damaged, encoding="utf-8"):
    """Decimal commas unless commas are between the fields; texts as they are."""
    mark = next((mark for mark in "\t;" if mark in head), ",")
    point = "." if mark == "," else ","
    texts = [x if isinstance(x[0], str) else [f"{y:.9g}".replace(".", point) for y in x] for x in columns]
    rows = [mark.join(row) for row in zip(*texts, strict=True)]
    for row in damaged:
        rows[row] += f"{mark}1{mark}2"
    path.write_text("\n".join([head, *rows, "EOF"]), encoding=encoding)


@pytest.mark.parametrize("name", READ)
def test_is_read_without_one_damaged_row(name, signals, tmp_path, capsys):
    head, letters, factors, options, note = READ[name]
    columns = [signals[letter] * factor for letter, factor in zip(letters, factors, strict=True)]
    write(tmp_path / "log.csv", columns, head, (500,), "utf-16" if name == "German" else "utf-8-sig")
    found, _ = answer(capsys, "identify", tmp_path / "log.csv", *AXIS, *options)
    assert found["inertia_kgm2"] == pytest.approx(INERTIA, rel=5e-3)
    line, fields = len(head.splitlines()) + 501, len(letters)
    assert note in (notes := "\n".join(found["notes"]))
    said = f"line {line}: {fields + 2} fields under {fields} headings"
    assert f"1 damaged row left out, the first: {said}" in notes


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_in_one_line(name, signals, tmp_path, capsys):
    head, letters, factors, options, line = REFUSED[name]
    columns = [signals[letter] * factor for letter, factor in zip(letters, factors, strict=True)]
    write(tmp_path / "log.csv", columns, head, range(0, 3000, 20) if name == "damaged" else ())
    picture = tmp_path / "x.png"
    assert line in refused(capsys, "identify", tmp_path / "log.csv", *AXIS, *options, "--plot", picture)
    assert not picture.exists()
