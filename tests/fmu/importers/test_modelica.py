"""The Modelica package: external functions called from C against the FMU and Python; law and axes run by rumoca.

rumoca has no external functions, and no standard library is installed: stubs replace the map and the library.
"""

import math
import re

import model_exchange
import modelica_package
import numpy as np
import pytest
from modelica_host import host
from paths import FMU_SUPPORT
from processes import RUNS_HERE
from synthetic_map import LAWS, make_map

from ballscrew_tehl.runtime.constants import ELEMENTS, LEVEL_MARGIN

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not RUNS_HERE, reason="a library for x86_64 Linux")]
TEXT = (modelica_package.SOURCE / "package.mo").read_text().replace("within ;", "", 1)
LIBRARY = (FMU_SUPPORT / "modelica" / "standard_library.mo").read_text().replace("within ;", "", 1)
DEFAULTS = ("apparentViscosityRatio", "netSlidingCoefficient", "roughnessHeight", "breakawayFactor")


@pytest.mark.parametrize("law", LAWS)
def test_functions_are_those_of_the_map_and_rates_their_differences(tmp_path, law):
    """Random points in and beyond the map, in both directions; parameters of the map and others. The C compiler
    compares the declarations with the header."""
    nut_map = make_map(law=law)
    package = modelica_package.assemble(nut_map, tmp_path / "package", ("x86_64-linux",))
    call, map_file = host(tmp_path, package), package / "Resources" / "Data" / "nut_map.bin"
    (screw,) = call("constructor", str(map_file).encode())
    defaults = tuple(nut_map.defaults)
    assert [call(name, screw) for name in DEFAULTS] == [(value,) for value in defaults]
    text, numbers = (package / "package.mo").read_text(), nut_map.header["screw"]
    assert f"nutStiffness(min=1) = {numbers['nut_stiffness']!r}" in text
    assert f"lead(min=0) = {numbers['lead']!r}" in text
    rng = np.random.default_rng(7)
    seen = set()
    for n in range(40):
        at = np.array([
            rng.uniform(100.0, 12000.0), rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-1.0, 2.55),
            rng.uniform(281.0, 356.0), rng.uniform(-4000.0, 4000.0) * (n % 3 > 0),
        ])  # fmt: skip
        others = defaults if n % 2 else (2.0 * defaults[0], 0.009, 90e-9, 3.0)
        ratio, coefficient, roughness, breakaway = others
        viscous_of, coulomb_of = (ratio, roughness), (coefficient, breakaway)
        along = np.array([300.0, 0.02 * at[1], 2.0, 80.0 * (at[3] != 0.0)])  # a kink without axial load
        ends = [at + h * along for h in (-1e-4, 1e-4)]
        (covered,), films = call("covered", screw, *at), call("films", screw, *at)
        (stiffness,) = call("preslidingStiffness", screw, at[0], *coulomb_of)
        viscous, low, high = (call("viscousTorque", screw, *x, *viscous_of)[0] for x in (at, *ends))
        coulomb, below, above = (call("coulombTorque", screw, *x, *coulomb_of)[0] for x in (at, *ends))
        (viscous_rate,) = call("viscousTorque_der", screw, *at, *viscous_of, *along)
        (coulomb_rate,) = call("coulombTorque_der", screw, *at, *coulomb_of, *along)
        state = nut_map.evaluate(*at, *others)
        assert viscous == pytest.approx(math.copysign(state.viscous_torque, at[1]), rel=1e-12, abs=0.0)
        assert coulomb == pytest.approx(state.coulomb_torque, rel=1e-12, abs=0.0)
        assert bool(covered) is bool(state.in_range)
        expected = (state.film_thickness_min, state.film_temperature_rise, state.contact_pressure_max)
        assert films == pytest.approx(expected, rel=1e-12, abs=0.0)
        assert stiffness == pytest.approx(nut_map.presliding_stiffness(at[0], 0.0, *coulomb_of), rel=1e-12)
        if covered:
            assert viscous_rate == pytest.approx((high - low) / 2e-4, rel=1e-5, abs=1e-7 * abs(viscous))
            assert coulomb_rate == pytest.approx((above - below) / 2e-4, rel=1e-5, abs=1e-7 * coulomb)
        seen.add(bool(covered))
    assert seen == {True, False}
    (tmp_path / "short.bin").write_bytes(map_file.read_bytes()[:-8])
    point = (2000.0, 0.0, 303.0, 0.0)
    for name, given, message in (
        ("constructor", (str(tmp_path / "missing.bin").encode(),), "missing.bin"),
        ("constructor", (str(tmp_path / "short.bin").encode(),), "short.bin"),
        ("covered", (screw, 2000.0, math.nan, 303.0, 0.0), "speed = nan; needs a finite number"),
        ("coulombTorque", (screw, *point, -0.1, 1.0), "net_sliding_coefficient = -0.1; needs"),
    ):
        with pytest.raises(RuntimeError, match=f"BallScrewFriction: .*{re.escape(message)}"):
            call(name, *given)
    call("destructor", screw)


