"""The Modelica package: external functions called from C against the native FMU; law and axis run by rumoca.

rumoca has no external functions, and no standard library is installed: stubs replace the map and the library.
"""

import math
import re
import subprocess
import sys

import model_exchange
import modelica_package
import numpy as np
import pytest
import servo_axis
from modelica_host import build, call, externals
from paths import FMU_SUPPORT
from rotor_fmu import RUNS_HERE
from synthetic_map import make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_tehl.runtime.packed import MECHANISTIC
from ballscrew_tehl.runtime.standstill import presliding_step

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RUNS_HERE, reason="library and FMU of the test are for x86_64 Linux"),
]
TEXT = (modelica_package.SOURCE / "package.mo").read_text().replace("within ;", "", 1)
STAND_INS = FMU_SUPPORT / "modelica" / "standard_library.mo"
LIBRARY = STAND_INS.read_text().replace("within ;", "", 1)
DEFAULTS = ("apparentViscosityRatio", "netSlidingCoefficient", "roughnessHeight", "breakawayFactor")


@pytest.fixture(scope="module")
def package(tmp_path_factory, synthetic_nut_map):
    return modelica_package.assemble(
        synthetic_nut_map, tmp_path_factory.mktemp("modelica"), ("x86_64-linux",)
    )


@pytest.fixture(scope="module")
def program(package, tmp_path_factory):
    return build(tmp_path_factory.mktemp("host"), package)


def map_of(package):
    return package / "Resources" / "Data" / "nut_map.bin"


@pytest.fixture(scope="module")
def defaults(program, package):
    return [value for (value,) in call(program, map_of(package), [(name,) for name in DEFAULTS])]


def points(axes, count=200):
    """Preload, speed, temperature, axial load through and beyond the map, in both directions."""
    draw = np.random.default_rng(7).uniform
    force, speed, (cold, hot) = axes["force"][1], axes["speed"], axes["temperature"][:2]
    magnitude = np.exp(draw(np.log(0.1 * speed[0]), np.log(1.1 * speed[1]), count))
    return np.column_stack(
        [
            draw(0.01 * force, 1.05 * force, count),
            np.where(draw(-1.0, 1.0, count) < 0.0, -magnitude, magnitude),
            draw(cold - 3.0, hot + 3.0, count),
            np.where(np.arange(count) % 3, draw(-0.4 * force, 0.4 * force, count), 0.0),
        ]
    ).tolist()


# external functions


def test_the_package_contains_the_files_of_its_functions(package):
    names = {str(path.relative_to(package)) for path in package.rglob("*") if path.is_file()}
    assert {"package.mo", "Resources/Include/BallScrewFriction.h", "Resources/Data/nut_map.bin"} < names
    assert "Resources/Library/linux64/libBallScrewFriction.a" in names
    functions = externals(TEXT)
    assert len(functions) == 13
    assert TEXT.count('Include="#include \\"BallScrewFriction.h\\""') == len(functions)
    for annotation in ("Include", "Library"):
        folder = f'{annotation}Directory="modelica://BallScrewFriction/Resources/{annotation}"'
        assert TEXT.count(folder) == len(functions)


def test_the_stiffness_is_that_of_the_screw(program, package, synthetic_nut_map, defaults):
    _, coefficient, _, breakaway = defaults
    preloads = (0.0, 20.0, 2000.0, 11000.0)
    calls = [("preslidingStiffness", preload, coefficient, breakaway) for preload in preloads]
    for preload, (found,) in zip(preloads, call(program, map_of(package), calls), strict=True):
        expected = synthetic_nut_map.presliding_stiffness(preload, 0.0, coefficient, breakaway)
        assert found == pytest.approx(expected, rel=1e-12)


