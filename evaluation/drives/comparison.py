"""How the paths of two drives differ: offsets, lanes, headings, speeds.

Two drives along one route differ because of their drivers. The differences
serve to compare real drives with simulated drives.
"""

from dataclasses import asdict, dataclass
import math

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.base import InputError, json_values
from cns_drake.drives import Drive, check_same_world
from evaluation.drives.sampling import corners, travelled

# Distance between the stations at which two drives are compared [m].
STATION_SPACING = 5.0
# Two drives meet at a station if they pass within this distance [m].
MEETING_RADIUS = 12.0
# Beyond this offset, two drives are in different lanes [m].
LANE_OFFSET = 1.5
# A vehicle stands below this speed [m/s].
STANDING_SPEED = 0.5
# The path is sampled at this spacing [m], from poses that are at least this far
# apart, so that the jitter of a standing receiver does not lengthen the path.
_PATH_SPACING = 0.25
_LEAST_STEP = 0.2
# Half of the length over which a path's direction is taken [m].
_DIRECTION_REACH = 1.0
# Least number of pairs of stations for a correlation.
_LEAST_PAIRS = 20
# Speeds are averaged over this time [s].
_SPEED_TIME = 0.5


@dataclass(frozen=True)
class Driving:
    """How one drive was driven.

    Attributes:
        name: the drive's name.
        length: length of the path [m].
        standing: share of the time with a speed below `STANDING_SPEED`.
        speed_10, speed_50, speed_90: 10 %, 50 % and 90 % quantiles of the speed
            while the car moves [m/s]; NaN if it never moves.
        roll_spread_deg, pitch_spread_deg: standard deviations [deg] of the
            sensor's roll and pitch, at points of the path that are
            `STATION_SPACING` apart.
    """

    name: str
    length: float
    standing: float
    speed_10: float
    speed_50: float
    speed_90: float
    roll_spread_deg: float
    pitch_spread_deg: float


@dataclass(frozen=True)
class DriveComparison:
    """How the path of a drive B differs from the path of a drive A.

    The drives are compared at stations, which are points every
    `STATION_SPACING` along A's path. B meets a station if B's path passes
    within `MEETING_RADIUS` of it. In this case, the station is compared with
    the nearest point of B's path that has A's direction. Offsets are horizontal
    and perpendicular to A's path. Values without a measurement are NaN.

    Attributes:
        first, second: how A and B were driven.
        num_stops: number of stations of A.
        num_met: number of stations that B meets.
        reverse: share of the met stations that B meets only in the opposite
            direction.
        offset_50, offset_75, offset_90, offset_95, offset_99: quantiles of the
            absolute offset at stations that B meets in A's direction [m].
        other_lane: of the stations that B meets in A's direction, the share at
            which the offset exceeds `LANE_OFFSET`.
        episode_50, episode_90: quantiles of the length of the stretches in
            another lane [m].
        wander: standard deviation of the offset where both drives are in the
            same lane [m].
        wander_length: distance along A at which the autocorrelation of the
            offset in the same lane has fallen to 1/e [m].
        heading_spread_deg, heading_5_deg, heading_95_deg: standard deviation
            and quantiles of B's heading relative to A's heading, at stations
            that B meets in A's direction [deg].
        height_5, height_95: quantiles of B's height above A, relative to the
            median of this height difference [m].
        reverse_25, reverse_50, reverse_75, reverse_95: quantiles of the
            absolute offset at stations that B meets only in the opposite
            direction [m].
    """

    first: Driving
    second: Driving
    num_stops: int
    num_met: int
    reverse: float
    offset_50: float
    offset_75: float
    offset_90: float
    offset_95: float
    offset_99: float
    other_lane: float
    episode_50: float
    episode_90: float
    wander: float
    wander_length: float
    heading_spread_deg: float
    heading_5_deg: float
    heading_95_deg: float
    height_5: float
    height_95: float
    reverse_25: float
    reverse_50: float
    reverse_75: float
    reverse_95: float

    def to_json(self) -> dict:
        """Returns all numbers; NaN becomes None."""
        return json_values(asdict(self))


