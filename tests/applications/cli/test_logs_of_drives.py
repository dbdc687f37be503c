"""Logs as drives export them: read with one result, or refused in one line with the remedy."""

import numpy as np
import pytest
from command_line import answer, refused
from servo_log import CONSTANT, INERTIA, screw_log

from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

AXIS = ("--torque-constant-nm-a", CONSTANT, "--lead-mm", "8")
MAP = ("--screw", PACKAGED_VG100, "--map", packaged_map(VG100), "--temperature-c", "30")
SCOPE = (
    "Name\tX\nFile\tx.svdx\n\nName\tAxis 1.Pos\tName\tAxis 1.Trq\n"
    "SampleTime[ms]\t1\tSampleTime[ms]\t1\nScaleFactor\t1\tScaleFactor\t1\nUnit\tdeg (Angle)\tUnit\tmNm (Torque)"
)


def axes(*units):
    return "time [{}],position [{}],current [{}]".format(*units)


def column(*texts):
    return tuple(word for text in texts for word in ("--column", text))


PLAIN, SAME = axes("s", "deg", "A"), (1, 1, 1)
SCOPE_AXIS = column("position=Axis 1.Pos", "torque=Axis 1.Trq")
ONE_NAME = "Name\tX\nFile\tx.svdx\n\nName\tTrq\tPos\nOffset\t0\t0\nScaleFactor\t{}\t1\n"
COUNTS = column("time=No. [5 ms]", "position=phi [1/4096 rev]", "current=Iq[0] [Amp peak]")
KANJI = column("time=\u6642\u9593", "position=\u89d2\u5ea6 [deg]", "torque=\u30c8\u30eb\u30af")
SCALED = column("time=Name [ms]", "position=Pos [deg]", "torque=Trq [Nm]")
STATED = column("time=time [s]", "position=position [rev]")
PEAK, CLOCK = column("current=TCMD(X) [A]"), column("time=Time 1 [s]")
CONFIRMED = column("time=time [s]", "current=current [mA]")
#: head of the log, its columns (time [s], position [deg], current [A]) and their factors, options, notes
READ = {
    "German": ("Zeit in s;Lage-Istwert (\u00b0);Strom / A", "txi", SAME, (), ""),
    "German torque": ("Zeit [ms];Winkel [Grad];Moment (Ncm)", "txi", (1e3, 1, 100 * CONSTANT), (), ""),
    "row of units": ("Trace\nStep,1,ms\nTime,Lage,Current\n[s],[deg],[A(p)]", "txi", SAME, (), "[Ap]: the"),
    "mapped": ("No.,phi,torque [Nm],Iq[0]", "txti", (200, 4096 / 360, 0, 1), COUNTS, "columns not used: torque [Nm]"),
    "Japanese": ("\u6642\u9593[ms],\u89d2\u5ea6,\u30c8\u30eb\u30af[N\u30fbm]", "txi", (1e3, 1, CONSTANT), KANJI, ""),
    "scope": (SCOPE, "txti", (1e3, 1, 1e3, 1e3 * CONSTANT), SCOPE_AXIS, ""),
    "peak": ("time [s],position [deg],TCMD(X) [A(p)]", "txi", SAME, PEAK, "[A]: the torque constant"),
    "savetxt": (f"# run 3\n# {PLAIN}", "txi", SAME, (), ""),
    "stated": (axes("ms", "deg", "mA"), "txi", SAME, (*CONFIRMED, AXIS[0], "800"), ""),
    "time of day": ("Timestamp,position [deg],current [A]", "cxi", SAME, (), ""),
    "date": ("Zeit;Winkel [Grad];Strom [A]", "dxi", SAME, (), ""),
    "nanoseconds": (axes("ns", "deg", "Arms"), "nxi", SAME, (), "[Arms]: the torque constant has to be one"),
    "blocks": (axes("s", "deg", "A"), "bxi", SAME, (), "time begins again at 0 s 2 times: blocks that are apart"),
    "time of each": ("time [s],position [deg],time [s],current [A]", "txti", (1, 1, 1, 1), (), ""),
    "pull one way": ("time [s],position [Degrees],Moment [in-lbs]", "txg", (1, 1, CONSTANT / 0.11298483), (), ""),
}  # fmt: skip
#: and what the line says
REFUSED = {
    "rad for deg": (axes("s", "rad", "A"), "txi", (1, 0.25, 1), MAP, "(plausible: 5 to 18000); likely position in deg"),
    "constant": (PLAIN, "txi", SAME, (*MAP, AXIS[0], "800"), "[A]\" and --torque-constant"),
    "no column": (PLAIN, "txi", SAME, column("force=F [N]"), "force=F [N]: no such columns"),
    "no signal": (PLAIN, "txi", SAME, column("M=M [Nm]"), "--column = M=M [Nm]; allowed: QUANTITY="),
    "left-hand": (PLAIN, "txi", (1, -1, 1), (), "check both signs; a left-hand thread has a negative --lead-mm"),
    "s for ms": (axes("s", "deg", "A"), "txi", (1e3, 1, 1), (), 'likely 0.001 s: --column "time=time [ms]"'),
    "s of a speed": ("time [ms],speed [rad/s],current [A]", "tvi", SAME, (), 'likely time in s, 1000 times: --column'),
    "epoch": (axes("ms", "deg", "A"), "nxi", SAME, (), '<= 1e+11 s; likely --column "time=time [ns]"'),
    "no time": ("Sample,position [deg],current [A]", "txi", SAME, (), "row numbers, each 1 ms: --column \"time=row"),
    "magnitude": (PLAIN, "txq", SAME, ("--inertia-kgm2", str(INERTIA)), "torque never changes its sign: a magnitude"),
    "unsigned": ("time [s],position [deg],torque [mNm]", "txu", SAME, (), "16 bit without a sign: subtract 65536"),
    "speed": ("time [s],speed [rad/s],current [A]", "tsi", SAME, (), "the speed never changes its sign: a magnitude"),
    "per cent": ("time [s],position [deg],torque set [%],torque [%]", "txii", (1, 1, 1, 1), (), "'%' is a part of"),
    "row": ("Time;Position;Moment\n[s];[deg];[%]", "txi", SAME, (), "unit '%' is a part of the rated value"),
    "counts": ("time [s],position [kcnt/s],torque [Nm]", "txi", SAME, (), "depends on the encoder: with 4096 a turn"),
    "twice": ("time [s],position [deg],current [A],current [A]", "txii", (1, 1, 1, 2), (), "allowed: one: rename the"),
    "damaged": (PLAIN, "txi", SAME, (), "line 2: 5 fields under 3 headings; allowed: "),
    "unit of drive": ("time [s],position [LU],torque [Nm]", "txi", SAME, (), "state the length or angle of one"),
    "no headings": ("[DATA]", "txi", SAME, (), "no line of headings: '[DATA]'; allowed: 3"),
    "words": ("time [s],speed [r/min],current [A]", "twi", SAME, (), "16 bit without a sign: subtract 65536 from"),
    "slow": (PLAIN, "txi", (57, 1, 1), (), "allowed: <= 0.05 s, sampled too slowly: log faster"),
    "blank": (PLAIN, "toi", SAME, (), "with 'position [deg]'; allowed: >= 200 rows, 50% complete: export at one rate"),
    "clocks": ("Time 1 [s],position [deg],T2 [s],current [A]", "txti", (1, 1, 2, 1), CLOCK, "unlike times 'Time 1"),
    "scaled": (ONE_NAME.format(0.001), "tix", (1e3, 1, 1), SCALED, "[1 N.m]\" if the numbers have it, else"),
    "stated counts": (axes("s", "rev", "A"), "txi", (1, 1e4, 1), STATED, "check --column \"position=position [rev]\""),
    "stated epoch": (axes("ns", "deg", "A"), "nxi", SAME, column("time=time [us]"), '"time=time [ns]"'),
    "unlike times": (SCOPE, "txti", (1e3, 1, 2e3, 1e3), SCOPE_AXIS, "unlike times 'time [ms]' and 'Name'; allowed"),
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
        "g": current + 10.0, "o": [f"{x:.6g}" * (k % 4 == 0) for k, x in enumerate(np.degrees(angle))],
        "u": np.round(1e3 * CONSTANT * current) % 65536, "b": time[np.arange(len(time)) % block],
        "c": [f"{text[11:]}Z" for text in stamps],
        "d": [f"31.12.2026 {text[11:].replace('.', ',')}" for text in stamps],
        "w": np.round(9.55 * speed) % 65536, "n": [f"{1798761600 + t:.6f}000".replace(".", "") for t in time],
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
    encodings = {"German": "utf-16", "German torque": "utf-16-le", "Japanese": "cp932"}
    write(tmp_path / "log.csv", columns, head, (500,), encodings.get(name, "utf-8-sig"))
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
