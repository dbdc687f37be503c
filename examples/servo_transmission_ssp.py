#!/usr/bin/env python3
"""The servo axis with its screw as a transmission as an SSP archive, run by fmpy, compared with the scripted loop.

    python examples/servo_transmission_ssp.py [--fmu dist/BallScrewTransmission_fmi2.fmu]
                                              [--output dist/servo_transmission.ssp]

The archive (SSP 1.0) contains the native transmission FMU, the axis as a second FMU (pythonfmu, from the equations of
servo_axis_transmission.py), six connections with units, and a parameter file for each. It is checked against the
schemas of the standard and against the FMUs before it is run.

Coupling. fmpy steps both FMUs with the values of the last communication point. The contacts then need damping:
0.65 a < b < 0.8 with a = h^2 k/m, b = h c/m (stiffness and damping of the nut, mass of the screw); 25 us steps and
contact_damping_time = 25 us, the upper end of what is known of rolling contacts, give a = b = 0.09. The script with the
same parameter steps the screw first.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import servo_transmission_slave
from fmpy.ssp.simulation import simulate_ssp
from fmu_command import Parser, no_fmu
from servo_axis import circle
from servo_axis_fmu import build_axis_fmu
from servo_axis_transmission import FMU, simulate_transmission
from servo_drive import TransmissionAxis
from ssp_archive import Component, Connection, bound_parameters, findings, write_archive

SSP = Path(__file__).resolve().parents[1] / "dist" / "servo_transmission.ssp"
RADIUS, FEED, CUTTING_FORCE = 10e-3, 0.02, 300.0  # [m], [m/s], [N]
CONTACT_DAMPING_TIME = 25e-6  # [s]
PARAMETER_SET = "circle"
CONNECTIONS = (
    Connection(("axis", "angle"), ("screw", "angle")),
    Connection(("axis", "speed"), ("screw", "speed")),
    Connection(("axis", "nut_position"), ("screw", "position")),
    Connection(("axis", "nut_velocity"), ("screw", "velocity")),
    Connection(("screw", "screw_torque"), ("axis", "screw_torque")),
    Connection(("screw", "nut_force"), ("axis", "nut_force")),
)
SHOWN = {
    "axis": ("error", "position", "motor_torque"),
    "screw": ("friction_torque", "axial_deflection", "power_loss", "in_range"),
}


def write_ssp(
    path: Path | str, fmu: Path | str, axis: TransmissionAxis, stop_time: float, feed: float = FEED
) -> Path:
    """The archive; feed: along the circle [m/s].

    Raises       ValueError: not the right FMU, or the archive has findings;  OSError: cannot be written
    """
    screw = {
        "preload": axis.preload,
        "temperature": axis.oil_temperature,
        "contact_damping_time": CONTACT_DAMPING_TIME,
    }
    way = {"radius": RADIUS, "feed": feed, "cutting_force": CUTTING_FORCE}
    with tempfile.TemporaryDirectory(prefix="servo_transmission_") as scratch:
        axis_fmu = build_axis_fmu(
            Path(scratch) / "ServoAxis.fmu", axis, **way, module=servo_transmission_slave
        )
        components = [
            Component(name, Path(file), values, SHOWN[name])
            for name, file, values in (("screw", fmu, screw), ("axis", axis_fmu, way))
        ]
        write_archive(path, "servo_transmission", components, CONNECTIONS, stop_time, PARAMETER_SET)
    wrong = findings(path)
    if wrong:
        raise ValueError(f"{path}: {'; '.join(wrong)}")
    return Path(path)


def main(
    fmu: Path | str = FMU, ssp: Path | str = SSP, feed: float = FEED, after: float = 0.05
) -> dict[str, Any]:
    """Write the archive, run it in fmpy to a time [s] after the reversal, and the script.

    Parameters   feed : along the circle [m/s]

    Returns      largest following error of both and their largest difference, by name with unit
    Raises       ValueError, OSError: as write_ssp
    """
    axis = TransmissionAxis()
    motion, reversal = circle(axis, RADIUS, feed, CUTTING_FORCE, after)
    step, steps = axis.exchange_step, axis.exchanges * motion.time.size
    Path(ssp).parent.mkdir(parents=True, exist_ok=True)
    write_ssp(ssp, fmu, axis, steps * step, feed)
    # half a step less, so that rounding does not add one
    found = simulate_ssp(
        str(ssp), stop_time=(steps - 0.5) * step, step_size=step, parameter_set=bound_parameters(Path(ssp))
    )
    run = simulate_transmission(axis, motion, fmu, contact_damping_time=CONTACT_DAMPING_TIME)
    # rows of the script are the starts of controller cycles, those of the archive the ends of steps
    error = found["axis.error"][axis.exchanges - 1 :: axis.exchanges]
    count = min(error.size, run.error.size - 1)
    difference = np.abs(error[:count] - run.error[1 : count + 1])
    return {
        "ssp": Path(ssp),
        "reversal_s": reversal,
        "error_max_um_script": 1e6 * float(np.abs(run.error).max()),
        "error_max_um_fmpy": 1e6 * float(np.abs(error).max()),
        "difference_max_nm": 1e9 * float(difference.max()),
        "in_range": bool(found["screw.in_range"].all() and run.in_range),
    }


def command_line(arguments: list[str] | None = None) -> int:
    parser = Parser(__file__, __doc__)
    parser.add_argument("--fmu", type=Path, default=FMU, help="the transmission; default: %(default)s")
    parser.add_argument("--output", type=Path, default=SSP, help="the archive to write; default: %(default)s")
    options = parser.parse_args(arguments)
    if problem := no_fmu(options.fmu):
        return parser.complain(problem)
    try:
        result = main(options.fmu, options.output)
    except (OSError, ValueError) as error:
        return parser.complain(str(error))
    for name, value in result.items():
        print(f"{name:24} {value:.4g}" if isinstance(value, float) else f"{name:24} {value}")
    return 0


if __name__ == "__main__":
    sys.exit(command_line())
