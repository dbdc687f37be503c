"""Share of the load of a lubricated contact that the asperities of its surfaces carry."""

from __future__ import annotations

from typing import Any

import numpy as np

from .bounds import needs_not_negative, needs_positive


def asperity_share(film: Any, sigma: float, film_ratio: float) -> Any:
    """Share f of the load on asperities, exp(-(h/(L_0 sigma))^2).

    Parameters   film: h, central film of the smooth contact [m], > 0, float or array;  sigma: composite rms roughness
                 [m], >= 0, 0 is a smooth contact;  film_ratio: L_0, h/sigma where 1/e of the load is on asperities
    Returns      0 to 1, shaped like film
    Raises       ValueError: out of these bounds
    Source       form: assumption, between the sources. At h/sigma = 0.5 Greenwood & Tripp (1970) with the constants of
                 open programs give 0.03 (L_0 0.27), Balan et al. (2015), Eq. A2, 0.33 (0.475), the mixed-film
                 weighting factor of SKF with sigma = 0.2 um 0.39 (0.5), at eight bearings exp(-1.4 (h/sigma)^1.7)
                 within a factor 1.5 (0.85)
    Example
        >>> asperity_share(np.array([1e-9, 1e-7, 6e-7]), 2e-7, 0.5).round(3).tolist()
        [1.0, 0.368, 0.0]
    """
    needs_positive(film=film, film_ratio=film_ratio)
    needs_not_negative(sigma=sigma)
    if sigma == 0.0:
        return np.zeros(np.shape(film))[()]
    return np.exp(-((np.asarray(film) / (film_ratio * sigma)) ** 2))
