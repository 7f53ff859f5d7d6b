"""Random numbers that depend only on a seed and on what they are used for."""

import numpy as np


def noise_generator(
    seed: int, sensor_name: str, purpose: int, index: int
) -> np.random.Generator:
    """Returns the random generator for one piece of a sensor's noise.

    A piece is, for example, a frame or a block of samples. Equal arguments give
    equal numbers; sensors with different names get different numbers. `purpose`
    is 0 or greater.
    """
    # Keys are never negative: pieces before time zero have other streams.
    stream = purpose if index >= 0 else 2**32 - 1 - purpose
    key = (stream, abs(index), *sensor_name.encode())
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
