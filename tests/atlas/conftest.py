"""The synthetic atlas, made once."""

import pytest
from synthetic_atlas import closed_contact, few_contacts, saved

from ballscrew_tehl.atlas.contact_atlas import load_atlas


@pytest.fixture(scope="session")
def contacts():
    """Contacts of random screws."""
    with pytest.MonkeyPatch.context() as patch:
        return few_contacts(patch)


@pytest.fixture(scope="session")
def atlas_file(contacts, tmp_path_factory):
    path = tmp_path_factory.mktemp("atlas") / "atlas.npz"
    return saved(path, contacts, [closed_contact(contact) for contact in contacts])


@pytest.fixture(scope="session")
def atlas(atlas_file):
    return load_atlas(atlas_file)