def test_functions_give_the_values_of_the_fmu(program, package, native_fmu, synthetic_nut_map, defaults):
    rows = points(synthetic_nut_map.header["axes"])
    ratio, coefficient, roughness, breakaway = defaults
    calls = [("viscousTorque", *row, ratio, roughness) for row in rows]
    calls += [("coulombTorque", *row, coefficient, breakaway) for row in rows]
    calls += [("covered", *row) for row in rows] + [("films", *row) for row in rows]
    answers = call(program, map_of(package), calls)
    viscous, coulomb, covered, films = (answers[n * len(rows) : (n + 1) * len(rows)] for n in range(4))
    flags = set()
    with FmuInstance(native_fmu, presliding=False, regularization_speed=0.0) as fmu:
        for n, (preload, speed, temperature, load) in enumerate(rows):
            assert fmu.step(1e-3, preload=preload, speed=speed, temperature=temperature, axial_load=load)
            out = fmu.outputs()
            assert viscous[n][0] == pytest.approx(out["viscous_torque"], rel=1e-12, abs=0.0)
            magnitude = abs(out["hysteresis_torque"]) + abs(out["sliding_torque"])
            assert coulomb[n][0] == pytest.approx(magnitude, rel=1e-12, abs=0.0)
            assert bool(covered[n][0]) is out["in_range"]
            expected = (out["film_thickness_min"], out["film_temperature_rise"], out["contact_pressure_max"])
            assert films[n] == pytest.approx(expected, rel=1e-12, abs=0.0)
            flags.add(out["in_range"])
    assert flags == {True, False}


def test_parameters_of_the_map_are_its_defaults_and_are_used(program, package, synthetic_nut_map, defaults):
    stored = synthetic_nut_map.header["defaults"]
    names = ("apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height", "breakaway_factor")
    assert defaults == [stored[name] for name in names]
    ratio, coefficient, roughness, breakaway = defaults
    at = (2000.0, 50.0, 303.15, 0.0)
    calls = [("viscousTorque", *at, ratio, roughness), ("viscousTorque", *at, 2.0 * ratio, roughness),
             ("viscousTorque", *at, ratio, 2.0 * roughness + 1e-8), ("coulombTorque", *at, coefficient, breakaway),
             ("coulombTorque", *at, 2.0 * coefficient, breakaway)]  # fmt: skip
    (first,), (doubled,), (rough,), (coulomb,), (more,) = call(program, map_of(package), calls)
    assert doubled == pytest.approx(2.0 * first)
    assert rough < first
    sliding = synthetic_nut_map.evaluate(*at).sliding_torque
    assert more - coulomb == pytest.approx(sliding, rel=1e-9)


def test_rates_are_those_of_the_functions(program, package, defaults):
    """Analytic derivatives against central differences along a line."""
    ratio, coefficient, roughness, breakaway = defaults
    at, along = np.array([2000.0, 40.0, 305.0, 300.0]), np.array([300.0, -4.0, 2.0, 80.0])
    h = 1e-4
    ends = [at - h * along, at + h * along]
    calls = [("viscousTorque", *x, ratio, roughness) for x in ends]
    calls += [("coulombTorque", *x, coefficient, breakaway) for x in ends]
    calls += [("viscousTorque_der", *at, ratio, roughness, *along),
              ("coulombTorque_der", *at, coefficient, breakaway, *along)]  # fmt: skip
    low, high, below, above, viscous, coulomb = (value for (value,) in call(program, map_of(package), calls))
    assert viscous == pytest.approx((high - low) / (2.0 * h), rel=1e-6)
    assert coulomb == pytest.approx((above - below) / (2.0 * h), rel=1e-6)
    assert viscous != 0.0 != coulomb


def test_functions_of_the_mechanistic_law(tmp_path):
    """Values at rest, below and within the map against Python; rates against central differences."""
    nut_map = make_map(law=MECHANISTIC)
    package = modelica_package.assemble(nut_map, tmp_path / "package", ("x86_64-linux",))
    program = build(tmp_path / "host", package)
    ratio, coefficient, roughness, breakaway = friction = tuple(nut_map.defaults)
    rows = [(2000.0, w, T, F) for w in (0.0, -0.2, 0.2, 30.0) for T in (290.0, 330.0) for F in (0.0, 900.0)]
    calls = [("coulombTorque", *row, coefficient, breakaway) for row in rows]
    calls += [("viscousTorque", *row, ratio, roughness) for row in rows]
    values = [value for (value,) in call(program, map_of(package), calls)]
    for row, coulomb, viscous in zip(rows, values[: len(rows)], values[len(rows) :], strict=True):
        state = nut_map.evaluate(*row, *friction)
        assert coulomb == pytest.approx(state.coulomb_torque, rel=1e-12, abs=0.0)
        assert viscous == pytest.approx(math.copysign(state.viscous_torque, row[1]), rel=1e-12, abs=0.0)
    along, h = np.array([300.0, -0.4, 2.0, 80.0]), 1e-4
    for w in (-0.2, 0.3, 40.0):
        at = np.array([2000.0, w, 305.0, 300.0])
        calls = [("coulombTorque", *x, coefficient, breakaway) for x in (at - h * along, at + h * along)]
        calls += [("coulombTorque_der", *at, coefficient, breakaway, *along)]
        low, high, rate = (value for (value,) in call(program, map_of(package), calls))
        assert rate == pytest.approx((high - low) / (2.0 * h), rel=1e-6)


