import dataclasses
import json
import math

from helpers.internal.eval_program import assert_refused, run
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.base import InputError, make_pose
from evaluation import Drive, compare_drives
from evaluation.drives import DriveComparison

RNG_SEED = 20260


class Driven(Drive):
    """A drive without scans, at given poses, 20 a second."""

    def __init__(self, name, xyz, yaw, roll_pitch=None, world_frame="map"):
        self.name = name
        self.world_frame = world_frame
        angles = np.zeros((len(xyz), 3))
        angles[:, 0] = yaw
        if roll_pitch is not None:
            angles[:, 1], angles[:, 2] = roll_pitch[:, 1], roll_pitch[:, 0]
        R = Rotation.from_euler("ZYX", angles).as_matrix()
        self._X_WS = make_pose(R, np.asarray(xyz, dtype=float))

    def __len__(self):
        return len(self._X_WS)

    @property
    def stamps_ns(self):
        return 50_000_000 * np.arange(len(self), dtype=np.int64)

    @property
    def X_WS(self):
        return self._X_WS

    def scan(self, index):
        raise AssertionError("ways need no scans")


def straight(name, offset, *, heading=0.4, speed=10.0, length=2000.0, turn=0.0):
    """Drives along a line in the world, `offset(s)` to its left.

    The line leads in direction `heading`; the sensor is turned by `turn`.
    """
    s = np.arange(0.0, length, speed / 20)
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    left = np.array([-along[1], along[0], 0.0])
    xyz = [30.0, -20.0, 5.0] + s[:, None] * along
    xyz = xyz + np.asarray(offset(s) + 0 * s)[:, None] * left
    return Driven(name, xyz, np.full(len(s), heading + turn))


def test_a_drive_beside_another_has_its_offset_everywhere():
    found = compare_drives(
        straight("a", lambda s: 0.0), straight("b", lambda s: -0.8)
    )
    assert (found.num_stops, found.num_met) == (400, 400)
    assert found.reverse == 0.0
    for name in ("offset_50", "offset_75", "offset_90", "offset_99"):
        assert getattr(found, name) == pytest.approx(0.8, abs=1e-9)
    assert found.other_lane == 0.0
    assert math.isnan(found.episode_50)
    assert found.wander == pytest.approx(0.0, abs=1e-9)
    assert found.heading_spread_deg == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(found.reverse_50)
    assert found.first.speed_50 == pytest.approx(10.0)
    assert found.first.standing == 0.0


@pytest.mark.parametrize(("offset", "lanes"), [(1.499, 0.0), (1.501, 1.0)])
def test_a_lane_ends_at_its_limit(offset, lanes):
    found = compare_drives(
        straight("a", lambda s: 0.0), straight("b", lambda s: offset)
    )
    assert found.other_lane == lanes


@pytest.mark.parametrize(("offset", "met"), [(11.99, 400), (12.01, 0)])
def test_drives_meet_within_a_radius(offset, met):
    found = compare_drives(
        straight("a", lambda s: 0.0), straight("b", lambda s: offset)
    )
    assert found.num_met == met


def test_a_change_of_lane_is_an_episode_with_a_length():
    # Over half of 3.2 m from 500 m to 560 m, and from 1000 m to 1120 m.
    ramp = [490, 510, 550, 570, 990, 1010, 1110, 1130]

    def offset(s):
        return np.interp(s, ramp, [0, 3.2, 3.2, 0, 0, 3.2, 3.2, 0])

    found = compare_drives(straight("a", lambda s: 0.0), straight("b", offset))
    assert found.other_lane == pytest.approx(38 / 400, abs=1 / 400)
    assert found.episode_50 == pytest.approx(90.0, abs=5.0)
    assert found.episode_90 == pytest.approx(114.0, abs=5.0)


def test_an_oscillation_has_its_spread_and_correlation_length():
    # cos has standard deviation 1 / sqrt(2), and its correlation over a lag d
    # is cos(k d): 1/e at acos(1/e) / k.
    length = 157.0
    k = 2 * math.pi / length
    found = compare_drives(
        straight("a", lambda s: 0.0, length=40 * length),
        straight("b", lambda s: 0.6 * np.cos(k * s), length=40 * length),
    )
    assert found.wander == pytest.approx(0.6 / math.sqrt(2), rel=0.01)
    expected = math.acos(1 / math.e) / k
    assert found.wander_length == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_an_ornstein_uhlenbeck_process_is_measured_as_it_is():
    rng = np.random.default_rng(RNG_SEED)
    spread = 0.35
    length = 50.0
    step = 0.5
    decay = math.exp(-step / length)
    noise = rng.normal(size=100_000) * spread * math.sqrt(1 - decay**2)
    values = np.empty(len(noise))
    values[0] = rng.normal() * spread
    for k in range(1, len(noise)):
        values[k] = decay * values[k - 1] + noise[k]
    found = compare_drives(
        straight("a", lambda s: 0.0, length=50_000.0),
        straight("b", lambda s: values, length=50_000.0),
    )
    assert found.wander == pytest.approx(spread, rel=0.06)
    assert found.wander_length == pytest.approx(length, rel=0.15)


