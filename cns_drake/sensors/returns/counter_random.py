"""Random numbers by what they are for, without a stream that runs on.

A number depends on a key, a beam and the number of the draw alone. Neither
the other beams nor the order of the work changes it.
"""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled

# Room for the draws of one beam.
DRAWS_PER_BEAM = 256
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_UNIT = 2.0**-53


def frame_key(seed: int, sensor_name: str, frame: int) -> np.uint64:
    """Returns the key of one frame of one sensor."""
    # A spawn key holds no negative numbers; frames before time zero do exist.
    spawn_key = (2 * abs(frame) + (frame < 0), *sensor_name.encode())
    sequence = np.random.SeedSequence(seed, spawn_key=spawn_key)
    return sequence.generate_state(1, np.uint64)[0]


@compiled
def uniform(key: np.uint64, beam: int, draw: int) -> float:
    """Returns a number that is uniform over [0, 1).

    SplitMix64 (Steele, Lea and Flood, OOPSLA 2014), asked for its n-th number.

    Args:
        key: see `frame_key`.
        beam: 0 <= beam.
        draw: 0 <= draw < `DRAWS_PER_BEAM`.
    """
    number = np.uint64(beam * DRAWS_PER_BEAM + draw + 1)
    z = np.uint64(key) + number * _GOLDEN
    z = (z ^ (z >> np.uint64(30))) * _MIX_1
    z = (z ^ (z >> np.uint64(27))) * _MIX_2
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * _UNIT


@compiled
def normal(key: np.uint64, beam: int, draw: int) -> float:
    """Returns a standard normal number (Box and Muller, 1958).

    Args:
        key: see `frame_key`.
        beam: 0 <= beam.
        draw: takes this draw and the next one.
    """
    radius = np.sqrt(-2.0 * np.log(1.0 - uniform(key, beam, draw)))
    return radius * np.cos(2.0 * np.pi * uniform(key, beam, draw + 1))