def test_bad_files_and_values_stop_with_a_message(program, package, tmp_path):
    with pytest.raises(RuntimeError, match=r"exit 3: BallScrewFriction: .*missing\.bin"):
        call(program, tmp_path / "missing.bin", [])
    (tmp_path / "short.bin").write_bytes(map_of(package).read_bytes()[:-8])
    with pytest.raises(RuntimeError, match=r"exit 3: BallScrewFriction: .*short\.bin"):
        call(program, tmp_path / "short.bin", [])
    with pytest.raises(RuntimeError, match="exit 3: BallScrewFriction: speed = nan; needs a finite number"):
        call(program, map_of(package), [("covered", 2000.0, float("nan"), 303.0, 0.0)])
    with pytest.raises(RuntimeError, match=r"net_sliding_coefficient = -0\.1; needs"):
        call(program, map_of(package), [("coulombTorque", 2000.0, 0.0, 303.0, 0.0, -0.1, 1.0)])


def test_sanitizers_find_nothing(package, program, tmp_path, synthetic_nut_map, defaults):
    try:
        sanitized = build(tmp_path / "sanitized", package, sanitized=True)
    except FileNotFoundError as error:
        pytest.skip(str(error))
    rows = points(synthetic_nut_map.header["axes"], 20)
    calls = [("viscousTorque", *row, defaults[0], defaults[2]) for row in rows] + [
        ("films", *row) for row in rows
    ]
    found = np.array([x for row in call(sanitized, map_of(package), calls) for x in row])
    expected = np.array([x for row in call(program, map_of(package), calls) for x in row])
    assert found == pytest.approx(expected, rel=1e-12)


def test_header_and_declarations_are_compared(package, tmp_path):
    """A declaration that differs from the header does not compile."""
    wrong = tmp_path / "BallScrewFriction"
    subprocess.run(["cp", "-r", str(package), str(wrong)], check=True)
    text = (wrong / "package.mo").read_text()
    (wrong / "package.mo").write_text(
        text.replace("ballScrewMap_covered(map, preload,", "ballScrewMap_covered(map,")
    )
    with pytest.raises(subprocess.CalledProcessError) as failed:
        build(tmp_path / "host", wrong)
    assert re.search(r"conflicting types.*ballScrewMap_covered", failed.value.stderr)


def test_command_line_writes_the_packaged_screw(tmp_path, capsys):
    assert modelica_package.main(["--output", str(tmp_path)]) == 0
    assert "win64/libBallScrewFriction.a" in capsys.readouterr().out
    host = build(tmp_path / "host", tmp_path / "BallScrewFriction")
    ((torque,),) = call(
        host, map_of(tmp_path / "BallScrewFriction"), [("covered", 2000.0, 50.0, 303.15, 0.0)]
    )
    assert torque == 1.0


@pytest.mark.parametrize("arguments", [["--wrong"], ["--screw", "missing.toml"], ["--map", __file__]])
def test_bad_input_is_one_line_and_exit_code_2(arguments):
    script = modelica_package.__file__
    run = subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert len(run.stderr.strip().splitlines()) == 1


