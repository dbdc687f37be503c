"""The servo axis of servo_axis.py without its friction: mechanics, motor, controller, step by step.

Imports numpy and scipy only, because an FMU contains it (servo_axis_ssp.py).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm


@dataclass(frozen=True)
class Axis:
    """Mechanics, motor, controller and friction inputs; usual values of a machine of this size. SI units."""

    # mechanics
    lead: float = 8e-3  # [m] per turn
    motor_inertia: float = 3e-3  # [kg m2] with coupling
    screw_inertia: float = 2e-3  # [kg m2] 40 mm, 1 m long
    table_mass: float = 300.0  # [kg]
    axial_stiffness: float = 1.5e8  # [N/m] screw, nut and bearings in series
    axial_damping: float = 2e4  # [N s/m] 5 % of critical
    guide_damping: float = 400.0  # [N s/m] oil in the guide
    # motor and current loop
    torque_constant: float = 1.2  # [N m/A] = [V s/rad]
    resistance: float = 0.7  # [Ohm]
    inductance: float = 8e-3  # [H]
    current_limit: float = 30.0  # [A]
    voltage_limit: float = 500.0  # [V]
    current_bandwidth: float = 2500.0  # [rad/s]: 0.4 ms from current command to torque
    # speed and position loop
    speed_gain: float = 1.5  # [N m s/rad]
    reset_time: float = 10e-3  # [s]
    position_gain: float = 25.0  # [1/s] = 1.5 m/min per mm
    # inputs of the friction FMU
    preload: float = 2000.0  # [N]
    oil_temperature: float = 303.15  # [K]
    presliding_stiffness: float = 150.0  # [N m/rad] slides after 12 um of table travel, 23 um past a reversal
    presliding_damping: float = 0.2  # [N m s/rad] 11 % of critical with the inertia
    # controller cycle = communication step
    step: float = 125e-6  # [s]

    def __post_init__(self) -> None:
        a, b = self.coupling
        if not (b <= 1.0 and a < 4.0 - 2.0 * b):
            raise ValueError(
                f"step = {self.step} s; explicit coupling needs step^2 s0/J < 4 - 2b, b = step s1/J <= 1; "
                f"found {a:.3g}, {b:.3g}: take a smaller step, stiffness or damping"
            )

    @property
    def inertia(self) -> float:
        """Motor and screw [kg m2]; above the resonance of the table the friction acts on these only."""
        return self.motor_inertia + self.screw_inertia

    @property
    def coupling(self) -> tuple[float, float]:
        """Groups a, b of the stability of the coupling with presliding (docstring of servo_axis.py)."""
        h = self.step
        return h**2 * self.presliding_stiffness / self.inertia, h * self.presliding_damping / self.inertia

    @property
    def ratio(self) -> float:
        """Table travel per screw angle [m/rad]."""
        return self.lead / (2.0 * np.pi)

    def transition(self) -> np.ndarray:
        """Maps (current, angle, speed, table position, table velocity; voltage, friction torque, process
        force) to the first five one step later: exact while the last three are held."""
        r, k, d, J, m = self.ratio, self.axial_stiffness, self.axial_damping, self.inertia, self.table_mass
        R, L, K_t, c = self.resistance, self.inductance, self.torque_constant, self.guide_damping
        rates = np.zeros((8, 8))
        rates[0] = [-R / L, 0, -K_t / L, 0, 0, 1 / L, 0, 0]
        rates[1, 2] = 1.0
        rates[2] = np.array([K_t, -r * r * k, -r * r * d, r * k, r * d, 0, -1, 0]) / J
        rates[3, 4] = 1.0
        rates[4] = np.array([0, r * k, r * d, -k, -d - c, 0, 0, -1]) / m
        return expm(rates * self.step)[:5]


def on_circle(time, radius, feed, cutting_force):
    """Reference of one axis on a milled circle, from one reversal at time 0.

    time: float or (n,) array [s]; radius: [m]; feed: along the path [m/s]; cutting_force: along the path [N]. Returns
    position [m], velocity [m/s], process force against the axis direction [N], each as time.
    """
    angle = feed / radius * time
    swing = np.sin(angle)
    return radius * (1.0 - np.cos(angle)), feed * swing, cutting_force * swing


class Drive:
    """Motor, controller and mechanics of an axis, from rest; the position is measured at the table, the speed
    at the motor. SI units."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._transition = axis.transition()
        self._current = self._speed_integral = self._current_integral = 0.0
        self.angle = self.speed = self.position = self.velocity = 0.0

    @property
    def motor_torque(self) -> float:
        return self._axis.torque_constant * self._current

    @property
    def axial_load(self) -> float:
        """Force of the table on the nut; positive loads the nut at the flange."""
        axis, r = self._axis, self._axis.ratio
        spring = axis.axial_stiffness * (self.position - r * self.angle)
        return spring + axis.axial_damping * (self.velocity - r * self.speed)

    def advance(self, position: float, velocity: float, process_force: float, friction_torque: float) -> None:
        """One step of the controller cycle with these references, force and torque held."""
        voltage = self.voltage(position, velocity)
        state = (self._current, self.angle, self.speed, self.position, self.velocity)
        held = (voltage, friction_torque, process_force)
        next_state = (self._transition @ (*state, *held)).tolist()
        self._current, self.angle, self.speed, self.position, self.velocity = next_state

    def voltage(self, position: float, velocity: float) -> float:
        """Voltage of the motor over the next controller cycle, for these references [V]."""
        axis, limit = self._axis, self._axis.current_limit
        r, h, K_t, R = axis.ratio, axis.step, axis.torque_constant, axis.resistance
        speed_error = (axis.position_gain * (position - self.position) + velocity) / r - self.speed
        target = axis.speed_gain * (speed_error + self._speed_integral) / K_t
        if abs(target) <= limit:  # no wind-up
            self._speed_integral += h / axis.reset_time * speed_error
        current_error = min(max(target, -limit), limit) - self._current
        voltage = axis.current_bandwidth * (axis.inductance * current_error + self._current_integral)
        voltage += K_t * self.speed
        if abs(voltage) <= axis.voltage_limit:
            self._current_integral += h * R * current_error
        return min(max(voltage, -axis.voltage_limit), axis.voltage_limit)


