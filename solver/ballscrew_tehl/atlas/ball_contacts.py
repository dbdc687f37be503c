"""Contacts of the balls of one screw, read from the atlas: what the friction law and a map take."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..numerics import Array
from ..parameters.file import Parameters
from ..physics.hertz import RACEWAYS
from ..physics.load import load_nodes
from ..physics.lubricant import eta0
from .contact_atlas import ContactAtlas, load_atlas, refuse_groups, refuse_laws
from .groups import (
    QUANTITIES,
    RollingContacts,
    closed_forms,
    rolling_contacts,
    stretched,
    transition,
    unmodelled,
)

#: nodes over load (speed eta0)^-SLOPE, on which the transition of contacts depends, and over ln(speed eta0); nodes over
#: temperature for each e-fold of the viscosity, for N changes by as much. Between them the atlas is read by cubic
#: splines for one screw: five screws, 6,000 points, 99 % within 0.3 % of film and rolling loss and 0.5 % of the core.
#: With seven temperatures a screw down to -10 C missed hot losses by up to 5 %
TABLE_NODES, SLOPE, OF_VISCOSITY = (49, 33), 0.75 - 0.45 * 0.25, 2.0
MIN_TEMPERATURES = 4  # fewest temperatures: cubic splines need four
BEYOND = 0.7  # ln of loads beyond their range at the corners of the table, which no ball has


class BallRange(NamedTuple):
    """Lowest and highest ball load [N], speed [rad/s] and temperature [K]; nodes of the table over the first two."""

    load: tuple[float, float]
    speed: tuple[float, float]
    temperature: tuple[float, float]
    nodes: tuple[int, int] = TABLE_NODES


class BallContacts:
    """Contacts of the balls of a screw in pure rolling (friction.mechanistic.ContactValues).

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    table : BallRange, optional
        Range over which values are read between nodes, for many points; None: every point by itself.
    atlas : ContactAtlas, optional
        None: the packaged one.

    Raises
    ------
    OutsideAtlasError
        Oil, geometry or bodies that the atlas does not include.

    Examples
    --------
    >>> import numpy as np
    >>> from ballscrew_tehl import load_screw
    >>> contacts = BallContacts(load_screw("gd4008_vg100.toml"))
    >>> film = contacts.at("screw", np.array([40.0]), np.array([104.7]), np.array([303.15]))["central_film"]
    >>> f"{1e6 * film[0]:.2f} um"
    '0.51 um'
    """

    def __init__(
        self, parameters: Parameters, table: BallRange | None = None, atlas: ContactAtlas | None = None
    ) -> None:
        refuse_laws(parameters)
        self.parameters, self.table, self.atlas = parameters, table, atlas or load_atlas()
        #: by raceway, and by raceway, speeds and temperatures: knots of each axis, coefficients of cubic splines
        self._tables: dict[str, tuple[list[Array], Array]] = {}
        self._lines: dict[tuple[str, bytes, bytes], tuple[Array, Array]] = {}
        point = np.array([[1.0], [1.0], [parameters.lubricant.reference_temperature]])
        for raceway in RACEWAYS:
            refuse_groups(self.atlas, closed_forms(self.contacts(raceway, *point)).groups)

    def contacts(self, raceway: str, load: Any, speed: Any, temperature: Any) -> RollingContacts:
        """Contacts at ball loads [N], screw speeds [rad/s] and temperatures [K], which broadcast."""
        return rolling_contacts(self.parameters, raceway, load, speed, temperature)

    def at(self, raceway: str, load: Any, speed: Any, temperature: Any) -> dict[str, Array]:
        """Quantities (SI) at operating points, which broadcast, from the atlas."""
        forms = closed_forms(self.contacts(raceway, load, speed, temperature))
        return unmodelled(self.atlas.interpolated(forms), forms.values)

    def _table_of(self, raceway: str) -> tuple[list[Array], Array]:
        """The atlas at nodes over load and speed, both at equal viscosity, and temperature, quantities last."""
        assert self.table is not None
        oil, (loads, speeds, temperatures, nodes_of) = self.parameters.lubricant, self.table
        light, heavy = np.log(loads)
        thinning = math.log(eta0(oil, temperatures[0]) / eta0(oil, temperatures[1]))
        warm = np.linspace(*temperatures, max(math.ceil(OF_VISCOSITY * thinning), MIN_TEMPERATURES))
        thin, thickest = math.log(speeds[0] * eta0(oil, warm[-1])), math.log(speeds[1] * eta0(oil, warm[0]))
        thick = np.linspace(thin, thickest, nodes_of[1])
        fine = np.linspace(light - SLOPE * thick[-1], heavy - SLOPE * thick[0], 2001)
        centre = 0.5 * (light + heavy), thick.mean(), warm.mean()
        at = np.exp(centre[0]), np.exp(centre[1]) / eta0(oil, centre[2]), centre[2]
        turn = transition(closed_forms(self.contacts(raceway, *at)).groups)
        even = stretched(fine - (centre[0] - SLOPE * centre[1]) + turn)
        place = np.interp(np.linspace(even[0], even[-1], nodes_of[0]), even, fine)
        nodes = place, thick, warm
        place, thick, warm = np.meshgrid(*nodes, indexing="ij", sparse=True)
        load = np.exp(np.clip(place + SLOPE * thick, light - BEYOND, heavy + BEYOND))
        speed = np.exp(thick) / eta0(oil, warm)
        result = self.atlas.interpolated(closed_forms(self.contacts(raceway, load, speed, warm)))
        coefficients, knots = np.stack(list(result.values()), axis=-1), []
        for axis, own in enumerate(nodes):
            own_knots, coefficients = cubic_spline(own, coefficients, axis)
            knots.append(own_knots)
        return knots, coefficients

    def _over_load(self, raceway: str, speed: Array, temperature: Array) -> tuple[Array, Array]:
        """The table at speeds (s, 1) and temperatures (t,): knots over load, coefficients (s, t, load, quantity)."""
        key = raceway, speed.tobytes(), temperature.tobytes()
        if key not in self._lines:
            if raceway not in self._tables:
                self._tables[raceway] = self._table_of(raceway)
            (place, *knots), table = self._tables[raceway]
            j, w_j = cubic_basis(knots[0], np.log(speed * eta0(self.parameters.lubricant, temperature)))
            k, w_k = cubic_basis(knots[1], temperature)
            rows = np.moveaxis(table, 2, 0)
            warm = np.asarray(sum(w_k[:, a, None, None, None] * rows[k + a] for a in range(4)))
            t = np.arange(len(temperature))
            lines = np.asarray(sum(w_j[..., a, None, None] * warm[t, :, j + a] for a in range(4)))
            self._lines[key] = place, lines
        return self._lines[key]

    def _from_table(self, raceway: str, load: Array, speed: Array, temperature: Array) -> Array:
        """Interpolated quantities (k, s, t, quantity) at loads (k, 1, 1), speeds (s, 1) and temperatures (t,)."""
        knots, lines = self._over_load(raceway, speed, temperature)
        thick = np.log(speed * eta0(self.parameters.lubricant, temperature))
        i, w_i = cubic_basis(knots, np.log(load) - SLOPE * thick)
        s, t = np.indices(thick.shape)
        return np.asarray(sum(w_i[..., a, None] * lines[s, t, i + a] for a in range(4)))

    def inside(self, raceway: str, load: Any, speed: Any, temperature: Any) -> NDArray[np.bool_]:
        """Which operating points lie within the range of every group of the atlas."""
        return self.atlas.inside(closed_forms(self.contacts(raceway, load, speed, temperature)).groups)

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, s, t) at the ball loads of a nut (n,), speeds (s, 1) and temperatures (t,)."""
        # the loads of one nut lie close together: over them by the polynomial through Chebyshev nodes
        nodes, weights = load_nodes(load)
        at = nodes[:, None, None], speed.reshape(-1, 1), temperature
        if self.table is None:
            result = self.at(raceway, *at)
        else:
            read = np.moveaxis(self._from_table(raceway, *at), -1, 0)
            closed = closed_forms(self.contacts(raceway, *at)).values
            result = unmodelled(dict(zip(QUANTITIES, read, strict=True)), closed)
        shape = len(load), speed.size, len(temperature)
        return {
            # a mean rise may be none or negative
            name: (weights @ of if name == "mean_rise" else np.exp(weights @ np.log(of))).reshape(shape)
            for name, values in result.items()
            for of in (np.broadcast_to(values, (nodes.size, *shape[1:])).reshape(nodes.size, -1),)
        }