def test_friction_takes_its_torque_out_of_the_flanges():
    """Flange torques act on the component: their sum times the speed is the power tau*w that it takes up."""
    balance = re.findall(r"^ *0 = (.*flange_a\.tau.*);$", TEXT, re.MULTILINE)
    assert len(balance) == 1
    expression = re.sub(r"flange_([ab])\.tau", r"flange_\1", balance[0])
    for flange_a, flange_b in ((0.4, 0.0), (0.0, 0.4), (1.4, -1.0)):
        assert eval(
            expression, {}, {"flange_a": flange_a, "flange_b": flange_b, "tau": 0.4}
        ) == pytest.approx(0.0)


# parsers


def test_pymoca_reads_the_package():
    parser = pytest.importorskip("pymoca.parser", reason="python -m pip install -e '.[modelica]'")
    tree = parser.parse(TEXT)
    found = tree.classes["BallScrewFriction"].classes
    assert list(found) == [
        "ScrewFriction", "NutFriction", "ScrewTransmission", "Interfaces", "Map", "Examples"
    ]  # fmt: skip
    assert len(found["Map"].classes) == 12
    with pytest.raises(Exception, match="extraneous input"):
        parser.parse(TEXT.replace("  equation\n", "  equations\n", 1))


def rumoca():
    return pytest.importorskip("rumoca", reason="python -m pip install -e '.[modelica]'")


def test_rumoca_finds_no_error_in_the_package():
    found = rumoca().validate_source(LIBRARY + TEXT)
    # the rule reports constructors and destructors of external objects, which are impure by definition
    assert {(d.level, d.rule) for d in found} <= {("warning", "external-purity-undeclared")}
    assert [
        d.level for d in rumoca().validate_source(LIBRARY + TEXT.replace("SI.Angle z(", "SI.Angel z("))
    ] != []


# law and axis, compiled and run

CHECK = """
package Check
  model PlainNuts
    extends BallScrewFriction.Interfaces.PartialNutFriction;
  equation
    coulomb = {level!r}*(forceA + forceB)/4000;
    viscous = {slope!r}*w;
  end PlainNuts;

  model TransmissionAxis
    extends BallScrewFriction.Examples.TransmissionAxis(redeclare model Friction = PlainNuts);
    Real heat(start=0, fixed=true), work(start=0, fixed=true);
  equation
    der(heat) = oil.port.Q_flow;
    der(work) = motor.tau*screw.w;
  end TransmissionAxis;

  model Plain
    extends BallScrewFriction.Interfaces.PartialScrewFriction;
    parameter Real level = {level!r};
    parameter Real slope = {slope!r};
  equation
    coulomb = level;
    viscous = slope*w;
  end Plain;

  model Rotor
    Plain friction(preslidingStiffness={stiffness!r});
    Modelica.Mechanics.Rotational.Components.Inertia rotor(
      J={inertia!r}, phi(start=0, fixed=true), w(start=0, fixed=true));
    Modelica.Mechanics.Rotational.Sources.Torque motor;
    Modelica.Thermal.HeatTransfer.Sources.FixedTemperature oil(T=303.15);
    Real heat(start=0, fixed=true), work(start=0, fixed=true);
  equation
    motor.tau = {amplitude!r}*sin(2*Modelica.Constants.pi*{frequency!r}*time);
    friction.preload = 2000;
    friction.axialLoad = 0;
    der(heat) = oil.port.Q_flow;
    der(work) = friction.tau*friction.w;
    connect(motor.flange, rotor.flange_a);
    connect(rotor.flange_b, friction.flange_a);
    connect(friction.heatPort, oil.port);
  end Rotor;

  model Axis
    extends BallScrewFriction.Examples.Axis(redeclare model Friction = Plain);
  end Axis;
end Check;
"""


def simulated(model, stop, interval, **values):
    tool = rumoca()
    values = {"slope": 0.0, "stiffness": 1.0, "inertia": 1.0, "amplitude": 0.0, "frequency": 1.0, **values}
    compiled = tool.Session().loads(LIBRARY + TEXT + CHECK.format(**values), model=f"Check.{model}")
    return compiled.simulate(t=(0.0, stop), config=tool.SimConfig(rtol=1e-9, atol=1e-11, dt=interval))


@pytest.fixture(scope="module")
def coulomb(program, package, defaults):
    ((value,),) = call(
        program, map_of(package), [("coulombTorque", 2000.0, 0.0, 303.15, 0.0, defaults[1], defaults[3])]
    )
    return value


