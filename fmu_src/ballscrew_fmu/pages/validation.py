"""Validation in the documentation of an FMU: tables of measured torques, plot of the torque."""

import io
from typing import Any

import numpy as np

from ballscrew_fmu.pages.page import Validation
from ballscrew_tehl.calibration.measured_screw import (
    ASSUMED_TEMPERATURE,
    is_measured,
    packaged_measurements,
    validation_tables,
)
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.report.tables import validation_table
from ballscrew_tehl.runtime.evaluate import NutMap

PLOT = "torque_over_speed.png"


def validation_report(parameters: Any, nut_map: NutMap) -> Validation:
    """Tables 2, 3 and 4 for the packaged screw, the only one with measured torques, and a plot for every screw."""
    measured = is_measured(parameters.screw, nut_map.header["axes"])
    tables = "<p>No measurement of this screw in the range of its map is packaged.</p>"
    if measured:

        def torque(preload: float, speed: float, temperature: float) -> float:
            return float(_torque(nut_map, preload, speed, temperature))

        bounds = tuple(nut_map.header["axes"]["force"][:2])
        found = validation_tables(torque, preload_range=bounds)
        tables = "\n".join(validation_table(table) for table in found)
        tables += "\n<p>Measured, Zhao, Zhou, NSK: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231.</p>"
    return Validation(tables, {PLOT: _plot(nut_map, measured)})


def _torque(nut_map: NutMap, preload: float, speed: Any, temperature: float) -> Any:
    state = nut_map.evaluate(preload, speed, temperature)
    return state.friction_torque


def _plot(nut_map: NutMap, measured: bool) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    axes_of_map = nut_map.header["axes"]
    highest, fastest = axes_of_map["force"][1], axes_of_map["speed"][1] / RPM
    points = packaged_measurements(ASSUMED_TEMPERATURE) if measured else ()
    preloads = sorted({m.preload for m in points}) or [share * highest for share in (0.05, 0.1, 0.2, 0.4)]
    rpm = np.geomspace(max(10.0, 1e-3 * fastest), fastest, 160)
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = figure.add_subplot(xlabel="screw speed [r/min]", ylabel="friction torque [N m]", xscale="log")
    for preload in preloads:
        (line,) = axes.plot(
            rpm, _torque(nut_map, preload, RPM * rpm, ASSUMED_TEMPERATURE), label=f"{preload / 1000:g} kN"
        )
        mine = [m for m in points if m.preload == preload]
        axes.plot(
            [m.speed / RPM for m in mine], [m.torque for m in mine], "o", color=line.get_color(), markersize=5
        )
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    circles = "; circles: measured" if measured else ""
    axes.set_title(f"Oil at {ASSUMED_TEMPERATURE - CELSIUS:.0f} C{circles}")
    axes.legend(title="preload", loc="upper left")
    stream = io.BytesIO()
    FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})
    return stream.getvalue()
