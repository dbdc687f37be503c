"""The examples, each run once in a small form: its laws, its picture, its command line.

The FMU is that of the closed-form map; expected numbers follow from the map and the parameters of the example.
"""

import importlib
import importlib.util
import re

import numpy as np
import pytest
from processes import RUNS_HERE
from scipy.integrate import solve_ivp
from synthetic_map import SCREW

from ballscrew_fmu.models import AXIS, MODELS, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_tehl.runtime.constants import ELEMENTS

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not RUNS_HERE, reason="an FMU for x86_64 Linux")]
RATIOS = (0.0, 0.05, 0.5, 1.0, 2.0)


@pytest.fixture(scope="session")
def results(native_fmu, synthetic_nut_map, tmp_path_factory):
    folder = tmp_path_factory.mktemp("examples")
    done = {}

    def native(model):
        path = folder / f"{model.name}_fmi2.fmu"
        return build_native_fmu(synthetic_nut_map, 2, path, platforms=("x86_64-linux",), model=model).path

    given = {
        "circular_test": lambda: ((native_fmu,), {"feeds": (0.02,)}),
        "bearing_friction": lambda: (((1000.0, 5000.0), (50.0, 5000.0)), {}),
        "kinematics_comparison": lambda: (((200.0, 2000.0),), {}), "preload_loss": lambda: ((), {}),
        "preload_monitoring": lambda: ((synthetic_nut_map,), {"lives": 4}),
        "servo_axis_element": lambda: ((native(AXIS),), {"stop": 0.1}),
        "servo_axis_ssp": lambda: ((native_fmu, folder / "servo_axis.ssp"), {}),
        "servo_axis_transmission": lambda: ((native(TRANSMISSION), native_fmu), {}),
        "servo_log": lambda: ((folder,), {}), "support_bearings": lambda: ((), {}),
        "thermal_reduction": lambda: (((1000.0,), RATIOS), {}), "torque_over_speed": lambda: ((), {}),
        "warm_up": lambda: ((native(AXIS),), {"hours": 0.1}),
    }  # fmt: skip

    def result(name):
        if name not in done:
            words, options = given.get(name, lambda: ((native_fmu,), {}))()
            done[name] = importlib.import_module(name).main(*words, **options)
        return done[name]

    return result


WITH_FMU = ("circular_test", "model_exchange", "preload_monitoring", "servo_axis", "servo_axis_element",
            "servo_axis_ssp", "servo_axis_transmission", "step_size_study",
            "warm_up")  # fmt: skip


WITHOUT = ("bearing_friction", "kinematics_comparison", "preload_loss", "servo_log", "support_bearings",
           "thermal_reduction", "torque_over_speed")  # fmt: skip


@pytest.mark.parametrize("name", WITH_FMU + WITHOUT)
def test_picture_and_command_line(name, results, native_fmu, tmp_path, monkeypatch, capsys):
    module, result, picture = importlib.import_module(name), results(name), tmp_path / "a.png"
    if name not in WITH_FMU:
        module.plot(result, picture)
        assert picture.read_bytes().startswith(b"\x89PNG")
        return
    monkeypatch.setattr(module, "main", lambda *arguments, **options: result)
    options = [] if name == "preload_monitoring" else ["--fmu", str(native_fmu)]
    options += ["--output", str(result["ssp"])] if name == "servo_axis_ssp" else []
    options += ["--friction", str(native_fmu)] if name == "servo_axis_transmission" else []
    if hasattr(module, "plot"):
        assert module.command_line([*options, "--plot", str(picture)]) == 0
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert capsys.readouterr().out.splitlines()[-1] == str(picture)
    assert module.command_line(["--fmu", "none.fmu"]) == 2
    err = capsys.readouterr().err
    assert (err.count("\n"), "none.fmu" in err) == (1, True)


