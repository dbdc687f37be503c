"""An atlas of contacts in closed form: what is interpolated is a smooth function of the coordinates."""

import math
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from atlas_builder import contacts as chosen
from atlas_builder.contacts import VALUES
from atlas_builder.fit import FIRST, interpolant_of, save_atlas, table_of
from ballscrew_tehl.atlas.contact_atlas import load_atlas
from ballscrew_tehl.atlas.groups import (
    QUANTITIES,
    RollingContacts,
    closed_forms,
    coordinates,
    unmodelled,
    wall_group,
)

COUNT, POOL_SCREWS = 300, 60


def interpolated(groups):
    """What is interpolated of every quantity, as groups.modelled gives it."""
    x = coordinates(groups).T / FIRST[:, None]
    found = {name: 0.1 * np.sin(x[0] + k) + 0.02 * x[1] * x[5] for k, name in enumerate(QUANTITIES)}
    return found | {"minimum_film": found["minimum_film"] - 0.5}


def rolling(contact):
    """A contact of atlas_builder.screws as arrays of one."""
    c = contact.conditions
    at = (np.array([value]) for value in (c.load, c.R_x, c.R_y, c.u_e, c.temperature))
    return RollingContacts(*at, c.E_prime, contact.oil, wall_group(contact.solids))


def closed_contact(contact):
    """In place of atlas_builder.contacts.solve_contact."""
    forms = closed_forms(rolling(contact))
    values = [float(v[0]) for v in unmodelled(interpolated(forms.groups), forms.values).values()]
    return dict(zip(VALUES, [*values, 0.0, 257.0], strict=True))


def few_contacts(count=COUNT):
    """The first contacts of the atlas from a small pool."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chosen, "POOL_SCREWS", POOL_SCREWS)
        return chosen.atlas_contacts(count)


contacts = cache(few_contacts)


def saved(path, contacts, results):
    """The file of an atlas, without a search of lengths."""
    table = table_of(contacts, results)
    level = np.full(len(QUANTITIES), 1e-4)
    interpolant, _ = interpolant_of(coordinates(table.groups), table.values, table.noise, FIRST, level)
    save_atlas(path, table, FIRST, interpolant, {"certificate": {"what": "closed forms", "points": 0}})
    return path


@cache
def atlas_bytes():
    """The file of the atlas of all contacts."""
    with tempfile.TemporaryDirectory() as folder:
        path = saved(Path(folder) / "atlas.npz", contacts(), [closed_contact(one) for one in contacts()])
        return path.read_bytes()


@cache
def atlas():
    """The atlas, read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "atlas.npz"
        path.write_bytes(atlas_bytes())
        return load_atlas(path)


def missed(found, expected):
    """Largest relative difference of quantities by name; of the mean rise over the rise."""
    scale = expected | {"mean_rise": np.abs(expected["temperature_rise"]) + 1.0}
    return {name: float(np.max(np.abs(found[name] - expected[name]) / np.abs(scale[name]))) for name in found}


def nothing_missed(found, expected, share):
    """Whether every quantity is within a share."""
    return all(math.isfinite(error) and error <= share for error in missed(found, expected).values())
