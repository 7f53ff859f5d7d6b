"""How a driver departs from the line of a route or of waypoints.

The paths of two people who drive along the same route differ by about half a
metre over stretches of some 50 m, and sometimes by a lane. Here, the offset
from the line is an Ornstein-Uhlenbeck process over the distance, smoothed so
that a car can follow it. Lane changes are added to this offset.
"""

import math

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from worlds.shapes.paths.car_outline import (
    FRONT,
    HALF_WIDTH,
    REAR,
    car_outlines,
    directions,
)
from worlds.shapes.paths.lane_path import (
    LanePath,
    sample_lane_path,
    smooth_step,
)

# Distance between the points of the path that `driven_path` needs [m].
FINE_SPACING = 0.5
# Least length of an episode in another lane [m].
SHORTEST_EPISODE = 15.0
# Greatest length of an episode in another lane [m].
LONGEST_EPISODE = 270.0
# Length of a change from one lane to the other [m].
_LANE_CHANGE_LENGTH = 80.0
# Greatest offset of the car from its line [m]: the room on each side of a car
# in the middle of a lane of 3.5 m.
_MOST_OFFSET = 0.8
# Least distance of the car from kerbs and other obstacles [m].
_CLEARANCE = 0.3
# The smoothed path may fall short of this distance by so much [m].
_SMOOTHING_SLACK = 0.1
# Offsets that are tried [m].
_TRIED_OFFSETS = np.linspace(-_MOST_OFFSET, _MOST_OFFSET, 33)
# Offsets are tried at every fourth point of the path.
_CHECK_STRIDE = 4
# Half the length over which the offset is smoothed [m].
_SMOOTHING_REACH = 20.0
# After this many iterations the error is below 1e-9 for all lengths in
# scenarios.
_ITERATIONS = 40


def kerbs(lane_area: BaseGeometry) -> STRtree:
    """Returns an index of the edges of lanes, divided into short pieces.

    The edges are kerbs, medians and parking bays. Each piece is a line of a few
    metres.
    """
    outline = np.asarray(shapely.get_parts(lane_area.boundary))
    corners, line = shapely.get_coordinates(outline, return_index=True)
    pairs = np.stack([corners[:-1], corners[1:]], axis=1)
    return STRtree(shapely.linestrings(pairs[line[:-1] == line[1:]]))


def obstacle_points(xy: np.ndarray) -> STRtree:
    """Returns an index of the points (N, 2) of obstacles [m]."""
    return STRtree(np.asarray(shapely.points(xy)))


def driven_path(
    path: LanePath,
    spacing: float,
    obstacles: STRtree,
    source: object,
    *,
    wander: float,
    wander_length: float,
    lane_changes: float,
    rng: np.random.Generator,
) -> LanePath:
    """Returns the path of a driver who wanders and changes lanes.

    The car, including its mirrors, keeps 0.3 m from all obstacles, as seen from
    above. Where this is not possible, the car stays on `path`.

    Args:
        path: the path of a driver who neither wanders nor changes lanes, with
            points every `FINE_SPACING`.
        spacing: distance between the points of the result [m].
        obstacles: index of the edges of obstacles, such as kerbs and walls.
        source: text with which error messages begin.
        wander: standard deviation of the offset in the lane [m].
        wander_length: distance after which the correlation of the offset is 1/e
            [m].
        lane_changes: number of changes to another lane and back per km.
        rng: random generator for all decisions of the driver.

    Raises:
        InputError: the path is too short or too long for a drive.
    """
    lane_rng, wander_rng = rng.spawn(2)
    points = path.points
    if lane_changes:
        points = _change_lanes(path, obstacles, lane_changes, lane_rng)
    if wander:
        low, high = _offset_bounds(points, obstacles)
        offset = _draw_offsets(low, high, wander, wander_length, wander_rng)
        points = _points_beside(points, points, offset)
    return sample_lane_path(points, path.speed_limits, spacing, source)