def test_servo_axis(results, synthetic_nut_map):
    found = results("servo_axis")
    axis = found["axis"]
    assert (axis.lead, axis.preload) == (SCREW["lead"], SCREW["stiffness_preload"])
    for name in ("move_with", "circle_with"):
        run = found["runs"][name]
        sliding = np.flatnonzero(np.abs(run.speed) > 1.2)  # 12 regularisation speeds: the sign is 1
        place = run.speed[sliding], axis.oil_temperature, run.axial_load[sliding]
        state = synthetic_nut_map.evaluate(axis.preload, *place)
        expected = np.sign(run.speed[sliding]) * (state.viscous_torque + state.coulomb_torque)
        assert sliding.size > 0.7 * run.speed.size
        assert run.friction_torque[sliding] == pytest.approx(expected, rel=1e-9)
    for name in ("move_with", "circle_with", "circle_presliding"):
        run = found["runs"][name]
        heat = float(np.sum(run.heat_flow) * axis.step)
        assert np.all(run.heat_flow >= 0.0)
        assert heat == pytest.approx(float(np.sum(run.friction_torque[:-1] * np.diff(run.angle))), rel=2e-4)


def test_circular_test(results):
    found = results("circular_test")
    assert np.abs(found["peak_um_without"]).max() < 0.05
    assert np.min([found[f"peak_um_{case}"] for case in ("with", "presliding")]) > 4.0


def test_model_exchange(results, synthetic_nut_map):
    """From rest element i slides after the travel x_m (i + 1/2)/ELEMENTS, past a reversal after twice that; while all
    slide, the torque is that of the map. Co-simulation converges to it in first order."""
    found = results("model_exchange")
    slips = [("slip", (i,)) for i in range(ELEMENTS)]
    stick = [("stick", tuple(range(ELEMENTS)))]
    events = found["events"]
    assert [(event.kind, event.elements) for event in events] == slips + 3 * (stick + slips)
    travel = 2.0 * synthetic_nut_map.evaluate(2000.0, 0.0, 303.15).coulomb_torque / 100.0
    yields = travel * (np.arange(ELEMENTS) + 0.5) / ELEMENTS
    angles = np.array([0.0, *(event.angle for event in events)]).reshape(4, ELEMENTS + 1)
    expected = np.outer([1.0, 2.0, 2.0, 2.0], yields)
    assert np.abs(angles[:, 1:] - angles[:, :1]) == pytest.approx(expected, rel=1e-3)
    time, speed, _, torque = found["exchange"].T
    for slid, stuck in zip(
        events[ELEMENTS - 1 :: ELEMENTS + 1], events[ELEMENTS :: ELEMENTS + 1], strict=False
    ):
        inside = (time > slid.time) & (time < stuck.time)
        expected = synthetic_nut_map.evaluate(2000.0, speed[inside], 303.15).friction_torque
        assert np.abs(torque[inside]) == pytest.approx(expected, rel=1e-9)
    assert found["errors"][-1] < 0.05 * found["errors"][0]
    assert 0.95 < found["order"] < 1.05


def test_preload_monitoring(results, synthetic_nut_map, tmp_path, monkeypatch):
    monitoring, found = importlib.import_module("preload_monitoring"), results("preload_monitoring")
    # 600 intervals: 95 % +- 0.9 % (one standard deviation)
    assert 0.93 <= found["coverage"] <= 0.97
    assert (found["detected"], found["false_alarms"]) == (1.0, 0)  # expected: 204/19000
    fmu = build_native_fmu(
        synthetic_nut_map, 2, tmp_path / "monitor.fmu", platforms=("x86_64-linux",), model=MONITOR
    ).path
    compared = monitoring.compared_with_fmu(fmu, synthetic_nut_map)
    assert compared["in_range"] == 1.0
    assert compared["difference_percent"] < 0.2
    monkeypatch.setattr(monitoring, "NOISE", 0.0)
    assert monitoring.compared_with_fmu(fmu, synthetic_nut_map)["deviation_percent"] < 1e-7


def test_preload_loss(results):
    found = results("preload_loss")
    for name, lost in (("upper", 1.0 - 0.2482 / 0.3985), ("lower", 1.0 - 0.3785 / 0.5156)):
        screw = found[name]
        assert screw["preload"][0] == pytest.approx(1500.0, rel=1e-4)
        orders = [np.argsort(screw[name], kind="stable") for name in ("torque", "preload")]
        assert np.array_equal(*orders)
        for low, high in (("low", "high"), ("law_low", "law_high")):
            assert np.all((screw[low] < screw["preload"]) & (screw["preload"] < screw[high]))
        first = int(np.flatnonzero(found["hours"] == screw["alarm"])[0])
        assert screw["high"][first] < 1350.0 <= np.min(screw["high"][:first])
        # the torque is nearly proportional to the preload, with these screws and others
        ends = np.array([screw["preload"][-1], *screw["others"]])
        assert 1.0 - ends / 1500.0 == pytest.approx(lost, abs=0.045)
    assert (found["upper"]["alarm"], found["lower"]["alarm"]) == (315.0, 560.0)