def test_the_opposite_direction_counts_where_no_other_is_near():
    a = straight("a", lambda s: 0.0)
    there = straight("b", lambda s: 4.0)
    back = Driven(
        "b", there.X_WS[::-1, :3, 3], np.full(len(there), 0.4 + np.pi)
    )
    found = compare_drives(a, back)
    assert found.num_met == found.num_stops
    assert found.reverse == 1.0
    assert found.reverse_25 == pytest.approx(4.0, abs=1e-6)
    assert math.isnan(found.offset_50)
    both = Driven(
        "both",
        np.concatenate([back.X_WS[:, :3, 3], there.X_WS[:, :3, 3]]),
        np.repeat([0.4 + np.pi, 0.4], len(there)),
    )
    found = compare_drives(a, both)
    assert found.reverse == 0.0
    assert found.offset_50 == pytest.approx(4.0, abs=1e-6)


def test_headings_and_heights_are_those_of_b_in_a():
    a = straight("a", lambda s: 0.0)
    turned = straight("b", lambda s: 0.0, turn=np.radians(2.0))
    xyz = turned.X_WS[:, :3, 3] + [0.0, 0.0, 1.0]
    xyz[len(xyz) // 2 :, 2] += 0.1
    found = compare_drives(a, Driven("b", xyz, np.full(len(xyz), 0.4 + 0.0349)))
    assert found.heading_5_deg == pytest.approx(2.0, abs=0.01)
    assert found.heading_spread_deg == pytest.approx(0.0, abs=1e-6)
    # The median is at the step of 0.1 m; either side is one of its ends.
    assert found.height_95 - found.height_5 == pytest.approx(0.1, abs=1e-6)


def test_standing_counts_in_time_and_makes_no_way():
    a = straight("a", lambda s: 0.0)
    rng = np.random.default_rng(RNG_SEED)
    half = len(a) // 2
    xyz = a.X_WS[:, :3, 3]
    waits = xyz[half] + rng.normal(scale=0.01, size=(len(a), 3))
    stops = Driven(
        "b",
        np.concatenate([xyz[:half], waits, xyz[half:]]),
        np.full(2 * len(a), 0.4),
    )
    found = compare_drives(a, stops)
    assert found.second.standing == pytest.approx(0.5, abs=0.01)
    assert found.second.speed_50 == pytest.approx(10.0, abs=0.1)
    assert found.second.length == pytest.approx(found.first.length, abs=0.2)
    assert found.offset_99 < 0.03


def test_roll_and_pitch_spread():
    a = straight("a", lambda s: 0.0)
    rng = np.random.default_rng(RNG_SEED)
    tilt = rng.normal(scale=np.radians([0.9, 0.5]), size=(len(a), 2))
    b = Driven("b", a.X_WS[:, :3, 3], np.full(len(a), 0.4), roll_pitch=tilt)
    found = compare_drives(a, b)
    assert found.second.roll_spread_deg == pytest.approx(0.9, rel=0.15)
    assert found.second.pitch_spread_deg == pytest.approx(0.5, rel=0.15)
    assert found.first.roll_spread_deg == pytest.approx(0.0, abs=1e-9)


def test_drives_that_cannot_be_compared_are_refused():
    a = straight("a", lambda s: 0.0)
    elsewhere = Driven("b", a.X_WS[:, :3, 3], np.zeros(len(a)), None, "other")
    with pytest.raises(InputError, match="poses in frame 'other'"):
        compare_drives(a, elsewhere)
    still = Driven("still", np.zeros((50, 3)), np.zeros(50))
    with pytest.raises(InputError, match=r"still: it moves 0\.0 m in all"):
        compare_drives(a, still)


def test_the_command_prints_the_rows_beside_real_pairs(capsys, towns):
    pair = [towns / "town_01", towns / "town_02"]
    status, out, _ = run(capsys, "tcr", "--paths", *pair)
    assert status == 0
    header, stops, *_ = out.splitlines()
    assert header.split() == ["these", "Boreas", "KAIST"]
    assert stops.split()[-3:] == ["1166", "of", "1194"]
    status, out, _ = run(capsys, "tcr", "--paths", *pair, "--json")
    values = json.loads(out)
    assert values["first"]["name"] == "town_01"
    fields = {f.name for f in dataclasses.fields(DriveComparison)}
    assert values.keys() == fields
    assert_refused(capsys, ["tcr", "--paths", pair[0], towns / "none"], "none")
