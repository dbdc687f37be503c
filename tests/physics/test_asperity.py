"""Share of the load on asperities in its limits."""

import numpy as np

from ballscrew_tehl.physics.asperity import asperity_share


def test_share_falls_from_all_without_a_film_to_nothing_in_a_thick_one():
    film = 2e-7 * np.geomspace(1e-9, 10.0, 200)
    share = asperity_share(film, 2e-7, 0.5)
    assert np.all(np.diff(share) <= 0.0)
    assert abs(share[0] - 1.0) <= 1e-12
    assert np.max(share[film >= 3.0 * 2e-7]) <= 0.01
    assert np.all(asperity_share(film, 0.0, 0.5) == 0.0)