@pytest.fixture(scope="module")
def rotor(coulomb):
    start = model_exchange.START
    return simulated(
        "Rotor", model_exchange.TIME, model_exchange.INTERVAL, level=coulomb, stiffness=start["presliding_stiffness"],
        inertia=model_exchange.INERTIA, amplitude=model_exchange.AMPLITUDE, frequency=model_exchange.FREQUENCY,
    )  # fmt: skip


def test_the_law_in_equations_is_that_of_the_fmu_in_model_exchange(rotor, native_fmu, monkeypatch):
    """Rotor under a sine of torque, with the Coulomb torque of the map and no viscous part: rumoca against CVode."""
    start = {**model_exchange.START, "apparent_viscosity_ratio": 0.0}
    monkeypatch.setattr(model_exchange, "START", start)
    rows, events, _ = model_exchange.model_exchange(native_fmu, 1e-9)
    time, speed, angle, _ = rows.T
    slip = np.round(np.array(rotor["friction.slip"]))
    assert np.abs(np.interp(time, rotor.time, rotor["rotor.w"]) - speed).max() < 1e-6 * np.abs(speed).max()
    assert np.abs(np.interp(time, rotor.time, rotor["rotor.phi"]) - angle).max() < 1e-6 * np.abs(angle).max()
    assert np.count_nonzero(np.diff(np.abs(slip)) > 0) == sum(e.kind == "slip" for e in events) >= 3
    assert np.count_nonzero(np.diff(np.abs(slip)) < 0) == sum(e.kind == "stick" for e in events) >= 3


def test_work_against_friction_is_heat_and_energy_of_the_bristle(rotor, coulomb):
    stiffness = model_exchange.START["presliding_stiffness"]
    wound = 0.5 * coulomb**2 / stiffness
    stored = 0.5 * stiffness * rotor["friction.z"][-1] ** 2
    work, heat = rotor["work"][-1], rotor["heat"][-1]
    assert work > 100.0 * wound
    assert work == pytest.approx(heat + stored, abs=1e-4 * wound)


def test_the_axis_in_modelica_is_that_of_the_script():
    """Limit of the script for small steps against the equations; the friction is a law of both, without a map."""
    level, slope = 0.8, 0.004

    class Friction:
        z = 0.0

        def advance(self, axis, speed, load):
            step = presliding_step(self.z, speed, axis.step, level, axis.presliding_stiffness, 0.0)
            self.z = step.deflection
            return step.torque + slope * speed, step.heat / axis.step, True

    runs = []
    grid = 1e-3 * np.arange(2000)
    for step in (62.5e-6, 31.25e-6):
        axis = servo_axis.Axis(step=step)
        motion, _ = servo_axis.circle(axis, 10e-3, 0.02, 300.0)
        run = servo_axis.simulate(axis, motion, Friction())
        runs.append(np.interp(grid, motion.time, run.error))
    limit = 2.0 * runs[1] - runs[0]
    modelica = simulated("Axis", 2.0, 1e-3, level=level, slope=slope)
    error = np.interp(grid, modelica.time, modelica["error"])
    assert np.abs(limit).max() > 8e-6
    # the bristle of the equations begins to slip at 0.999 of the Coulomb torque
    assert np.abs(error - limit).max() < 1e-3 * np.abs(limit).max()
    assert np.abs(error - runs[1]).max() < np.abs(error - runs[0]).max()
    for name, values in (("friction.axialLoad", run.axial_load), ("motorTorque", run.motor_torque)):
        found, expected = np.interp(grid, modelica.time, modelica[name]), np.interp(grid, motion.time, values)
        # of the first order in the step, whose share of the least time constant, 0.4 ms, is 0.08
        assert np.abs(found - expected).max() < 0.08 * np.abs(expected).max(), name


BODIES = {  # stubs of the external functions
    "coulombTorque": "coulomb := 0.8;",
    "viscousTorque": "viscous := 0.004*w;",
    "covered": "inside := if abs(w) < 600 then 1 else 0;",
    "apparentViscosityRatio": "ratio := 1;",
    "netSlidingCoefficient": "coefficient := 1;",
    "roughnessHeight": "height := 1;",
    "breakawayFactor": "factor := 1;",
    "preslidingStiffness": "stiffness := 100;",
}