def test_servo_axis_ssp(results):
    """Masters agree with the script to the rounding of their clocks."""
    archive, example = importlib.import_module("ssp_archive"), importlib.import_module("servo_axis_ssp")
    found = results("servo_axis_ssp")
    assert archive.findings(found["ssp"]) == []
    for master in set(example.MASTERS) - set(found["missing"]):
        for field, name in example.OBSERVED.items():
            expected = getattr(found["parallel"], field)
            gap = np.abs(found["series"][master][name][:-1] - expected[1:]).max()
            assert gap <= 1e-8 * np.abs(expected).max(), (master, name)


def test_servo_axis_element(results):
    found = results("servo_axis_element")
    assert np.abs(found["error"]).max() <= 5e-4
    assert 0.0 < found["heat_J"] <= found["supplied_J"]


def test_servo_axis_transmission(results):
    found = results("servo_axis_transmission")
    screw, axis = found["runs"]["transmission"].screw, found["axis"]
    assert found["in_range"]
    for name in ("circle_error_max_um", "circle_spike_um", "circle_friction_torque_peak_Nm"):
        assert found[f"{name}_transmission"] == pytest.approx(found[f"{name}_spring"], rel=0.1)
    force, deflection = screw["nut_force"][1:], screw["axial_deflection"][1:]
    steady = (np.abs(np.diff(screw["nut_force"])) <= 0.5) & (np.abs(force) > 100.0)
    # of the map, at 2 kN
    assert np.median(force[steady] / deflection[steady]) == pytest.approx(1.35e9, rel=0.01)
    powers = "shaft_power", "nut_power", "power_loss"
    shaft, nut, loss = (axis.exchange_step * screw[name].sum() for name in powers)
    throughput = axis.exchange_step * np.abs(screw["shaft_power"]).sum()
    assert loss > 1.0
    assert abs(shaft - nut - loss - screw["stored_energy"][-1]) <= 1e-3 * throughput


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.layer)
def test_modelica_interface(model, synthetic_nut_map):
    """Each variable in one line with a text, numbers as in the table; a Modelica compiler reads it if there is one."""
    text = importlib.import_module("modelica_interface").main(synthetic_nut_map, model)
    table = [v for v in model.variables(synthetic_nut_map.header) if v.causality != "local"]
    found = re.findall(r"^  (input|output|parameter) (Real|Boolean) (\w+)(.*)$", text, re.M)
    assert [(v.causality, v.name, v.unit is None) for v in table] == [
        (a, c, b == "Boolean") for a, b, c, _ in found
    ]
    for v, (*_, rest) in zip(table, found, strict=True):
        numbers = dict(re.findall(r"(min|max|nominal|start) = ([^,)]+)", rest))
        assert {name: float(value) for name, value in numbers.items()} == {
            name: value for name, value in (
                ("min", v.minimum), ("max", v.maximum), ("nominal", v.nominal if v.unit else None),
                ("start", v.start if v.causality == "input" else None),
            ) if value is not None
        }, v.name  # fmt: skip
    if importlib.util.find_spec("rumoca"):
        assert importlib.import_module("rumoca").validate_source(text) == []


def test_step_size_study(results):
    study, found = importlib.import_module("step_size_study"), results("step_size_study")
    assert len(found["orders"]) == 4
    assert all(0.9 < order < 1.2 for order in found["orders"].values())
    assert found["limits"]["parallel"] == pytest.approx([0.16, 0.25, 0.16])
    assert found["limits"]["sequential"] == pytest.approx([3.6, 3.0, 2.4])
    for master in study.MASTERS:
        assert found["borders"][master] == pytest.approx(found["limits"][master], rel=0.03)


