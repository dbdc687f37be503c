"""Look-up of the nut map: friction torque, film and contact extremes of the double nut at an operating point.

Torque of the double nut = nut(F_1) + nut(F_2), where the axial load moves force from one nut to the other. Every
quantity is stored as the logarithm of its value in a tricubic B-spline (bspline.py) over (ln force, ln speed,
temperature); packed.py names the columns.

Limits:
- a force below the axis follows the power laws of Hertz from its end: rolling torque F^(2/3), sliding torque F and as
  much of the drag between balls as its contacts transmit, hysteresis torque F^(4/3), pressure and temperature rise
  F^(1/3), ball load F; films keep the values of the end. A nut without force has no torque. The relieved nut may come
  there, that is in range; a preload below its own axis is flagged. At preload 0 one nut holds the axial load, in range
  on the axis of the preload.
- a preload, speed, temperature or axial load beyond the axes is clamped and flagged. A negative preload
  counts as 0. An axial load that leaves the relieved flanks of oversize balls less than HELD of the loaded ones' force
  is flagged: such balls are neither held by four flanks nor free.
- standstill law below the lowest speed of the axis, s = |speed|/lowest: viscous or rolling torque (1 - c) s + c s^3
  times its value at the lowest speed, with c from the local exponent of speed there (odd, smooth, monotone);
  films s^0.67 (exponent of the elastohydrodynamic film), temperature rise s. The sliding torque rises to
  breakaway_factor over the factor of the map at the lowest speed (nut_law.coulomb_rise). In range.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ballscrew_tehl.runtime.bspline import Axis, cubic_slopes, cubic_weights, weighted
from ballscrew_tehl.runtime.constants import HELD, MOST_DIFFERENCE, STRETCH
from ballscrew_tehl.runtime.nut_law import (
    ARRAYS,
    FLOATS,
    DoubleNutState,
    Ops,
    double_nut,
    nut_extremes,
    nut_torques,
)
from ballscrew_tehl.runtime.packed import DEFAULTS, FORCE_CURVES, POINT, FrictionParameters, check, read_npz

PIECE = 512  # points of an array that are evaluated at a time: they stay in the cache of the processor

Array = NDArray[np.float64]
Operand = float | Array  # arrays broadcast
#: called with the force of a nut [N] and its ten logarithms (packed.SURFACES); returns them corrected
Correction = Callable[[float, list[float]], list[float]]


class NutMap:
    """Map of a screw: friction torque, films and contact extremes of the double nut; immutable.

    Parameters
    ----------
    header : mapping
        Header with the content_hash of packed.sealed.
    arrays : mapping of str to array
        Coefficient arrays.

    Raises
    ------
    MapError
        Header or arrays are damaged.

    Notes
    -----
    Interpolation and limits: head of this module.

    Examples
    --------
    >>> from ballscrew_tehl import load_map
    >>> nut_map = load_map()
    >>> nut_map.outside(speed=1e4, temperature=303.15)
    ['speed']
    """

    def __init__(self, header: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
        arrays = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in arrays.items()}
        check(header, arrays)
        self.header: Mapping[str, Any] = header
        self.law: str = header["law"]
        self.arrays = arrays
        self.presliding_angle = float(header["presliding_angle"])
        self.preload_factor = float(header.get("preload_factor", 1.0))  # true force over the preload
        self.seal_torque = float(header.get("screw", {}).get("seal_torque", 0.0))  # [N.m]
        self.defaults = FrictionParameters(*(float(header["defaults"][name]) for name in DEFAULTS))
        axes = header["axes"]
        self.force = Axis(axes["force"], logarithmic=True)
        self.speed = Axis(axes["speed"], logarithmic=True)
        self.temperature = Axis(axes["temperature"], logarithmic=False)
        self.preload = Axis(axes["preload"], logarithmic=True)
        self.share = Axis(axes["share"], logarithmic=False)
        self.difference = Axis(axes["difference"], logarithmic=False)
        #: coefficients (speed, temperature, force, column): a (4, 4) block of the first two contracts in one product
        self.blocks = np.ascontiguousarray(arrays["coefficients"].transpose(1, 2, 0, 3))
        self.curves, self.drag = arrays["force_coefficients"], arrays["drag_coefficients"]
        self.oversize = bool((self.curves[:, FORCE_CURVES.index("free_shear_share")] < 0.0).any())
        # by the side of the axial load, > 0 first; lists are faster for the few numbers of one point
        separation, sharing = arrays["separation_coefficients"].T, arrays["sharing_coefficients"]
        self.load_arrays = separation.ravel(), sharing.transpose(2, 0, 1).ravel()
        self.load_lists = tuple(array.tolist() for array in self.load_arrays)

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
        temperature_difference: Operand = 0.0,
    ) -> DoubleNutState:
        """State of the double nut at one operating point or at many; arrays broadcast.

        Parameters
        ----------
        preload : float or array
            Preload with screw and nut at one temperature, as preload_basis of the screw file says [N].
        speed : float or array
            Speed of the screw against the nut [rad/s], either sign.
        temperature : float or array
            Temperature of the oil [K].
        axial_load : float or array, optional
            Axial load [N]; the sign says which nut it loads.
        apparent_viscosity_ratio, net_sliding_coefficient : float or array, optional
            Friction numbers, >= 0; None: default of the map header, as for the following.
        roughness_height : float or array, optional
            Roughness [m], >= 0.
        breakaway_factor : float or array, optional
            >= 0; values below 1 count as 1.
        temperature_difference : float or array, optional
            Screw minus nut [K], which changes the preload: preload_actual of the state.

        Returns
        -------
        DoubleNutState
            State with the seals of the screw; no regularisation of the Coulomb parts at standstill.

        Raises
        ------
        ValueError
            An argument that is not finite, a temperature in degrees Celsius, a negative friction number.

        Examples
        --------
        >>> from ballscrew_tehl import load_map
        >>> state = load_map().evaluate(preload=2000.0, speed=104.7, temperature=303.15)
        >>> f"{state.friction_torque:.2f} N.m"
        '1.32 N.m'
        """
        given = (apparent_viscosity_ratio, net_sliding_coefficient, roughness_height, breakaway_factor)
        difference = np.asarray(temperature_difference, dtype=np.float64)
        if not np.isfinite(difference).all():
            raise ValueError(f"temperature_difference = {difference}; needs a finite number")
        moved = self.preload_factor != 1.0 or bool(np.any(difference != 0.0))
        actual = self.actual_preload(preload, difference) if moved else preload
        arguments = self.checked_arguments(actual, speed, temperature, axial_load, *given)
        coldest = float(np.min(arguments[2], initial=math.inf))
        if coldest < self.temperature.lo <= coldest + 273.15 <= self.temperature.hi:
            raise ValueError(f"temperature = {coldest:g} K; is {coldest + 273.15:g} K meant?")
        point = isinstance(arguments[0], float)
        state = self.evaluate_point(*arguments) if point else self._evaluate_array(*arguments)
        state = state._replace(seal_torque=self.seal_torque, preload_actual=arguments[0])
        return self._flagged(state, preload, difference) if moved else state

    def preload_left(self, preload: Operand, difference: Operand) -> Any:
        """(Actual over true preload)^(2/3) at a temperature difference [K], below 0: lost, by as much."""
        force = np.asarray(preload, dtype=np.float64)
        steep = np.asarray(difference) * (math.sinh(STRETCH) / MOST_DIFFERENCE)
        force, t = np.broadcast_arrays(force, MOST_DIFFERENCE / STRETCH * np.arcsinh(steep))
        (p, t_p), (q, t_q) = self.preload.place_array(force), self.difference.place_array(t)
        w_p, w_q = (np.stack(cubic_weights(x), axis=-1) for x in (t_p, t_q))
        p, q = p[..., None, None] + np.arange(4)[:, None], q[..., None, None] + np.arange(4)
        shift = np.einsum("...a,...b,...ab->...", w_p, w_q, self.arrays["shift_coefficients"][p, q])
        loaded = (force > 0.0) & (t != 0.0)
        return np.where(loaded, 1.0 + shift / np.cbrt(np.where(loaded, force, 1.0)) ** 2, 1.0)

    def actual_preload(self, preload: Operand, difference: Operand) -> Any:
        """True preload [N] at a temperature difference of screw and nut [K], at most MOST_DIFFERENCE; 0: lost."""
        force = self.preload_factor * np.asarray(preload, dtype=np.float64)
        left = np.maximum(self.preload_left(force, difference), 0.0)
        actual = force * left * np.sqrt(left)
        return actual if actual.ndim else float(actual)

    def _flagged(self, state: DoubleNutState, preload: Operand, difference: Operand) -> DoubleNutState:
        """State with its range: a difference beyond the axis, a preload that it takes away."""
        beyond = np.abs(difference) > MOST_DIFFERENCE
        beyond |= (np.asarray(state.preload_actual) == 0.0) & (np.asarray(preload) > 0.0)
        if not np.any(beyond):
            return state
        inside = np.asarray(state.in_range) & ~beyond
        names = (*state.clamped, "temperature_difference")
        return state._replace(in_range=inside if inside.ndim else bool(inside), clamped=names)

    def point_at_difference(
        self, point: Sequence[float], difference: float, seal_torque: float, refinement: Any = None
    ) -> tuple[tuple[float, ...], DoubleNutState]:
        """Arguments of evaluate_point() with the actual preload, and the state there: the step of the FMU."""
        moved = difference != 0.0 or self.preload_factor != 1.0
        actual = self.actual_preload(point[0], difference) if moved else point[0]
        at = (actual, *point[1:])
        state = (
            (refinement or self).evaluate_point(*at)._replace(seal_torque=seal_torque, preload_actual=actual)
        )
        return at, self._flagged(state, point[0], difference) if difference else state

    def checked_arguments(self, *arguments: Operand | None) -> list[Any]:
        """Arguments of evaluate() with defaults filled in: all numbers, or all arrays of one shape; else ValueError."""
        given, friction = arguments[: len(POINT)], arguments[len(POINT) :]
        filled = [*given, *(d if g is None else g for g, d in zip(friction, self.defaults, strict=True))]
        columns = [np.asarray(a, dtype=np.float64) for a in filled]
        for name, column in zip((*POINT, *DEFAULTS), columns, strict=True):
            bad = ~np.isfinite(column) | ((column < 0.0) & (name in DEFAULTS))
            if bad.any():
                needs = "a finite number" + (" >= 0" if name in DEFAULTS else "")
                raise ValueError(f"{name} = {column[bad].flat[0]}; needs {needs}")
        if all(isinstance(a, (float, int)) for a in filled):
            return [float(column) for column in columns]
        return list(np.broadcast_arrays(*columns))

    def surfaces(self, force: Operand, speed: Operand, temperature: Operand) -> Array:
        """The ten logarithms of one nut, packed.SURFACES first: (10, ...), clamped to the axes; arguments broadcast."""
        force, speed, temperature = np.broadcast_arrays(
            *(np.asarray(x, dtype=np.float64) for x in (force, speed, temperature))
        )
        result = self._splines_array(force.ravel(), speed.ravel(), temperature.ravel(), False)[0]
        return result.reshape(-1, *force.shape)

    def evaluate_point(
        self,
        preload: float,
        speed: float,
        temperature: float,
        axial_load: float,
        *friction: float,
        correction: Correction | None = None,
    ) -> DoubleNutState:
        """State as of evaluate() for floats that are checked; correction: of the surfaces of each nut (refine.py)."""
        clamped = [] if self.preload.lo <= (preload or abs(axial_load)) <= self.force.hi else ["preload"]
        clamped += self.outside(speed, temperature)
        relieved, loaded = self._forces_point(preload, axial_load)
        if loaded > self.force.hi:
            clamped.append("axial_load")
            loaded = self.force.hi
        elif self.oversize and relieved < HELD * loaded:
            clamped.append("axial_load")
        parameters = FrictionParameters(*friction)
        return self.evaluate_forces(relieved, loaded, speed, temperature, parameters, clamped, correction)

    def outside(self, speed: float, temperature: float) -> list[str]:
        """Which of both is beyond the map."""
        names = ["speed"] if abs(speed) > self.speed.hi else []
        return names if self.temperature.lo <= temperature <= self.temperature.hi else [*names, "temperature"]

    def evaluate_forces(
        self,
        relieved: float,
        loaded: float,
        speed: float,
        temperature: float,
        friction: FrictionParameters,
        clamped: Sequence[str] = (),
        correction: Correction | None = None,
    ) -> DoubleNutState:
        """State at forces relieved <= loaded <= end of the axis [N], checked; clamped: inputs beyond the map."""
        j, k, weights, s = self.placed(speed, temperature)
        block, nuts = self.blocks[j : j + 4, k : k + 4], []
        drag = float(weights[0].dot(self.drag[j : j + 4, k : k + 4].ravel()))
        for force in (relieved,) if loaded == relieved else (relieved, loaded):
            i, t = self.force.place(force)
            w = np.array(cubic_weights(t))
            contracted = weights.dot(block[:, :, i : i + 4].reshape(16, -1))
            # dot takes less time than @ on arrays of this size, for the same digits
            values = [w.dot(row.reshape(4, -1)).tolist() for row in contracted]
            curves = w.dot(self.curves[i : i + 4]).tolist()
            if correction is not None:
                values[0] = correction(force, values[0])
            f = force / self.force.lo if force < self.force.lo else 1.0
            slopes = values[1] if s < 1.0 else None
            torques = nut_torques(self.law, values[0], slopes, curves, drag, f, s, friction, FLOATS)
            nuts.append((torques, nut_extremes(values[0], curves, f, s, FLOATS)))
        roughness = friction.roughness_height
        return double_nut(nuts[0], nuts[-1], roughness, not clamped, tuple(clamped), FLOATS)

    def placed(self, speed: float, temperature: float) -> tuple[int, int, Array, float]:
        """Cells of a speed, sign free, and temperature; weights of 16 neighbours; speed over the lowest, up to 1."""
        axis, speed = self.speed, abs(speed)
        (j, tj), (k, tk) = axis.place(speed), self.temperature.place(temperature)
        w_k = cubic_weights(tk)
        rows = [[a * b for a in cubic_weights(tj) for b in w_k]]
        s = speed / axis.lo if speed < axis.lo else 1.0
        if s < 1.0:  # weights of the slope over ln speed
            rows.append([axis.scale * a * b for a in cubic_slopes(tj) for b in w_k])
        return j, k, np.array(rows), s

    def presliding_stiffness(self, preload: float, axial_load: float, net: float, breakaway: float) -> float:
        """Sum over both nuts of Coulomb torque at standstill over presliding_angle [N.m/rad of the screw].

        Of the loads [N] alone, so that no energy arises while speed or temperature change: by the mechanistic law
        without the shear of the raceway contacts (3 to 9 % of the Coulomb torque of the GD4008-3).
        """
        relieved, loaded = self._forces_point(preload, axial_load)
        return self.stiffness_at_forces(relieved, min(loaded, self.force.hi), net, breakaway)

    def seal_stiffness(self, seal_torque: float) -> float:
        """Presliding stiffness of the seals [N.m/rad], by the presliding angle at the highest force of the map."""
        return seal_torque / (self.presliding_angle * self.force.hi ** (1.0 / 3.0))

    def stiffness_at_forces(self, relieved: float, loaded: float, net: float, breakaway: float) -> float:
        """As presliding_stiffness at given forces of both nuts [N]; the angle grows as the contact, F^(1/3)."""
        total = 0.0
        for force in (relieved, loaded):
            if force > 0.0:
                i, t = self.force.place(force)
                columns = self.curves[:, 0], self.curves[:, 1]
                hysteresis, sliding = (math.exp(weighted(cubic_weights(t), c, i)) for c in columns)
                f = min(force / self.force.lo, 1.0)
                coulomb = hysteresis * f * f ** (1.0 / 3.0) + sliding * (net * max(breakaway, 1.0) * f)
                total += coulomb / (self.presliding_angle * force ** (1.0 / 3.0))
        return total

    def range_margin(self, point: Sequence[float], temperature_difference: float = 0.0) -> float:
        """Least distance of a point, packed.POINT, and its forces from the limits over their axes, < 0 outside."""
        preload, speed, temperature, axial_load = point
        left = 1.0
        if temperature_difference:
            left = min(
                float(self.preload_left(self.preload_factor * preload, temperature_difference)),
                1.0 - abs(temperature_difference) / MOST_DIFFERENCE,
            )
        if temperature_difference or self.preload_factor != 1.0:
            preload = self.actual_preload(preload, temperature_difference)
        highest, hottest, fastest = self.force.hi, self.temperature.hi, self.speed.hi
        held = preload or abs(axial_load)
        margin = min(
            min(held - self.preload.lo, highest - held) / (highest - self.preload.lo),
            min(temperature - self.temperature.lo, hottest - temperature) / (hottest - self.temperature.lo),
            (fastest - abs(speed)) / fastest, left,
        )  # fmt: skip
        if axial_load == 0.0:
            return margin
        relieved, loaded = self._forces_point(preload, axial_load)
        apart = (relieved - HELD * loaded) / highest if self.oversize else margin
        return min(margin, (highest - loaded) / highest, apart)

    def _forces_point(self, preload: float, axial_load: float) -> tuple[float, float]:
        """Forces of the relieved and of the loaded nut under an axial load, not clamped; preload clamped."""
        preload = min(max(preload, 0.0), self.force.hi)
        if preload == 0.0 or axial_load == 0.0:
            return preload, preload + abs(axial_load)
        relieved, loaded = self.forces_over(preload, abs(axial_load), 0 if axial_load > 0.0 else 1, FLOATS)
        return float(relieved), float(loaded)

    def forces_over(self, preload: Any, load: Any, side: Any, ops: Ops) -> tuple[Any, Any]:
        """Forces of relieved and loaded nut [N] at a preload > 0 and a load >= 0; side: 0 of a positive axial load."""
        separation, sharing = self.load_arrays if ops is ARRAYS else self.load_lists
        (p, t), shares = ops.place(self.preload, preload), self.share.last + 4
        w_p = cubic_weights(t)
        # ln(load that parts the nuts over preload); below it (force of the relieved nut over preload)^(2/3)
        ratio = weighted(w_p, separation, side * (self.preload.last + 4) + p)
        fraction = load / (preload * ops.exp(ratio))
        q, t = ops.place(self.share, fraction)
        w_q, first = cubic_weights(t), (side * (self.preload.last + 4) + p) * shares + q
        held = weighted(w_p, [weighted(w_q, sharing, first + row * shares) for row in range(4)], 0)
        relieved = ops.where(fraction < 1.0, preload * ops.most(held, 0.0) ** 1.5, 0.0)
        return relieved, relieved + load

    def _evaluate_array(self, *arguments: Array) -> DoubleNutState:
        """evaluate() for arrays of one shape, piece by piece."""
        shape, given = arguments[0].shape, [a.ravel() for a in arguments]
        pieces = [
            self._evaluate_piece(*(a[first : first + PIECE] for a in given))
            for first in range(0, max(given[0].size, 1), PIECE)
        ]
        columns: list[Any] = [
            np.concatenate(column).reshape(shape)
            for column in zip(*(piece[:-3] for piece in pieces), strict=True)
        ]
        names = tuple(name for name in POINT if any(name in piece.clamped for piece in pieces))
        return DoubleNutState._make([*columns, names, 0.0, 0.0])

    def _evaluate_piece(
        self, preload: Array, speed: Array, temperature: Array, axial_load: Array, *friction: Array
    ) -> DoubleNutState:
        highest, speed, load = self.force.hi, np.abs(speed), np.abs(axial_load)
        held = np.where(preload == 0.0, load, preload)
        outside = {
            "preload": (held < self.preload.lo) | (held > highest),
            "speed": speed > self.speed.hi,
            "temperature": (temperature < self.temperature.lo) | (temperature > self.temperature.hi),
        }
        relieved = preload = np.clip(preload, 0.0, highest)
        forces = [preload]
        if load.any():
            some = np.where(preload > 0.0, preload, 1.0)
            shared, _ = self.forces_over(some, load, np.where(axial_load > 0.0, 0, 1), ARRAYS)
            relieved = np.where((load == 0.0) | (preload == 0.0), preload, shared)
            outside["axial_load"] = relieved + load > highest
            if self.oversize:
                outside["axial_load"] |= (load > 0.0) & (relieved < HELD * (relieved + load))
            forces = [relieved, np.minimum(relieved + load, highest)]
        s, parameters = np.minimum(speed / self.speed.lo, 1.0), FrictionParameters(*friction)
        nuts = []
        for force in forces:
            slow = bool((s < 1.0).any())
            values, slopes, curves, drag = self._splines_array(force, speed, temperature, with_slopes=slow)
            f = np.minimum(force / self.force.lo, 1.0)
            torques = nut_torques(self.law, values, slopes, curves, drag, f, s, parameters, ARRAYS)
            nuts.append((torques, nut_extremes(values, curves, f, s, ARRAYS)))
        in_range = ~np.logical_or.reduce(list(outside.values()))
        names = tuple(name for name, where in outside.items() if where.any())
        return double_nut(nuts[0], nuts[-1], parameters.roughness_height, in_range, names, ARRAYS)

    def _splines_array(
        self, force: Array, speed: Array, temperature: Array, with_slopes: bool
    ) -> tuple[Array, Array | None, Array, Array]:
        """Surfaces, slopes over ln speed (or None), force curves (columns, n) and `drag` (n,) of points (n,)."""
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
        result = w_i[:, None, None] @ lines.reshape(*lines.shape[:2], 4, self.blocks.shape[-1])
        values = np.ascontiguousarray(np.moveaxis(result[:, :, 0], 0, -1))
        curves = (w_i[:, None] @ self.curves[i])[:, 0]
        drag = np.einsum("nij,nij->n", weights[:, 0], self.drag[j[:, :, None], k[:, None, :]])
        return values[0], values[1] if with_slopes else None, curves.T, drag
