"""Look-up of the nut map: friction torque, film and contact extremes of the double nut at an operating point.

Numpy and the standard library only: this module travels inside the FMU. Torque of the double nut = nut(F_1) +
nut(F_2), where the axial load moves force from one nut to the other. Every quantity is stored as the
logarithm of its value in a tricubic B-spline (bspline.py) over (ln force, ln speed, temperature); packed.py
names the columns.

Limits:
- a force below the axis follows the power laws of Hertz from its end: viscous torque F^(2/3), sliding torque
  F, hysteresis torque F^(4/3), pressure and temperature rise F^(1/3), ball load F; films keep the values of
  the end. A nut without force has no torque. The relieved nut may come there, that is in range; a preload
  below its own axis is flagged.
- a preload, speed, temperature or axial load beyond the axes is clamped and flagged. A negative preload
  counts as 0.
- standstill law below the lowest speed of the axis, s = |speed|/lowest: viscous or rolling torque (1 - c) s + c s^3
  times its value at the lowest speed, with c from the local exponent of speed there (odd, smooth, monotone);
  films s^0.67 (exponent of the elastohydrodynamic film), temperature rise s. The sliding torque rises to
  breakaway_factor over the factor of the map at the lowest speed (nut_law.coulomb_rise). In range.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ballscrew_tehl.runtime.bspline import Axis, Weights, cubic_slopes, cubic_weights, weighted
from ballscrew_tehl.runtime.nut_law import (
    ARRAYS,
    FLOATS,
    NUT_TORQUES,
    DoubleNutState,
    Numbers,
    Ops,
    double_nut,
    nut_extremes,
    nut_forces,
)
from ballscrew_tehl.runtime.packed import DEFAULTS, FrictionParameters, check, read_npz

PIECE = 512  # points of an array that are evaluated at a time: they stay in the cache of the processor

Array = NDArray[np.float64]
Operand = float | Array  # arrays broadcast
#: called with the force of a nut [N] and its ten logarithms (packed.SURFACES); returns them corrected
Correction = Callable[[float, list[float]], list[float]]


class NutMap:
    """A map that was checked on creation; immutable and safe to share.

    Example      NutMap.from_npz(path).evaluate(2000.0, 104.7, 303.15).viscous_torque
    """

    def __init__(self, header: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
        """Header with the content_hash of packed.sealed, coefficient arrays; MapError if either is damaged."""
        arrays = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in arrays.items()}
        check(header, arrays)
        self.header: Mapping[str, Any] = header
        self.law: str = header["law"]
        self.nut_torques = NUT_TORQUES[self.law]
        self.arrays = arrays
        self.presliding_angle = float(header["presliding_angle"])
        self.seal_torque = float(header.get("screw", {}).get("seal_torque", 0.0))  # [N.m]
        self.defaults = FrictionParameters(*(float(header["defaults"][name]) for name in DEFAULTS))
        axes = header["axes"]
        self.force = Axis(axes["force"], logarithmic=True)
        self.speed = Axis(axes["speed"], logarithmic=True)
        self.temperature = Axis(axes["temperature"], logarithmic=False)
        self.preload = Axis(axes["preload"], logarithmic=True)
        self.share = Axis(axes["share"], logarithmic=False)
        #: coefficients (speed, temperature, force, column): a (4, 4) block of the first two contracts in one product
        self.blocks = np.ascontiguousarray(arrays["coefficients"].transpose(1, 2, 0, 3))
        self.curves = arrays["force_coefficients"]
        self._separation = arrays["separation_coefficients"]
        self._sharing = arrays["sharing_coefficients"]
        # the same by the side of the axial load, > 0 first; lists are faster for the few numbers of one point
        self.separation_lists = self._separation.T.tolist()
        self.sharing_lists = self._sharing.transpose(2, 0, 1).tolist()

    @classmethod
    def from_npz(cls, path: Path | str) -> "NutMap":
        """Map of an .npz file; MapError if it is damaged, OSError if it is not there."""
        return cls(*read_npz(path))

    def evaluate(
        self,
        preload: Operand,
        speed: Operand,
        temperature: Operand,
        axial_load: Operand = 0.0,
        apparent_viscosity_ratio: Operand | None = None,
        net_sliding_coefficient: Operand | None = None,
        roughness_height: Operand | None = None,
        breakaway_factor: Operand | None = None,
    ) -> DoubleNutState:
        """State of the double nut at one operating point or at many (arrays broadcast; same numbers).

        Parameters   preload : [N]; temperature : [K]; axial_load : [N], sign says which nut it loads
                     speed : [rad/s], either sign
                     apparent_viscosity_ratio, net_sliding_coefficient : >= 0; roughness_height : [m], >= 0;
                     breakaway_factor : >= 0, values below 1 count as 1; None takes the default of the map header
        Returns      DoubleNutState with the seals of the screw; no regularisation of the Coulomb parts at standstill
        Raises       ValueError: an argument that is not finite, a temperature in degrees Celsius, a negative
                     friction parameter
        """
        given = (apparent_viscosity_ratio, net_sliding_coefficient, roughness_height, breakaway_factor)
        arguments = self.checked_arguments(preload, speed, temperature, axial_load, *given)
        self._refuse_celsius(float(np.min(arguments[2], initial=math.inf)))
        point = isinstance(arguments[0], float)
        state = self.evaluate_point(*arguments) if point else self._evaluate_array(*arguments)
        return state._replace(seal_torque=self.seal_torque)

    def checked_arguments(
        self,
        preload: Operand,
        speed: Operand,
        temperature: Operand,
        axial_load: Operand,
        *friction: Operand | None,
    ) -> list[Any]:
        """Arguments of evaluate() with defaults filled in: all numbers, or all arrays of one shape; else ValueError."""
        filled = (d if g is None else g for g, d in zip(friction, self.defaults, strict=True))
        arguments: list[Any] = [preload, speed, temperature, axial_load, *filled]
        if all(isinstance(a, (float, int)) for a in arguments):
            for name, value in zip(_ARGUMENTS, arguments, strict=True):
                if not math.isfinite(value) or (value < 0.0 and name in _NOT_NEGATIVE):
                    raise _bad_argument(name, value)
            return [float(a) for a in arguments]
        columns = [np.asarray(a, dtype=np.float64) for a in arguments]
        for name, column in zip(_ARGUMENTS, columns, strict=True):
            bad = ~np.isfinite(column) | ((column < 0.0) & (name in _NOT_NEGATIVE))
            if bad.any():
                raise _bad_argument(name, float(column[bad].flat[0]))
        return list(np.broadcast_arrays(*columns))

    def _refuse_celsius(self, temperature: float) -> None:
        """Refuse what is outside the map in kelvin, and inside it in degrees Celsius."""
        axis, meant = self.temperature, temperature + 273.15
        if temperature < axis.lo <= meant <= axis.hi:
            raise ValueError(f"temperature = {temperature:g} K; is {meant:g} K meant?")

    def surfaces(self, force: Operand, speed: Operand, temperature: Operand) -> Array:
        """The ten logarithms of one nut, packed.SURFACES first: (10, ...), clamped to the axes; arguments broadcast."""
        force, speed, temperature = np.broadcast_arrays(
            *(np.asarray(x, dtype=np.float64) for x in (force, speed, temperature))
        )
        found = self._splines_array(force.ravel(), speed.ravel(), temperature.ravel(), False)[0]
        return found.reshape(-1, *force.shape)

    def evaluate_point(
        self,
        preload: float,
        speed: float,
        temperature: float,
        axial_load: float,
        ratio: float,
        net: float,
        roughness: float,
        breakaway: float,
        correction: Correction | None = None,
    ) -> DoubleNutState:
        """evaluate() for floats that the caller has checked: the step of the FMU.

        correction : of the surfaces of each nut at its force (refine.py), None = the map as it is
        """
        highest, clamped = self.force.hi, []
        if not self.preload.lo <= preload <= highest:
            clamped.append("preload")
            preload = min(max(preload, 0.0), highest)
        relieved = loaded = preload
        clamped += self._outside(speed, temperature)
        if axial_load != 0.0:
            relieved, loaded = self._forces_point(preload, axial_load)
            if loaded > highest:
                loaded = highest
                clamped.append("axial_load")
        friction = FrictionParameters(ratio, net, roughness, breakaway)
        return self.evaluate_forces(relieved, loaded, speed, temperature, friction, clamped, correction)

    def _outside(self, speed: float, temperature: float) -> list[str]:
        names = ["speed"] if abs(speed) > self.speed.hi else []
        if not self.temperature.lo <= temperature <= self.temperature.hi:
            names.append("temperature")
        return names

    def evaluate_forces(
        self,
        relieved: float,
        loaded: float,
        speed: float,
        temperature: float,
        friction: FrictionParameters,
        clamped: list[str] | None = None,
        correction: Correction | None = None,
    ) -> DoubleNutState:
        """State of both nuts at given forces, relieved <= loaded <= end of the axis [N], checked by the caller.

        clamped : names of inputs beyond the map, None: of speed and temperature
        """
        names = tuple(self._outside(speed, temperature) if clamped is None else clamped)
        point = (*self.placed(speed, temperature), friction, correction)
        first = self._nut_point(relieved, *point)
        second = first if loaded == relieved else self._nut_point(loaded, *point)
        return double_nut(first, second, friction.roughness_height, not names, names, FLOATS)

    def placed(self, speed: float, temperature: float) -> tuple[int, int, Array, float]:
        """Cells of a speed, sign free, and temperature; weights of their 16 neighbours; speed over the lowest, up to 1.

        Below the lowest speed a second row has the weights of the slope over ln speed.
        """
        axis, speed = self.speed, abs(speed)
        (j, tj), (k, tk) = axis.place(speed), self.temperature.place(temperature)
        w_k = cubic_weights(tk)
        rows = [[a * b for a in cubic_weights(tj) for b in w_k]]
        s = speed / axis.lo if speed < axis.lo else 1.0
        if s < 1.0:
            rows.append([axis.scale * a * b for a in cubic_slopes(tj) for b in w_k])
        return j, k, np.array(rows), s

    def presliding_stiffness(self, preload: float, axial_load: float, net: float, breakaway: float) -> float:
        """Sum over both nuts of Coulomb torque at standstill over presliding_angle [N.m/rad of the screw].

        It depends on the loads [N] alone, so that no energy arises while speed or temperature change: by the
        mechanistic law the shear of the raceway contacts is left out (3 to 9 % of the Coulomb torque of the GD4008-3).
        """
        preload = min(max(preload, 0.0), self.force.hi)
        if axial_load == 0.0:
            return 2.0 * self._nut_stiffness(preload, net, breakaway)
        relieved, loaded = self._forces_point(preload, axial_load)
        return self.stiffness_at_forces(relieved, min(loaded, self.force.hi), net, breakaway)

    def seal_stiffness(self, seal_torque: float) -> float:
        """Presliding stiffness of the seals [N.m/rad], by the presliding angle at the highest force of the map."""
        return seal_torque / (self.presliding_angle * self.force.hi ** (1.0 / 3.0))

    def stiffness_at_forces(self, relieved: float, loaded: float, net: float, breakaway: float) -> float:
        """presliding_stiffness at given forces of both nuts [N], at most the end of the axis."""
        return self._nut_stiffness(relieved, net, breakaway) + self._nut_stiffness(loaded, net, breakaway)

    def _nut_stiffness(self, force: float, net: float, breakaway: float) -> float:
        """Coulomb torque of one nut at standstill over the presliding angle, which grows as the contact, F^(1/3)."""
        if not force > 0.0:
            return 0.0
        i, t = self.force.place(force)
        w = cubic_weights(t)
        hysteresis, sliding = (
            math.exp(sum(a * row[column] for a, row in zip(w, self.curves[i : i + 4], strict=True)))
            for column in (0, 1)
        )
        f = force / self.force.lo if force < self.force.lo else 1.0
        sliding *= net * max(breakaway, 1.0) * f
        return (hysteresis * f * f ** (1.0 / 3.0) + sliding) / (self.presliding_angle * force ** (1.0 / 3.0))

    def range_margin(self, preload: float, speed: float, temperature: float, axial_load: float) -> float:
        """Least distance from the limits of preload, speed, temperature and force of the loaded nut.

        Each as a share of the length of its axis, negative outside; arguments checked as for evaluate_point.
        """
        highest, hottest, fastest = self.force.hi, self.temperature.hi, self.speed.hi
        margin = min(
            min(preload - self.preload.lo, highest - preload) / (highest - self.preload.lo),
            min(temperature - self.temperature.lo, hottest - temperature) / (hottest - self.temperature.lo),
            (fastest - abs(speed)) / fastest,
        )
        if axial_load == 0.0:
            return margin
        _, loaded = self._forces_point(min(max(preload, 0.0), highest), axial_load)
        return min(margin, (highest - loaded) / highest)

    def _nut_point(
        self,
        force: float,
        j: int,
        k: int,
        weights: Array,
        s: float,
        friction: FrictionParameters,
        correction: Correction | None,
    ) -> tuple[Numbers, Numbers]:
        i, ti = self.force.place(force)
        w_i = np.array(cubic_weights(ti))
        contracted = weights.dot(self.blocks[j : j + 4, k : k + 4, i : i + 4].reshape(16, -1))
        # dot takes less time than @ on arrays of this size, for the same digits
        values = [w_i.dot(row.reshape(4, -1)).tolist() for row in contracted]
        curves = w_i.dot(self.curves[i : i + 4]).tolist()
        if correction is not None:
            values[0] = correction(force, values[0])
        f = force / self.force.lo if force < self.force.lo else 1.0
        slopes = values[1] if s < 1.0 else None
        torques = self.nut_torques(values[0], slopes, curves, f, s, friction, FLOATS)
        return torques, nut_extremes(values[0], curves, f, s, FLOATS)

    def _forces_point(self, preload: float, axial_load: float) -> tuple[float, float]:
        """Forces of the relieved and of the loaded nut under an axial load."""
        if preload <= 0.0:
            return 0.0, abs(axial_load)
        side = 0 if axial_load > 0.0 else 1
        found: tuple[float, float] = self.forces_over(preload, abs(axial_load), side, _weights_at, FLOATS)
        return found

    def forces_over(
        self, preload: Any, load: float, side: int, weights_at: Callable[[Axis, Any], Any], ops: Ops
    ) -> tuple[Any, Any]:
        """Forces of the relieved and of the loaded nut [N] at a preload > 0, a float or a Dual.

        Parameters   load : magnitude of the axial load [N];  side : 0 where it is > 0, else 1
                     weights_at : cell of a value on an axis and weights there
        """
        p, w_p = weights_at(self.preload, preload)

        def sharing(share: Any) -> Any:
            q, w_q = weights_at(self.share, share)
            return weighted(w_p, [weighted(w_q, row, q) for row in self.sharing_lists[side][p : p + 4]], 0)

        return nut_forces(preload, load, weighted(w_p, self.separation_lists[side], p), sharing, ops)

    def _evaluate_array(self, *arguments: Array) -> DoubleNutState:
        """evaluate() for arrays of one shape, piece by piece."""
        shape, given = arguments[0].shape, [a.ravel() for a in arguments]
        pieces = [
            self._evaluate_piece(*(a[first : first + PIECE] for a in given))
            for first in range(0, max(given[0].size, 1), PIECE)
        ]
        columns: list[Any] = [
            np.concatenate(column).reshape(shape)
            for column in zip(*(state for state, _ in pieces), strict=True)
        ]
        columns.append(tuple(n for n in _CLAMPED if any(outside[n].any() for _, outside in pieces)))
        return DoubleNutState(*columns)

    def _evaluate_piece(
        self, preload: Array, speed: Array, temperature: Array, axial_load: Array, *friction: Array
    ) -> tuple[tuple[Any, ...], dict[str, NDArray[np.bool_]]]:
        """State without the names of what is clamped, and where each of _CLAMPED is."""
        outside = {"preload": (preload < self.preload.lo) | (preload > self.force.hi)}
        preload = np.clip(preload, 0.0, self.force.hi)
        speed = np.abs(speed)
        outside["speed"] = speed > self.speed.hi
        outside["temperature"] = (temperature < self.temperature.lo) | (temperature > self.temperature.hi)
        outside["axial_load"] = np.zeros(preload.shape, dtype=bool)
        forces = [preload]
        if axial_load.any():
            relieved, loaded = self._forces_array(preload, axial_load)
            outside["axial_load"] = (loaded > self.force.hi) & (axial_load != 0.0)
            forces = [relieved, np.minimum(loaded, self.force.hi)]
        s = np.minimum(speed / self.speed.lo, 1.0)
        parameters = FrictionParameters(*friction)
        nuts = []
        for force in forces:
            slow = bool((s < 1.0).any())
            values, slopes, curves = self._splines_array(force, speed, temperature, with_slopes=slow)
            f = np.minimum(force / self.force.lo, 1.0)
            torques = self.nut_torques(values, slopes, curves, f, s, parameters, ARRAYS)
            nuts.append((torques, nut_extremes(values, curves, f, s, ARRAYS)))
        in_range = ~np.logical_or.reduce(list(outside.values()))
        roughness = parameters.roughness_height
        return double_nut(nuts[0], nuts[-1], roughness, in_range, (), ARRAYS)[:-2], outside

    def _splines_array(
        self, force: Array, speed: Array, temperature: Array, with_slopes: bool
    ) -> tuple[Array, Array | None, Array]:
        """Surfaces, their slopes over ln speed (or None) and force curves of points (n,): (columns, n)."""
        (i, ti), (j, tj) = self.force.place_array(force), self.speed.place_array(speed)
        k, tk = self.temperature.place_array(temperature)
        w_i, w_k = (np.stack(cubic_weights(t), axis=-1) for t in (ti, tk))
        along_speed = [np.stack(cubic_weights(tj), axis=-1)]
        if with_slopes:
            along_speed.append(self.speed.scale * np.stack(cubic_slopes(tj), axis=-1))
        weights = np.stack(along_speed, axis=1)[..., None] * w_k[:, None, None, :]
        i, j, k = (cell[:, None] + np.arange(4) for cell in (i, j, k))
        blocks = self.blocks[j[:, :, None, None], k[:, None, :, None], i[:, None, None, :]]
        lines = weights.reshape(len(force), -1, 16) @ blocks.reshape(len(force), 16, -1)
        found = w_i[:, None, None] @ lines.reshape(*lines.shape[:2], 4, self.blocks.shape[-1])
        values = np.ascontiguousarray(np.moveaxis(found[:, :, 0], 0, -1))
        curves = (w_i[:, None] @ self.curves[i])[:, 0]
        return values[0], values[1] if with_slopes else None, curves.T

    def _forces_array(self, preload: Array, axial_load: Array) -> tuple[Array, Array]:
        """_forces_point for arrays."""
        load = np.abs(axial_load)
        side = np.where(axial_load > 0.0, 0, 1)
        p, tp = self.preload.place_array(preload)
        w_p = cubic_weights(tp)
        separation = sum(w * self._separation[p + a, side] for a, w in enumerate(w_p))

        def sharing(share: Array) -> Any:
            q, tq = self.share.place_array(share)
            rows = [
                sum(w * self._sharing[p + a, q + b, side] for b, w in enumerate(cubic_weights(tq)))
                for a in range(4)
            ]
            return sum(v * row for v, row in zip(w_p, rows, strict=True))

        pressed = preload > 0.0
        relieved, _ = nut_forces(np.where(pressed, preload, 1.0), load, separation, sharing, ARRAYS)
        relieved = np.where(axial_load == 0.0, preload, np.where(pressed, relieved, 0.0))
        return relieved, relieved + load


def _weights_at(axis: Axis, value: float) -> tuple[int, Weights]:
    cell, t = axis.place(value)
    return cell, cubic_weights(t)


_CLAMPED = ("preload", "speed", "temperature", "axial_load")
_ARGUMENTS = ("preload", "speed", "temperature", "axial_load", *DEFAULTS)
_NOT_NEGATIVE = DEFAULTS


def _bad_argument(name: str, value: float) -> ValueError:
    return ValueError(f"{name} = {value}; needs a finite number" + (" >= 0" if name in _NOT_NEGATIVE else ""))