@pytest.fixture
def rumoca():
    return pytest.importorskip("rumoca", reason="python -m pip install -e '.[modelica]'")


CHECK = """
package Check
  model Plain
    extends BallScrewFriction.Interfaces.PartialScrewFriction;
    parameter Real level = {level!r};
    parameter Real slope = {slope!r};
    parameter Real swing = {swing!r};
  equation
    coulomb = level*(1 + swing*sin(50*time));
    viscous = slope*w;
  end Plain;

  model Rotor
    Plain friction(preslidingStiffness={stiffness!r});
    Modelica.Mechanics.Rotational.Components.Inertia rotor(
      J={inertia!r}, phi(start=0, fixed=true), w(start=0, fixed=true));
    Modelica.Mechanics.Rotational.Sources.Torque motor;
    Modelica.Thermal.HeatTransfer.Sources.FixedTemperature oil(T=303.15);
    Real heat(start=0, fixed=true), work(start=0, fixed=true), stored, lost;
  equation
    stored = sum(friction.element.y.^2)/2;
    lost = sum(friction.element.eventHeat);
    motor.tau = {amplitude!r}*sin(2*Modelica.Constants.pi*{frequency!r}*time);
    friction.preload = 2000;
    friction.axialLoad = 0;
    der(heat) = oil.port.Q_flow;
    der(work) = friction.tau*friction.w;
    connect(motor.flange, rotor.flange_a);
    connect(rotor.flange_b, friction.flange_a);
    connect(friction.heatPort, oil.port);
  end Rotor;
end Check;
"""


def simulated(rumoca, model, stop, interval, **values):
    values = {"slope": 0.0, "swing": 0.0, **values}
    compiled = rumoca.Session().loads(LIBRARY + TEXT + CHECK.format(**values), model=f"Check.{model}")
    return compiled.simulate(t=(0.0, stop), config=rumoca.SimConfig(rtol=1e-9, atol=1e-11, dt=interval))


def test_the_law_in_equations_is_that_of_the_fmu_in_model_exchange(
    rumoca, native_fmu, monkeypatch, synthetic_nut_map
):
    """Rotor under a sine of torque, with the Coulomb torque of the map and no viscous part: rumoca against CVode."""
    start = {**model_exchange.START, "apparent_viscosity_ratio": 0.0}
    monkeypatch.setattr(model_exchange, "START", start)
    coulomb = float(synthetic_nut_map.evaluate(2000.0, 0.0, 303.15).coulomb_torque)
    stiffness = start["presliding_stiffness"]
    rotor = simulated(
        rumoca, "Rotor", model_exchange.TIME, model_exchange.INTERVAL, level=coulomb, stiffness=stiffness,
        inertia=model_exchange.INERTIA, amplitude=model_exchange.AMPLITUDE, frequency=model_exchange.FREQUENCY,
    )  # fmt: skip
    rows, events, _ = model_exchange.model_exchange(native_fmu, 1e-9)
    time, speed, angle, _ = rows.T
    assert np.abs(np.interp(time, rotor.time, rotor["rotor.w"]) - speed).max() < 1e-6 * np.abs(speed).max()
    assert np.abs(np.interp(time, rotor.time, rotor["rotor.phi"]) - angle).max() < 1e-6 * np.abs(angle).max()
    for i in range(ELEMENTS):
        slip = np.diff(np.abs(np.round(rotor[f"friction.element[{i + 1}].slip"])))
        kinds = [e.kind for e in events if i in e.elements]
        assert (np.count_nonzero(slip > 0), np.count_nonzero(slip < 0)) == (4, 3)
        assert (kinds.count("slip"), kinds.count("stick")) == (4, 3)
    assert rotor["lost"][-1] <= 1e-12 * rotor["work"][-1]


BODIES = {  # stubs of the external functions
    "coulombTorque": "coulomb := 0.8;", "viscousTorque": "viscous := 0.004*w;", "covered": "inside := 1;",
    "apparentViscosityRatio": "ratio := 1;", "netSlidingCoefficient": "coefficient := 1;",
    "roughnessHeight": "height := 1;", "breakawayFactor": "factor := 1;", "preslidingStiffness": "stiffness := 100;",
}  # fmt: skip


def without_externals(text):
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


def test_the_package_has_no_error_and_its_axes_compile_with_the_map(rumoca):
    assert f"constant Integer n = {ELEMENTS} " in TEXT
    assert f"constant Real levelMargin = {LEVEL_MARGIN} " in TEXT
    found = rumoca.validate_source(LIBRARY + TEXT)
    # the rule reports constructors and destructors of external objects, which are impure by definition
    assert {(d.level, d.rule) for d in found} <= {("warning", "external-purity-undeclared")}
    wrong = TEXT.replace("SI.Energy eventHeat(", "SI.Enery eventHeat(")
    assert len(rumoca.validate_source(LIBRARY + wrong)) > 0
    source = LIBRARY + without_externals(TEXT)
    for name in ("Axis", "TransmissionAxis"):
        compiled = rumoca.Session().loads(source, model=f"BallScrewFriction.Examples.{name}")
        assert compiled.structure().is_balanced
