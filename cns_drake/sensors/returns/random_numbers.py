"""Random numbers of beams and of places, without the state of a generator.

The random number of a beam depends only on a key, the beam and the number's
index among the numbers of this beam. The random number of a place depends only
on the cell of a grid in which the place lies. Neither depends on the order of
computation.
"""

import numpy as np

from evaluation.base import compiled

# Room for the draws of one beam.
DRAWS_PER_BEAM = 256
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
# Distance between two random numbers from 0 to 1.
_UNIT = 2.0**-53


def frame_key(seed: int, sensor_name: str, frame: int) -> np.uint64:
    """Returns the key of a sensor's random numbers in one frame.

    `cns_drake.sensors.returns.random_numbers.uniform` and `normal` take this
    key.
    """
    # A spawn key holds no negative numbers; frames before time zero do exist.
    spawn_key = (2 * abs(frame) + (frame < 0), *sensor_name.encode())
    seeds = np.random.SeedSequence(seed, spawn_key=spawn_key)
    return seeds.generate_state(1, np.uint64)[0]


@compiled
def uniform(
    key: np.uint64, beam: np.ndarray, draw: int | np.ndarray
) -> np.ndarray:
    """Returns random numbers that are uniform over [0, 1).

    Equal arguments give equal numbers. The generator is SplitMix64 (Steele, Lea
    and Flood, OOPSLA 2014).

    Args:
        key: key of a frame, from `frame_key`.
        beam: (N,) beams, 0 or greater.
        draw: number of the draw, one or (N,), from 0 to `DRAWS_PER_BEAM` - 1.
            Different draws of a beam are independent.
    """
    number = (beam * DRAWS_PER_BEAM + (draw + 1)).astype(np.uint64)
    z = key + number * _GOLDEN
    z = (z ^ (z >> np.uint64(30))) * _MIX_1
    z = (z ^ (z >> np.uint64(27))) * _MIX_2
    z = z ^ (z >> np.uint64(31))
    return (z >> np.uint64(11)).astype(np.float64) * _UNIT


@compiled
def normal(
    key: np.uint64, beam: np.ndarray, draw: int | np.ndarray
) -> np.ndarray:
    """Returns standard normal random numbers.

    The random numbers are the normal quantiles of uniform numbers, computed
    with PPND7, the short form of AS 241 (Wichura, Applied Statistics 37, 1988),
    which is exact to seven digits.

    The arguments are as for `cns_drake.sensors.returns.random_numbers.uniform`.
    """
    result = uniform(key, beam, draw)
    for k, u in enumerate(result):
        q = u - 0.5
        if abs(q) <= 0.425:
            r = 0.180625 - q * q
            above = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r
            below = ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r
            result[k] = q * (above + 3.3871327179) / (below + 1.0)
            continue
        # The argument must not be 0: values below the smallest step become half
        # a step.
        r = np.sqrt(-np.log(max(min(u, 1.0 - u), 0.5 * _UNIT)))
        if r <= 5.0:
            r -= 1.6
            above = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r
            below = (0.12021132975 * r + 0.73700164250) * r
            size = (above + 1.4234372777) / (below + 1.0)
        else:
            r -= 5.0
            above = (
                (0.017337203997 * r + 0.42868294337) * r + 3.0812263860
            ) * r
            below = (0.012258202635 * r + 0.24197894225) * r
            size = (above + 6.6579051150) / (below + 1.0)
        result[k] = np.copysign(size, q)
    return result


@compiled
def cell_number(a: float, b: float, c: float) -> float:
    """Returns a random number from -1 to 1 that depends on a cell of a grid.

    All points (a, b, c) with the same integer parts give the same number.
    """
    z = (
        np.uint64(np.int64(np.floor(a))) * np.uint64(0x9E3779B97F4A7C15)
        ^ np.uint64(np.int64(np.floor(b))) * np.uint64(0xC2B2AE3D27D4EB4F)
        ^ np.uint64(np.int64(np.floor(c))) * np.uint64(0x165667B19E3779F9)
    )
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    return (
        np.float64((z ^ (z >> np.uint64(27))) >> np.uint64(11)) * 2.0**-52 - 1
    )
