"""Replays in importers written in Python, which use FMPy underneath: pathsim-fmi, fmugym, sofirpy, CoFMPy.

Each sets the inputs of a row, steps, and yields the outputs; sofirpy simulates all rows at once. All but sofirpy read
every output as Real.
"""

import contextlib
import logging
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from importer_rows import STEP, Row, Rows, as_row, outputs_of


def in_pathsim(fmu: Path, rows: Rows) -> Iterator[Row]:
    """CoSimulationFMU behind sources: it steps at the end of each step of pathsim, with the inputs of that instant."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Source
    from pathsim_fmi import CoSimulationFMU

    block = CoSimulationFMU(str(fmu), dt=STEP)
    sources = [
        Source(lambda t, name=name: float(rows[max(round(t / STEP) - 1, 0)][name])) for name in rows[0]
    ]
    wires = [Connection(source, block[name]) for source, name in zip(sources, rows[0], strict=True)]
    simulation = Simulation([*sources, block], wires, dt=STEP, log=False)
    names = [name for group in outputs_of(fmu) for name in group]
    ports = list(block.fmu_wrapper.output_refs)
    for _ in rows:
        simulation.timestep()
        found = dict(zip(ports, block.outputs.to_array(), strict=True))
        yield as_row(fmu, {name: found[name] for name in names})


def in_pathsim_exchange(fmu: Path, rows: Rows) -> Iterator[Row]:
    """ModelExchangeFMU as a block that is evaluated at the instant of each row, and its events handled there."""
    from pathsim_fmi import ModelExchangeFMU

    block = ModelExchangeFMU(str(fmu))
    wrapper = block.fmu_wrapper
    ports = list(wrapper.input_refs)
    for n, row in enumerate(rows):
        wrapper.set_inputs_from_array([float(row[name]) for name in ports])
        block._handle_event(n * STEP)
        state = wrapper.get_continuous_states()
        yield as_row(fmu, dict(zip(wrapper.output_refs, block._get_outputs(
            state, [float(row[name]) for name in ports], n * STEP), strict=True)))  # fmt: skip


def in_fmugym(fmu: Path, rows: Rows) -> Iterator[Row]:
    """An environment whose action is the row. Its observation is in single precision, so that it is compared by its
    values before: _get_obs is for users to replace."""
    import gymnasium
    from fmugym.fmugym import FMUGym
    from fmugym.fmugym_config import FMUGymConfig, VarSpace

    names = [name for group in outputs_of(fmu) for name in group]

    class Environment(FMUGym):
        def _get_obs(self) -> np.ndarray:
            read = self.fmu.getFloat64 if self.is_fmi3 else self.fmu.getReal
            return np.array([read([self.output_dict[name]])[0] for name in names])

        def _noisy_init(self) -> dict[int, float]:
            return {}

        def _process_action(self, action: np.ndarray) -> np.ndarray:
            return action

        def _get_terminated(self) -> tuple[bool, bool]:
            return False, False

        def compute_reward(self, *_: object) -> float:
            return 0.0

    def space(kind: str, chosen: list[str]) -> "VarSpace":
        found = VarSpace(kind)
        for name in chosen:
            found.variables[name] = gymnasium.spaces.Box(-np.inf, np.inf, (1,))
        return found

    inputs = list(rows[0])
    nothing = VarSpace("nothing")
    environment = Environment(
        FMUGymConfig(
            fmu_path=str(fmu), start_time=0.0, stop_time=STEP * (len(rows) + 1), sim_step_size=STEP,
            action_step_size=STEP, inputs=space("inputs", inputs), input_noise=nothing, outputs=space("outputs", names),
            output_noise=nothing, random_vars=nothing, set_point_nominal_start=nothing, set_point_map=nothing,
            set_point_stop=nothing, terminations=nothing,
        )
    )  # fmt: skip
    order = list(environment.input_dict)  # of the model description
    try:
        for row in rows:
            values, *_ = environment.step(np.array([float(row[name]) for name in order]))
            yield as_row(fmu, dict(zip(names, values, strict=True)))
    finally:
        environment.close()


def in_sofirpy(fmu: Path, rows: Rows) -> list[Row]:
    """simulate() with a Python model that gives the next row after each step; the first row are start values."""
    from sofirpy import SimulationEntity, simulate

    class Signals(SimulationEntity):
        def __init__(self) -> None:
            self.row = rows[0]

        def set_parameter(self, name: str, value: float) -> None:
            raise NotImplementedError(name)

        def get_parameter_value(self, name: str) -> float:
            return float(self.row[name])

        def do_step(self, time: float) -> None:
            self.row = rows[min(round(time / STEP) + 1, len(rows) - 1)]

    names = [name for group in outputs_of(fmu) for name in group]
    wires = [
        {"parameter_name": name, "connect_to_system": "signals", "connect_to_external_parameter": name}
        for name in rows[0]
    ]
    with open(os.devnull, "w") as silent, contextlib.redirect_stderr(silent):  # its progress bar and log
        found = simulate(
            stop_time=STEP * len(rows), step_size=STEP, fmu_paths={"friction": str(fmu)},
            model_classes={"signals": Signals}, connections_config={"friction": wires},
            start_values={"friction": {name: float(value) for name, value in rows[0].items()}},
            parameters_to_log={"friction": names},
        )  # fmt: skip
        logging.getLogger().handlers.clear()
    lines = found.to_dict("records")[1:]
    return [as_row(fmu, {name: line[f"friction.{name}"] for name in names}) for line in lines]


def in_cofmpy(fmu: Path, rows: Rows) -> Iterator[Row]:
    """The handler that its master has for each FMU. The master itself fails with FMPy newer than 0.3.20, which it
    pins: it takes the step size of the model description for a number."""
    from cofmupy.wrappers import FmuHandlerFactory

    handler = FmuHandlerFactory(str(fmu))()
    handler.reset()
    for n, row in enumerate(rows):
        found = handler.step(n * STEP, STEP, {name: [float(value)] for name, value in row.items()})
        yield as_row(fmu, {name: values[0] for name, values in found.items()})