@dataclass(frozen=True)
class _Way:
    """A drive's path, sampled in steps of `_PATH_SPACING`.

    Attributes:
        length: length of the path [m].
        frame: (N,) number of the frame at each step or shortly before it.
        p_WS: (N, 3) position of the sensor at each step [m].
        tangent: (N, 2) horizontal direction, of length 1.
    """

    length: float
    frame: np.ndarray
    p_WS: np.ndarray
    tangent: np.ndarray

    def stations(self) -> np.ndarray:
        """Returns the indices of the samples every `STATION_SPACING`."""
        return np.arange(
            0, len(self.p_WS), round(STATION_SPACING / _PATH_SPACING)
        )


def compare_drives(first: Drive, second: Drive) -> DriveComparison:
    """Measures how the paths of two drives differ.

    Args:
        first: drive A, in whose direction offsets are measured.
        second: drive B, in the same world, with its LiDAR mounted as on A.

    Raises:
        InputError: the drives are not in the same world, or a drive never
            moves.

    Example:
        from evaluation import compare_drives, open_drive

        drives = map(open_drive, ("downtown_01", "downtown_02"))
        print(compare_drives(*drives).offset_50)
    """
    check_same_world(first, second)
    way_a, way_b = _way(first), _way(second)
    stations = way_a.stations()
    p_A, tangent = way_a.p_WS[stations], way_a.tangent[stations]
    same, opposite = (
        _nearest(p_A, sign * tangent, way_b) for sign in (1.0, -1.0)
    )
    meets = same >= 0
    reverse = ~meets & (opposite >= 0)
    offset = _offsets(p_A, tangent, way_b, same)
    within = np.abs(offset) <= LANE_OFFSET
    outside = np.abs(offset) > LANE_OFFSET
    R_WA = first.X_WS[way_a.frame[stations[meets]], :3, :3]
    R_WB = second.X_WS[way_b.frame[same[meets]], :3, :3]
    R_AB = np.swapaxes(R_WA, 1, 2) @ R_WB
    heading = np.degrees(np.arctan2(R_AB[:, 1, 0], R_AB[:, 0, 0]))
    height = way_b.p_WS[same[meets], 2] - p_A[meets, 2]
    height = height - np.median(height) if len(height) else height
    backwards = _offsets(p_A, tangent, way_b, opposite)[reverse]
    quantiles = (
        _quantiles("offset_{}", np.abs(offset[meets]), 50, 75, 90, 95, 99)
        | _quantiles(
            "episode_{}", _run_lengths(outside) * STATION_SPACING, 50, 90
        )
        | _quantiles("heading_{}_deg", heading, 5, 95)
        | _quantiles("height_{}", height, 5, 95)
        | _quantiles("reverse_{}", np.abs(backwards), 25, 50, 75, 95)
    )
    return DriveComparison(
        first=_driving(first, way_a),
        second=_driving(second, way_b),
        num_stops=len(stations),
        num_met=int(np.count_nonzero(meets | reverse)),
        reverse=_share(reverse[meets | reverse]),
        other_lane=_share(outside[meets]),
        wander=_spread(offset[within]),
        wander_length=_correlation_length(offset, within),
        heading_spread_deg=_spread(heading),
        **quantiles,
    )


def _way(drive: Drive) -> _Way:
    p_WS = drive.X_WS[:, :3, 3]
    kept = corners(p_WS, _LEAST_STEP)
    p_WC = p_WS[kept]
    passed = travelled(p_WC)
    length = float(passed[-1])
    if length < STATION_SPACING:
        raise InputError(
            f"{drive.name}: it moves {length:.1f} m in all; drives are "
            f"compared every {STATION_SPACING:g} m"
        )
    s = np.arange(0.0, length, _PATH_SPACING)

    def at(s: np.ndarray) -> np.ndarray:
        columns = [np.interp(s, passed, column) for column in p_WC.T]
        return np.stack(columns, axis=1)

    ahead = at(s + _DIRECTION_REACH) - at(s - _DIRECTION_REACH)
    tangent = ahead[:, :2]
    norm = np.linalg.norm(tangent, axis=1, keepdims=True)
    last = np.searchsorted(passed, s, side="right") - 1
    return _Way(
        length, np.array(kept)[last], at(s), tangent / np.maximum(norm, 1e-9)
    )


