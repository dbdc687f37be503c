"""Expected results of BallScrewTransmission: outputs of its Python twin for an input sequence."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ballscrew_fmu.variables.transmission import transmission_variables
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.standstill import Bristle
from ballscrew_tehl.runtime.transmission import TransmissionInputs, TransmissionParameters, transmission_step


def transmission_input(header: Mapping[str, Any], step: float) -> Iterator[dict[str, float]]:
    """Motion from rest, in both directions, under a load that changes its sign, partly outside the map.

    Parameters   header : of the map;  step : [s]
    """
    axes = header["axes"]
    force_hi, fastest = axes["force"][1], axes["speed"][1]
    cold, hot = axes["temperature"][:2]
    numbers = header["screw"]
    ratio = numbers["lead"] / (2.0 * math.pi)
    # way at which one nut comes free at the middle preload
    way = (
        (0.3 * force_hi * numbers["stiffness_preload"] ** 0.5) ** (2.0 / 3.0) * 3.0 / numbers["nut_stiffness"]
    )
    angle, steps = 0.0, 240
    for n in range(steps):
        phase = n / steps
        # from rest: else an importer that sets the first inputs before initialization begins with another bristle;
        # later nowhere at rest, where a power is a difference of equal numbers
        speed = 1.05 * fastest * math.sin(6.0 * math.pi * phase + 0.05) ** 3 if n > 0 else 0.0
        x, x_next = (1.3 * way * math.sin(10.0 * math.pi * at + 0.1) for at in (phase, phase + 1.0 / steps))
        yield {
            "angle": angle,
            "speed": speed,
            "position": ratio * angle - x,
            "velocity": ratio * speed - (x_next - x) / step,
            "temperature": cold + (hot - cold) * (1.1 * phase - 0.05),
            "preload": force_hi * (0.02 + 0.5 * phase),
        }
        angle += speed * step


def transmission_outputs(
    nut_map: NutMap, inputs: Iterable[Mapping[str, float]], step: float, **parameters: float
) -> list[dict[str, Any]]:
    """Outputs after each step of an input sequence, from a new instance.

    Parameters   inputs : rows by name;  step : [s]
                 parameters : by name; the others keep their start values
    """
    table = transmission_variables(nut_map.header)
    starts = {v.name: v.start for v in table if v.causality == "parameter"} | parameters
    names = [v.name for v in table if v.causality == "output"]
    law = TransmissionParameters._make(float(starts[name] or 0.0) for name in TransmissionParameters._fields)
    before, heat, results = Bristle(), 0.0, []  # at rest before the first step
    for row in inputs:
        done = transmission_step(nut_map, TransmissionInputs(**row), law, step, before, heat)
        results.append({name: done.outputs[name] for name in names})
        before, heat = done.bristle, done.outputs["heat"]
    return results
