"""Random numbers that depend on a seed and their place alone."""

from __future__ import annotations

import numpy as np


def noise_generator(
    seed: int, sensor_name: str, purpose: int, index: int
) -> np.random.Generator:
    """Returns the generator of one frame, block or other piece of noise.

    The same arguments give the same numbers, whatever was drawn before.

    Args:
        seed: of a recording.
        sensor_name: makes the noise of one sensor differ from another's.
        purpose: what the numbers are for, at least 0.
        index: of the piece.
    """
    # Keys are never negative: the pieces before time zero have streams of
    # their own.
    stream = purpose if index >= 0 else 2**32 - 1 - purpose
    key = (stream, abs(index), *sensor_name.encode())
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