def _points_beside(
    points: np.ndarray, line: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    """Returns points (N, 3), moved to the left of a line (N, 3) by offsets."""
    along = directions(line[:, :2])
    left = np.column_stack([-along[:, 1], along[:, 0]])
    xy = points[:, :2] + offset[:, None] * left
    return np.column_stack([xy, points[:, 2]])


def _has_room(
    points: np.ndarray, offsets: np.ndarray, obstacles: STRtree
) -> np.ndarray:
    """Returns (N, K) bool: whether a car has room at offsets from points.

    Args:
        points: (N, 3) points of a path [m].
        offsets: (K,) distances to the left of the path [m].
        obstacles: index of the edges of obstacles.
    """
    along = directions(points[:, :2])[:, None]
    left = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    middle = points[:, None, :2] + offsets[:, None] * left
    corners = car_outlines(middle, along, REAR, FRONT, HALF_WIDTH)
    cars = np.asarray(shapely.polygons(corners)).ravel()
    hit, _ = obstacles.query(cars, "dwithin", _CLEARANCE + _SMOOTHING_SLACK)
    free = np.ones(len(cars), dtype=bool)
    free[hit] = False
    return free.reshape(middle.shape[:2])


def _change_lanes(
    path: LanePath, obstacles: STRtree, rate: float, rng: np.random.Generator
) -> np.ndarray:
    """Returns the points (N, 3) of the path with changes of lane [m].

    An episode lasts from the middle of the change to the other lane to the
    middle of the change back. The logarithm of the episode's length is sampled
    uniformly, and the episode is cut off where the other lane ends. In a short
    episode the car does not reach the other lane, as if it avoided an obstacle.
    """
    assert path.beside is not None  # Only routes have lanes.
    s = path.spacing * np.arange(len(path.points))
    points = path.points
    half = _LANE_CHANGE_LENGTH / 2
    ratio = math.log(LONGEST_EPISODE / SHORTEST_EPISODE)
    done = 0.0
    while True:
        done += 1000.0 / rate * float(rng.standard_exponential())
        length = SHORTEST_EPISODE * math.exp(ratio * float(rng.random()))
        first_side = int(rng.integers(2))
        if done > s[-1]:
            return points
        for side in (first_side, 1 - first_side):
            run = _constant_stretch(
                path.beside[:, side], int(done / path.spacing)
            )
            begin = max(done, s[run.start] + half)
            end = min(begin + length, s[run.stop - 1] - half)
            if end - begin < SHORTEST_EPISODE:
                continue
            share = smooth_step(
                np.clip((s - begin) / _LANE_CHANGE_LENGTH + 0.5, 0.0, 1.0)
            ) - smooth_step(
                np.clip((s - end) / _LANE_CHANGE_LENGTH + 0.5, 0.0, 1.0)
            )
            sign = 1.0 if side == 0 else -1.0
            aside = sign * share * path.beside[:, side]
            moved = _points_beside(points, path.points, aside)
            if _has_room(
                moved[run][::_CHECK_STRIDE], np.zeros(1), obstacles
            ).all():
                points = moved
                done = end + half
                break


def _constant_stretch(beside: np.ndarray, place: int) -> slice:
    """Returns the stretch of points on which a neighbouring lane continues.

    `beside` (N,) contains the distance to the neighbouring lane at each point,
    0 where there is none [m]. The stretch contains the point `place`, and all
    points around it with the same distance. Without a lane at `place`, the
    stretch is this point only.
    """
    if not beside[place]:
        return slice(place, place + 1)
    differs = np.flatnonzero(beside != beside[place])
    after = int(np.searchsorted(differs, place))
    return slice(
        int(differs[after - 1]) + 1 if after else 0,
        int(differs[after]) if after < len(differs) else len(beside),
    )


def _offset_bounds(
    points: np.ndarray, obstacles: STRtree
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and greatest offsets (N,) to the left of a path [m].

    At each point, the two offsets are the limits of the free interval that is
    nearest to the path. The interval is narrowed so that it is free over the
    whole length over which offsets are smoothed. Both offsets are 0 where there
    is no room.
    """
    free = _has_room(points[::_CHECK_STRIDE], _TRIED_OFFSETS, obstacles)
    low, high = np.zeros((2, len(free)))
    nearest = np.argsort(np.abs(_TRIED_OFFSETS), kind="stable")
    for k, row in enumerate(free):
        if row.any():
            start = nearest[row[nearest].argmax()]
            blocked = np.flatnonzero(~row)
            after = np.searchsorted(blocked, start)
            ends = np.concatenate([[-1], blocked, [len(row)]])
            low[k] = _TRIED_OFFSETS[ends[after] + 1]
            high[k] = _TRIED_OFFSETS[ends[after + 1] - 1]
    size = (
        2 * (math.ceil(_SMOOTHING_REACH / FINE_SPACING / _CHECK_STRIDE) + 1) + 1
    )
    low = maximum_filter1d(low, size, mode="nearest")
    high = minimum_filter1d(high, size, mode="nearest")
    is_narrow = low > high
    low[is_narrow], high[is_narrow] = 0.0, 0.0
    num = len(points)
    return low.repeat(_CHECK_STRIDE)[:num], high.repeat(_CHECK_STRIDE)[:num]


def _draw_offsets(
    low: np.ndarray,
    high: np.ndarray,
    spread: float,
    length: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Returns random offsets (N,) within the bounds from `_offset_bounds` [m].

    The mean of the process is at least two standard deviations away from both
    bounds. If the bounds are too close together for this, the mean is in the
    middle between them.
    """
    weights = _smoothing_weights()
    reach = len(weights) // 2
    decay, gain = _decay_and_gain(weights, length)
    values = _ornstein_uhlenbeck(decay, len(low) + 2 * reach, rng)
    low, high = (np.pad(bound, reach, mode="edge") for bound in (low, high))
    least, most = low + 2 * spread, high - 2 * spread
    mean = np.where(
        least <= most,
        np.clip(0.0, least, np.maximum(least, most)),
        (low + high) / 2,
    )
    wanted = np.clip(mean + spread * gain * values, low, high)
    num = len(low) - 2 * reach
    # A loop, because a dot product is rounded differently on other processors.
    offset = np.zeros(num)
    for k, weight in enumerate(weights.tolist()):
        offset += weight * wanted[k : k + num]
    return offset


def _ornstein_uhlenbeck(
    decay: float, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Returns a process (N,) with mean 0 and standard deviation 1.

    The correlation of neighbouring values is `decay`, and N is `count`.
    """
    noise = rng.standard_normal(count)
    value = float(noise[0])
    values = [value]
    innovation = math.sqrt(1.0 - decay**2)
    for sample in noise[1:].tolist():
        value = decay * value + innovation * sample
        values.append(value)
    return np.array(values)


def _smoothing_weights() -> np.ndarray:
    """Returns the weights (N,) of the smoothing, with a sum of 1.

    As a function of the distance, the weight has two continuous derivatives.
    """
    half = round(_SMOOTHING_REACH / FINE_SPACING)
    u = np.arange(-half, half + 1) / (half + 1)
    # Products, because how a power is rounded depends on the processor.
    weights = (1.0 - u * u) * (1.0 - u * u) * (1.0 - u * u)
    return weights / weights.sum()


def _decay_and_gain(weights: np.ndarray, length: float) -> tuple[float, float]:
    """Returns the decay per step and the gain of a process to be smoothed.

    An Ornstein-Uhlenbeck process of length a has the covariance exp(-d / a).
    Smoothed by weights w_i at x_i, it has the covariance sum_ij w_i w_j exp(-|d
    + x_i - x_j| / a). The gain and a are chosen such that the smoothed process
    has a standard deviation of 1, and a correlation of 1/e at `length`.
    """
    num = len(weights)
    pairs = [
        float(sum(np.multiply(weights[k:], weights[: num - k]).tolist()))
        for k in range(num)
    ]

    def covariance(distance: float, a: float) -> float:
        return sum(
            pairs[abs(k)] * math.exp(-abs(distance + FINE_SPACING * k) / a)
            for k in range(1 - num, num)
        )

    a = length
    for _ in range(_ITERATIONS):
        variance = covariance(0.0, a)
        a *= -math.log(covariance(length, a) / variance)
    return math.exp(-FINE_SPACING / a), 1.0 / math.sqrt(variance)
