"""Random numbers that depend only on a seed and their place."""

import numpy as np


def noise_generator(
    seed: int, sensor_name: str, purpose: int, index: int
) -> np.random.Generator:
    """Returns the random generator for one piece of a sensor's noise.

    A piece is a frame or a block, for example. The same arguments always give
    the same numbers. Different names give different sensors different
    numbers. The number of a purpose is at least 0.
    """
    # Keys are never negative: pieces before time zero have other streams.
    stream = purpose if index >= 0 else 2**32 - 1 - purpose
    key = (stream, abs(index), *sensor_name.encode())
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
