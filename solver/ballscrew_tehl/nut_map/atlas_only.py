"""Contacts of balls from the packaged atlas alone: what a map takes before it has solved contacts of its own."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..friction.mechanistic import QUANTITIES
from ..parameters.file import Parameters
from ..physics.hertz import RACEWAYS
from ..physics.load import load_nodes
from ..refinement.direct import DirectContacts
from .atlas import Atlas, atlas_quantities, ball_groups, load_atlas
from .contact_map import ContactMap, ContactModel, MapContacts
from .contacts import MAPPED, Array, ContactRange, SolvedContacts

#: no contact, and no bound: the atlas has its own
NOTHING = SolvedContacts(np.empty((0, 3)), {name: np.empty(0) for name in MAPPED})
EVERYWHERE = ContactRange((0.0, np.inf), (0.0, np.inf), (0.0, np.inf), 0.0)


class _BallAtlas:
    """The atlas at the contacts of one raceway, each by itself: without the table of a ScrewAtlas."""

    def __init__(self, atlas: Atlas, parameters: Parameters, raceway: str) -> None:
        self.atlas, self.parameters, self.raceway = atlas, parameters, raceway
        self.quantities = atlas_quantities(parameters)

    def __call__(self, name: str, points: Array) -> Array:
        return self.atlas.of_ball(name, ball_groups(self.parameters, self.raceway, points))

    def inside(self, points: Array) -> Array:
        return self.atlas.inside(ball_groups(self.parameters, self.raceway, points))


class _AtlasModel(ContactModel):
    """A raceway of which nothing was solved."""

    interpolated = ()


class _AtlasMap(ContactMap):
    """A contact map without contacts."""

    @cached_property
    def models(self) -> dict[str, ContactModel]:
        return {
            raceway: _AtlasModel(self.parameters, raceway, self.range, NOTHING, None, atlas)  # type: ignore[arg-type]
            for raceway in RACEWAYS
            if (atlas := _BallAtlas(load_atlas(), self.parameters, raceway))
        }


class AtlasContacts:
    """Contacts of the mechanistic law from the atlas (friction.mechanistic.ContactValues), solved where it has none.

    Validity     the certificate of a screw's map does not hold: films of the atlas are good to about 1 %
    """

    name = MapContacts.name

    def __init__(self, parameters: Parameters) -> None:
        self._map = _AtlasMap(parameters, EVERYWHERE, dict.fromkeys(RACEWAYS, NOTHING))
        self._from_atlas, self._solved = MapContacts(self._map), DirectContacts(parameters)

    def inside(self, raceway: str, load: Array, speed: Array, temperature: Array) -> bool:
        """Whether the atlas holds all contacts at ball loads (n,), speeds (s, 1) and temperatures (t,)."""
        atlas = self._map.models[raceway].atlas
        axes = load_nodes(load)[0], speed.ravel(), temperature
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return bool(
            atlas is not None
            and set(QUANTITIES) <= set(atlas.quantities)
            and atlas.inside(points.reshape(-1, 3)).all()
        )

    def value(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """A quantity (n, s, t) at ball loads (n,), speeds (s, 1) and temperatures (t,); outside at a single point.

        Raises       UnconvergedContactError: a contact outside the atlas that did not converge
        """
        source = self._from_atlas if self.inside(raceway, load, speed, temperature) else self._solved
        return source.value(raceway, name, load, speed, temperature)