def test_warm_up(results):
    """No heat is lost or counted twice between nodes; temperatures by another integrator; constant torques."""
    found = results("warm_up")
    network, powers, rows = found["network"], found["powers"], found["temperatures"]
    rates, gain = network.matrices()
    capacity = np.array(
        [network.seat_capacity, *[network.segment_capacity] * network.segments, network.nut_capacity]
    )
    air = [network.seat_to_air, *[network.segment_to_air] * network.segments, network.nut_to_air]
    assert capacity @ rates == pytest.approx(-np.array(air), rel=1e-12)
    assert capacity @ gain == pytest.approx([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], abs=1e-12)
    for power, before, after in zip(powers, rows, rows[1:], strict=False):
        run = solve_ivp(
            lambda _, over, power=power: rates @ over + gain @ power, (0.0, network.hold), before - network.ambient,
            rtol=1e-10, atol=1e-10,
        )  # fmt: skip
        assert run.y[:, -1] == pytest.approx(after - network.ambient, abs=1e-6)
    torques = {"wipers": 0.20, "bearings": 0.60, "motor": 0.15}
    for place, torque in torques.items():
        assert found[f"power_{place}_W"] == pytest.approx(0.5 * torque * network.speed, rel=0.05)
    assert found["bearings_x_0.5_um"] < 0.0 < found["bearings_x_2_um"]
    assert found["convection_x_2_um"] < 0.0 < found["convection_x_0.5_um"]


def test_contacts_of_the_examples(results):
    found = results("kinematics_comparison")
    film, heat = found["film"][:2], found["heat"][:2]
    assert np.all(np.diff(film, axis=-1) > 0.0)
    # rolling: equal entrainment, the nut side conforms better; published: the nut is slower
    assert np.all((film[1, 1] > film[1, 0]) & (film[0, 1] < 0.5 * film[0, 0]) & (np.abs(heat[1]) < 1e-12))
    found = results("thermal_reduction")
    film = found["film"][0]
    assert 0.97 < film[0] < 1.0
    deviation = found["formula"][0] / film - 1.0
    assert np.all((deviation[:-1] > -0.12) & (deviation[:-1] < 0.02))
    assert 0.30 < deviation[-1] < 0.40
    found, example = results("torque_over_speed"), importlib.import_module("torque_over_speed")
    for preload, rpm, measured in found["measured"]:
        if preload in example.PRELOADS:
            row = found["torque"][example.PRELOADS.index(preload)]
            # the largest deviation of a fitted point is 4 %
            assert abs(np.interp(rpm, found["rpm"], row) / measured - 1.0) < 0.05


def test_printed_torques_lie_in_the_interval_of_a_nominal_preload():
    """At least 70 % of each maker; 14 double nuts of Rexroth have the trend of the law, and a level of their own."""
    found = importlib.import_module("printed_torques").main()
    for maker, count in (("Rexroth", 22), ("JIS", 20), ("THK", 13)):
        group = [each for name, each in found.items() if name.startswith(maker)]
        assert sum(each.count for each in group) == count
        assert sum(each.inside for each in group) >= 0.7 * count
    for name in ("GD4008-3, measured", "XJTU, measured"):
        assert found[name].inside == found[name].count
    assert max(each.width for each in found.values()) <= 4.0
    double = found["Rexroth, double nut"]
    assert (double.level, double.scatter) == pytest.approx((0.37, 1.05), abs=0.03)
    assert max(abs(double.of_diameter), abs(double.of_lead)) <= 0.2


def test_intervals_of_the_screws_are_those_of_the_documents():
    ratio, least, largest = np.array(list(importlib.import_module("interval_of_screws").main().values())).T
    assert [least.min(), largest.max()] == pytest.approx([2.2, 4.8], abs=0.05)
    assert [ratio.min(), ratio.max()] == pytest.approx([1.1, 3.0], abs=0.05)


def test_printed_torques_of_support_bearings(results):
    """Levels by maker; 80 % are inside, with the least factor; stiffness and C_a of printed balls are those printed."""
    found, example = results("support_bearings"), importlib.import_module("support_bearings")
    levels = {
        maker: example.level(row.law[0] / row.printed for row in rows)[0] for maker, rows in found.items()
    }
    expected = {"NSK": 1.03, "SNFA": 1.39, "NACHI": 1.44, "IBC": 1.95, "INA": 0.83}
    assert levels == pytest.approx(expected, rel=0.02)
    rows = [row for rows in found.values() for row in rows]
    assert sum(row.inside for row in rows) >= 0.8 * len(rows) > 41.0
    assert example.CATALOGUE - 0.05 < example.least_factor(rows) <= example.CATALOGUE
    for row in found["SNFA"]:
        assert (row.stiffness, row.rating) == pytest.approx((1.0, 1.0), abs=0.05)
