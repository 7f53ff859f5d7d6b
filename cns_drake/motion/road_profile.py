"""The roughness of roads: random heights of a class in ISO 8608."""

import math
from typing import Literal

import numpy as np

RoughnessClass = Literal["A", "B", "C", "D", "E"]

# Class -> one-sided power spectral density of the heights along a line, at the
# spatial frequency _N0 [m^3]. These are the geometric means of ISO 8608.
ROUGHNESS: dict[str, float] = {
    name: math.ldexp(16e-6, 2 * k) for k, name in enumerate("ABCDE")
}
_N0 = 0.1  # [cycles/m]

# Spacings of the layers' lattices [m]. The sum of the layers has the spectrum
# of the class for wavelengths from 0.35 to 90 m. Longer waves, which are hills,
# are no stronger than waves of 90 m. Shorter waves than 0.35 m are smoothed by
# the tyre.
_SPACINGS = np.ldexp(0.05, np.arange(10))
# The finest layer also stands for all layers that would be finer: this is the
# sum of the geometric series 1 + 1/4 + 1/16 + ...
_FINEST_SHARE = 4.0 / 3.0
# Number of nodes in each direction after which a lattice repeats.
_NODES = 512

# Integral of sinc(x)^8 from -inf to inf: the B-spline of degree 7 at 0.
_SINC8_INTEGRAL = 151.0 / 315.0
# Integral of x sinc(x)^8 from 0 to inf.
_X_SINC8_INTEGRAL = 0.03611499185872766


class RoadProfile:
    """Random unevenness of road surfaces, determined by place and seed.

    Along any line, the heights have the power spectral density of ISO 8608,
    G_d(n) = G_d(n0) (n / n0)^-2, with ripples of 1.5 %, for wavelengths 1 / n
    from 0.35 to 90 m. Here n is the spatial frequency [1/m], n0 = 0.1 / m, and
    G_d(n0) depends on the roughness class.
    """

    # The heights are a sum of layers. A layer is a cubic B-spline over a square
    # lattice; its coefficients are independent and normally distributed with
    # the variance s^2. The spectrum of a layer with the spacing h is nearly
    # 2 s^2 h sinc(n h)^8 151/315 along any line: flat up to n = 0.2 / h, and
    # then falling steeply. From layer to layer, h doubles and s^2 grows in
    # proportion to h. The spectra's levels therefore grow like h^2, and the
    # spectrum of the sum falls like n^-2.
    #
    # Each lattice is rotated and shifted at random, so that no street runs
    # along all lattices. A layer repeats after 512 nodes; this shows only on a
    # street along the layer's lattice.

    def __init__(self, roughness: RoughnessClass, seed: int):
        """Sets the roughness class, and the seed of all random numbers."""
        self._level = (
            ROUGHNESS[roughness] * _N0**2 * math.log(2) / _X_SINC8_INTEGRAL
        )
        self._seed = seed

    def heights(self, p_WQset: np.ndarray) -> np.ndarray:
        """Returns the heights (N,) of the surface at places (N, 2) in W [m].

        Each call samples the coefficients of all layers again, with the same
        seed. Equal places therefore have equal heights.
        """
        # This import is slow, and not needed to describe a scenario.
        from scipy.ndimage import map_coordinates

        heights = np.zeros(len(p_WQset))
        for layer, spacing in enumerate(_SPACINGS):
            rng = np.random.default_rng([self._seed, layer])
            share = _FINEST_SHARE if layer == 0 else 1.0
            variance = share * self._level * spacing / (2.0 * _SINC8_INTEGRAL)
            nodes = rng.normal(0.0, np.sqrt(variance), (_NODES, _NODES))
            angle, *shift = rng.uniform(0.0, 1.0, 3)
            c, s = math.cos(2 * np.pi * angle), math.sin(2 * np.pi * angle)
            x, y = p_WQset.T / spacing
            places = np.stack([c * x - s * y, s * x + c * y])
            places += np.array(shift)[:, None] * _NODES
            heights += map_coordinates(
                nodes, places % _NODES, mode="grid-wrap", prefilter=False
            )
        return heights