def _nearest(p_A: np.ndarray, direction: np.ndarray, way: _Way) -> np.ndarray:
    """Returns the nearest sample of B's path to each point of A, (N,).

    Points of A are (N, 3). A sample counts only if it lies within
    `MEETING_RADIUS` of the point, and if its direction differs by less than 90
    deg from A's direction (N, 2). The result is an index of a sample, or -1 if
    no sample counts.
    """
    xy = way.p_WS[:, :2]
    found = np.full(len(p_A), -1)
    near = cKDTree(xy).query_ball_point(p_A[:, :2], MEETING_RADIUS)
    for station, steps in enumerate(near):
        steps = np.sort(np.array(steps, dtype=int))
        steps = steps[way.tangent[steps] @ direction[station] > 0.0]
        if len(steps):
            distance = np.linalg.norm(xy[steps] - p_A[station, :2], axis=1)
            found[station] = steps[distance.argmin()]
    return found


def _offsets(
    p_A: np.ndarray, tangent: np.ndarray, way: _Way, steps: np.ndarray
) -> np.ndarray:
    """Returns offsets (N,) to the left of A's path [m]; NaN for index -1."""
    x, y = (way.p_WS[steps, :2] - p_A[:, :2]).T
    offset = tangent[:, 0] * y - tangent[:, 1] * x
    return np.where(steps >= 0, offset, np.nan)


def _correlation_length(offset: np.ndarray, within: np.ndarray) -> float:
    """Returns the distance at which the correlation has fallen to 1/e [m].

    The correlation is interpolated between stations. The result is NaN if the
    correlation does not fall so far within a quarter of the stations.
    """
    if not within.any():
        return math.nan
    centred = np.where(within, offset - offset[within].mean(), 0.0)
    variance = np.mean(centred[within] ** 2)
    if variance == 0.0:
        return math.nan
    before = 1.0
    for lag in range(1, len(offset) // 4 + 1):
        both = within[:-lag] & within[lag:]
        if both.sum() < _LEAST_PAIRS:
            return math.nan
        products = centred[:-lag] * centred[lag:]
        now = float(np.mean(products[both]) / variance)
        if now <= 1 / math.e:
            part = (before - 1 / math.e) / (before - now)
            return STATION_SPACING * (lag - 1 + part)
        before = now
    return math.nan


def _driving(drive: Drive, way: _Way) -> Driving:
    time = (drive.stamps_ns - drive.stamps_ns[0]) * 1e-9
    p_WS = drive.X_WS[:, :3, 3]
    # Pair each frame with the first frame that is _SPEED_TIME later.
    later = np.searchsorted(time, time + _SPEED_TIME - 1e-6)
    now = np.flatnonzero(later < len(time))
    later = later[now]
    moved = np.linalg.norm(p_WS[later] - p_WS[now], axis=1)
    speed = moved / (time[later] - time[now])
    stands = speed < STANDING_SPEED
    R_WS = drive.X_WS[way.frame[way.stations()], :3, :3]
    roll = np.arctan2(R_WS[:, 2, 1], R_WS[:, 2, 2])
    pitch = -np.arcsin(np.clip(R_WS[:, 2, 0], -1.0, 1.0))
    # Relative to the mean, so that a tilted mount does not wrap around.
    roll = np.angle(np.exp(1j * roll) / np.exp(1j * roll).mean())
    return Driving(
        name=drive.name,
        length=way.length,
        standing=_share(stands),
        roll_spread_deg=_spread(np.degrees(roll)),
        pitch_spread_deg=_spread(np.degrees(pitch)),
        **_quantiles("speed_{}", speed[~stands], 10, 50, 90),
    )


def _run_lengths(flags: np.ndarray) -> np.ndarray:
    """Returns the length of each run of consecutive true values."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return edges[1::2] - edges[::2]


def _quantiles(
    name: str, values: np.ndarray, *percentages: int
) -> dict[str, float]:
    """Returns quantiles by name; NaN if there are no values."""
    if len(values) == 0:
        return {name.format(percentage): math.nan for percentage in percentages}
    return {
        name.format(percentage): float(np.percentile(values, percentage))
        for percentage in percentages
    }


def _spread(values: np.ndarray) -> float:
    return float(np.std(values)) if len(values) else math.nan


def _share(flags: np.ndarray) -> float:
    return float(np.mean(flags)) if len(flags) else math.nan
