"""Random numbers that depend only on a seed and on what they are used for."""

import numpy as np


def check_seed(seed: int) -> None:
    """Checks that a value can be the seed of a sensor's noise.

    Raises:
        ValueError: it is negative.
    """
    if seed < 0:
        raise ValueError(f"seed: {seed!r} is not an integer from 0 on")


def noise_generator(
    seed: int, sensor_name: str, purpose: int, index: int
) -> np.random.Generator:
    """Returns the random generator for one part of a sensor's noise.

    A part is the noise of a frame or of a block of samples, for example;
    `index` is the number of the part. `purpose` (0 or greater) distinguishes
    different kinds of noise. Equal arguments give equal numbers; sensors with
    different names get different numbers.
    """
    # Keys are never negative: pieces before time zero have other streams.
    stream = purpose if index >= 0 else 2**32 - 1 - purpose
    key = (stream, abs(index), *sensor_name.encode())
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