def cubic_basis(knots: Array, x: Array) -> tuple[NDArray[np.int64], Array]:
    """First coefficient of the four cubic B-splines that live at points x (...), and their values (..., 4).

    Source: de Boor, A Practical Guide to Splines, rev. ed. 2001, chapter X: recurrence of Cox and de Boor
    """
    cell = np.clip(np.searchsorted(knots, x, side="right") - 1, 3, len(knots) - 5)
    values = np.ones((*np.shape(x), 1))
    for degree in (1, 2, 3):
        steps = np.arange(degree)
        left, right = knots[cell[..., None] + 1 - degree + steps], knots[cell[..., None] + 1 + steps]
        part = values / (right - left)
        values = np.zeros((*np.shape(x), degree + 1))
        values[..., :-1] = part * (right - x[..., None])
        values[..., 1:] += part * (x[..., None] - left)
    return cell - 3, values


def cubic_spline(nodes: Array, values: Array, axis: int) -> tuple[Array, Array]:
    """Knots and coefficients of the not-a-knot cubic spline through values at four or more nodes along an axis."""
    knots = np.concatenate([[nodes[0]] * 4, nodes[2:-2], [nodes[-1]] * 4])
    first, weights = cubic_basis(knots, nodes)
    collocation = np.zeros((nodes.size, nodes.size))
    collocation[np.arange(nodes.size)[:, None], first[:, None] + np.arange(4)] = weights
    rows = np.moveaxis(values, axis, 0)
    solved = np.asarray(np.linalg.solve(collocation, rows.reshape(nodes.size, -1)), dtype=float)
    return knots, np.moveaxis(solved.reshape(rows.shape), 0, axis)