@dataclass(frozen=True)
class TransmissionAxis(Axis):
    """The axis with BallScrewTransmission as its screw: the stiffness of the nut is in the FMU, the rest stays here."""

    screw_mass: float = 10.0  # [kg] 40 mm, 1 m long; moves axially in its bearings
    nut_stiffness: float = 1.4e9  # [N/m] of the preloaded nut, which is a part of axial_stiffness
    exchanges: int = 5  # of torque and force with the screw in one cycle of the controller

    @property
    def exchange_step(self) -> float:
        """Communication step of the screw [s]."""
        return self.step / self.exchanges

    @property
    def support_stiffness(self) -> float:
        """Shaft of the screw and bearings, in series with the nut axial_stiffness [N/m]."""
        return 1.0 / (1.0 / self.axial_stiffness - 1.0 / self.nut_stiffness)

    def exchange_transition(self) -> np.ndarray:
        """As transition(): (current, angle, speed, table position, velocity, axial position of the screw, its velocity;
        voltage, screw torque, nut force, process force) to the first seven one exchange step later."""
        J, m, m_s = self.inertia, self.table_mass, self.screw_mass
        R, L, K_t, c = self.resistance, self.inductance, self.torque_constant, self.guide_damping
        rates = np.zeros((11, 11))
        rates[0, [0, 2, 7]] = -R / L, -K_t / L, 1.0 / L
        rates[1, 2] = rates[3, 4] = rates[5, 6] = 1.0
        rates[2, [0, 8]] = K_t / J, -1.0 / J
        rates[4, [4, 9, 10]] = -c / m, 1.0 / m, -1.0 / m
        rates[6, [5, 6, 9]] = -self.support_stiffness / m_s, -self.axial_damping / m_s, -1.0 / m_s
        return expm(rates * self.exchange_step)[:7]


class TransmissionDrive(Drive):
    """Motor, controller, table and screw in its bearings; between screw and nut is the transmission."""

    def __init__(self, axis: TransmissionAxis) -> None:
        super().__init__(axis)
        self._transition = axis.exchange_transition()
        self._exchanges, self._count, self._voltage = axis.exchanges, 0, 0.0
        self._shift = self._shift_rate = 0.0  # of the screw, axially [m], [m/s]

    @property
    def nut_position(self) -> float:
        """Of the nut along the screw [m]."""
        return self.position - self._shift

    @property
    def nut_velocity(self) -> float:
        return self.velocity - self._shift_rate

    def exchange(
        self, position: float, velocity: float, process_force: float, screw_torque: float, nut_force: float
    ) -> None:
        """One exchange step with torque and force held; the references count at the start of a controller cycle."""
        if self._count % self._exchanges == 0:
            self._voltage = self.voltage(position, velocity)
        self._count += 1
        state = (
            self._current,
            self.angle,
            self.speed,
            self.position,
            self.velocity,
            self._shift,
            self._shift_rate,
        )
        held = (self._voltage, screw_torque, nut_force, process_force)
        next_state = (self._transition @ (*state, *held)).tolist()
        self._current, self.angle, self.speed, self.position, self.velocity = next_state[:5]
        self._shift, self._shift_rate = next_state[5:]
