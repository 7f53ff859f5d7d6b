"""Random numbers of road users, without the state of a generator.

A number depends only on the seed, the road user and the number of the draw.
"""

import numpy as np

from cns_drake.base import compiled


@compiled
def uniform(seed: int, who: int, draw: int) -> float:
    """Returns the `draw`-th random number of a road user, from 0 to 1.

    The number is the result of SplitMix64's finalizer (Steele, Lea, Flood,
    OOPSLA 2014) for the seed, the number `who` of the road user, and `draw`.
    """
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15)
    z += np.uint64(who) * np.uint64(0xD1B54A32D192ED03)
    z += np.uint64(draw) * np.uint64(0x8CB92BA72F3D8DD7)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) / 9007199254740992.0