def without_externals(text):
    """The package with functions in Modelica, and a record in place of the external object."""
    record = "record FrictionMap Real x; end FrictionMap;"
    text = re.sub(r"class FrictionMap.*?end FrictionMap;", record, text, flags=re.S)
    text = re.sub(r"parameter String fileName.*?;", "parameter Real fileName = 0;", text, flags=re.S)
    for name in ("coulombTorque_der", "viscousTorque_der", "films"):  # not called by any equation
        text = re.sub(rf"pure function {name} .*?end {name};", "", text, flags=re.S)
    for name, body in BODIES.items():
        function = rf'(pure function {name} .*?)external "C".*?end {name};'
        text, found = re.subn(function, rf"\1algorithm {body} end {name};", text, flags=re.S)
        assert found == 1
    assert 'external "C"' not in text
    return text


def test_the_component_of_the_map_and_its_axis_compile_and_run():
    """ScrewFriction in Examples.Axis unchanged except for the bodies of the external functions."""
    tool = rumoca()
    compiled = tool.Session().loads(
        LIBRARY + without_externals(TEXT), model="BallScrewFriction.Examples.Axis"
    )
    assert compiled.structure().is_balanced
    run = compiled.simulate(t=(0.0, 2.0), config=tool.SimConfig(rtol=1e-9, atol=1e-11, dt=1e-3))
    plain = simulated("Axis", 2.0, 1e-3, level=0.8, slope=0.004)
    for name in ("error", "friction.tau", "friction.lossPower"):
        found, expected = (np.interp(plain.time, x.time, x[name]) for x in (run, plain))
        assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max(), name
    assert run["friction.covered"][-1] == 1.0


def test_the_screw_is_a_transmission():
    """Hertz forces of both nuts, force on the nut, and the balance of the whole axis."""
    run = simulated("TransmissionAxis", 0.4, 1e-4, level=0.6, slope=0.004)
    k = (1.388871e9 / 3.0) ** 1.5 / 2000.0**0.5
    d_0, x = (2000.0 / k) ** (2.0 / 3.0), np.array(run["transmission.x"])
    assert np.abs(x).max() > 1e-7
    for nut, way in (("A", d_0 + x), ("B", d_0 - x)):
        force = np.array(run[f"transmission.friction.force{nut}"])
        assert np.abs(force - k * way**1.5).max() <= 1e-6 * force.max()
    stored = (
        0.5 * 5e-3 * run["screw.w"][-1] ** 2
        + 150.0 * run["table.v"][-1] ** 2
        + 5.0 * run["nutBody.v"][-1] ** 2
    )
    stored += 0.5 * 1.68e8 * (run["table.s"][-1] - run["nutBody.s"][-1]) ** 2
    x_end = x[-1]
    stored += 0.4 * k * ((d_0 + x_end) ** 2.5 + (d_0 - x_end) ** 2.5 - 2.0 * d_0**2.5)
    time = np.array(run.time)
    guide = np.trapezoid(400.0 * np.array(run["table.v"]) ** 2, time)
    spring = np.trapezoid(2e4 * (np.array(run["table.v"]) - np.array(run["nutBody.v"])) ** 2, time)
    work, heat = run["work"][-1], run["heat"][-1]
    bristle = 0.5 * 150.0 * run["transmission.friction.z"][-1] ** 2
    assert work > 1.0
    assert work == pytest.approx(heat + guide + spring + stored + bristle, abs=2e-3 * work)


def test_the_transmission_of_the_map_compiles():
    tool = rumoca()
    compiled = tool.Session().loads(
        LIBRARY + without_externals(TEXT), model="BallScrewFriction.Examples.TransmissionAxis"
    )
    assert compiled.structure().is_balanced


def test_the_package_has_the_numbers_of_the_screw(package, synthetic_nut_map):
    text = (package / "package.mo").read_text()
    numbers = synthetic_nut_map.header["screw"]
    assert f"nutStiffness(min=1) = {numbers['nut_stiffness']!r}" in text
    assert f"lead(min=0) = {numbers['lead']!r}" in text
