"""Beam patterns: fields of view, rates, and exact ranges."""

import dataclasses

from helpers.closed_forms import box
from helpers.lidar_stage import Stage, positions
import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
import pytest

from cns_drake.sensors import (
    BeamPattern,
    DirectionPattern,
    NoddingPattern,
    RosettePattern,
    SpinningPattern,
    make_beam_pattern,
    make_flash_pattern,
)
from evaluation.lidar_sheets import LIDAR_PRESETS

LIVOX = ("mid-70", "avia", "mid-360")


def angles_deg(d_Sset):
    """Azimuths and elevations."""
    x, y, z = d_Sset.T
    return np.rad2deg(np.arctan2(y, x)), np.rad2deg(np.arcsin(z))


def many(pattern, num_frames):
    return np.concatenate([pattern.beams(k).d_Sset for k in range(num_frames)])


def test_cns_pattern():
    pattern = make_beam_pattern("cns", 0.05)
    assert pattern.num_beams == 32 * 1024
    d = pattern.d_Sset.reshape(1024, 32, 3)
    np.testing.assert_allclose(np.linalg.norm(d, axis=2), 1.0, atol=1e-15)
    elevation = np.rad2deg(np.arcsin(d[..., 2]))
    np.testing.assert_allclose(
        elevation, np.broadcast_to(np.linspace(22.5, -22.5, 32), (1024, 32))
    )
    # The turn starts at the rear and goes clockwise: left comes first.
    np.testing.assert_allclose(d[0, 0, 1], 0.0, atol=1e-12)
    assert d[0, 0, 0] < 0
    assert d[256, 0, 1] > 0.9
    assert pattern.beams(0).t_ns[0] == 0
    assert pattern.beams(0).t_ns[-1] == round(1023 * 0.05e9 / 1024)
    assert (np.diff(pattern.beams(0).t_ns.astype(int)) >= 0).all()


@pytest.mark.parametrize("preset", LIDAR_PRESETS)
def test_presets_make_usable_patterns(preset):
    pattern = make_beam_pattern(preset)
    sheet = LIDAR_PRESETS[preset]
    beams = pattern.beams(3)
    assert len(np.unique(beams.ring)) == sheet.num_rings
    assert pattern.period == sheet.period
    assert 0.0 < pattern.min_range < pattern.max_range
    assert len(beams.d_Sset) == len(beams.ring) == len(beams.t_ns)
    assert len(beams.t_ns) == pattern.num_beams
    np.testing.assert_allclose(
        np.linalg.norm(beams.d_Sset, axis=1), 1.0, atol=1e-12
    )
    assert (np.diff(beams.t_ns.astype(int)) >= 0).all()
    assert beams.t_ns[-1] < pattern.period * 1e9
    assert (np.sort(beams.packet_order) == np.arange(pattern.num_beams)).all()
    np.testing.assert_array_equal(beams.column_t_ns, pattern.column_t_ns)
    assert len(sheet.source) > 20


@pytest.mark.parametrize(
    ("preset", "top", "bottom", "finest"),
    [
        ("os1-64-33", 16.6, -16.6, 33.2 / 63),
        ("os1-128-42", 21.2, -21.2, 42.4 / 127),
        ("hdl-64e", 2.0, -24.33, 1 / 3),
        ("hdl-32e", 10.67, -30.67, 4 / 3),
        ("alpha-prime", 15.0, -25.0, 0.11),
        ("hesai-pandar64", 15.0, -25.0, 1 / 6),
    ],
)
def test_elevations_of_data_sheets(preset, top, bottom, finest):
    elevations = np.degrees(make_beam_pattern(preset).elevations_rad)
    assert (elevations.max(), elevations.min()) == pytest.approx((top, bottom))
    steps = -np.diff(elevations)
    assert steps.min() == pytest.approx(finest, abs=2e-3)


def test_no_preset_of_that_name():
    with pytest.raises(ValueError, match="no preset 'os1-65'"):
        make_beam_pattern("os1-65")
    with pytest.raises(ValueError, match="'rosette' has none"):
        make_beam_pattern("avia", num_columns=100)
    with pytest.raises(ValueError, match="num_columns: 0"):
        make_beam_pattern("vlp-16", 0.1, num_columns=0)


def test_hokuyo():
    """The specification has 1081 steps of 0.25 deg, in 3/4 of 25 ms."""
    beams = make_beam_pattern("hokuyo-ust-20lx").beams(0)
    azimuth, elevation = angles_deg(beams.d_Sset)
    expected = -135.0 + 0.25 * np.arange(1081)
    np.testing.assert_allclose(azimuth, expected, atol=1e-9)
    np.testing.assert_allclose(elevation, 0.0, atol=1e-12)
    assert beams.t_ns[-1] == pytest.approx(0.75 * 25e6)


@pytest.mark.parametrize(
    ("preset", "rate", "across", "up"),
    [
        ("mid-70", 100_000, (-35.2, 35.2), (-35.2, 35.2)),
        ("avia", 240_000, (-35.2, 35.2), (-38.6, 38.6)),
        ("mid-360", 200_000, (-180.0, 180.0), (-7.0, 52.0)),
    ],
)
def test_livox_fields_of_view_and_rates(preset, rate, across, up):
    pattern = make_beam_pattern(preset)
    assert pattern.num_beams == pytest.approx(rate * pattern.period, rel=1e-3)
    azimuth, elevation = angles_deg(many(pattern, 20))
    found = (azimuth.min(), azimuth.max(), elevation.min(), elevation.max())
    np.testing.assert_allclose(found, (*across, *up), atol=0.8)
    assert elevation.min() > up[0] - 1e-6
    assert elevation.max() < up[1] + 1e-6


def test_a_mid_70_sees_a_disc():
    """Beams are at most half the angle from x, and most in the middle."""
    d = many(make_beam_pattern("mid-70"), 10)
    off_axis = np.rad2deg(np.arccos(d[:, 0]))
    assert off_axis.max() == pytest.approx(35.2, abs=0.1)
    inner = (off_axis < 10.0).sum() / (1 - np.cos(np.deg2rad(10.0)))
    outer = ((off_axis > 20.0) & (off_axis < 30.0)).sum() / (
        np.cos(np.deg2rad(20.0)) - np.cos(np.deg2rad(30.0))
    )
    assert inner > 3 * outer


@pytest.mark.parametrize("preset", LIVOX)
def test_frame_after_frame_fills_the_gaps(preset):
    """A pattern that does not repeat covers more with each frame."""
    pattern = make_beam_pattern(preset)

    def cells(num_frames):
        cells = np.floor(many(pattern, num_frames) / 0.008).astype(int)
        return len(np.unique(cells, axis=0))

    one, four = cells(1), cells(4)
    assert four > 1.8 * one
    first, again = pattern.beams(7), make_beam_pattern(preset).beams(7)
    np.testing.assert_array_equal(first.d_Sset, again.d_Sset)


@pytest.mark.parametrize("preset", ["mid-70", "avia", "mid-360"])
def test_a_frame_of_any_number_has_beams(preset):
    pattern = make_beam_pattern(preset)
    for frame in (-1, -(10**9), 10**20, -(10**300)):
        beams = pattern.beams(frame)
        assert len(beams.column) == pattern.num_beams
        np.testing.assert_allclose(
            np.linalg.norm(beams.d_Sset, axis=1), 1.0, atol=1e-9
        )


def test_limits_of_the_field_of_view():
    whole = make_beam_pattern("vlp-16", num_columns=360)
    front = whole.within(azimuths_deg=(-30, 30), elevations_deg=(-5, 90))
    azimuth, elevation = angles_deg(front.beams(0).d_Sset)
    assert azimuth.min() == pytest.approx(-30.0)
    assert azimuth.max() == pytest.approx(30.0)
    assert np.unique(elevation.round(6)).tolist() == list(range(-5, 16, 2))
    assert len(azimuth) == 61 * 11
    rear = whole.within(azimuths_deg=(150, -150)).beams(0)
    assert len(rear.column) == 61 * 16
    assert (rear.d_Sset[:, 0] < 0).all()
    np.testing.assert_array_equal(front.column_t_ns, whole.column_t_ns)
    with pytest.raises(ValueError, match="no beam within"):
        whole.within(elevations_deg=(20, 30))
    for azimuths in ((0, 350), (-181, 9), (np.nan, 3), (1, 2, 3), 9, "ab"):
        with pytest.raises((TypeError, ValueError), match=r"azimuths_deg: "):
            whole.within(azimuths)
    with pytest.raises(ValueError, match=r"elevations_deg: .* -90 to 90"):
        whole.within(elevations_deg=(0, 91))


def test_limits_of_a_pattern_that_does_not_repeat():
    half = make_beam_pattern("mid-360").within(azimuths_deg=(0, 180))
    for frame in (0, 5):
        beams = half.beams(frame)
        assert (beams.d_Sset[:, 1] >= -1e-9).all()
        assert len(beams.column) == pytest.approx(10_000, rel=0.02)
        assert beams.t_ns.max() < 0.1e9


def test_beams_in_any_directions():
    pattern = DirectionPattern(
        [[0, 2, 0], [3, 0, 4], [1, 1, 1]],
        times=[0.02, 0.0, 0.01],
        rings=[5, 6, 7],
        min_range=0.1,
        max_range=10.0,
        period=0.1,
    )
    beams = pattern.beams(4)
    np.testing.assert_allclose(
        beams.d_Sset, [[0.6, 0, 0.8], [3**-0.5] * 3, [0, 1, 0]]
    )
    assert beams.ring.tolist() == [6, 7, 5]
    assert beams.t_ns.tolist() == [0, 10_000_000, 20_000_000]


@pytest.mark.parametrize(
    ("directions", "options", "fault"),
    [
        ([], {}, "0 directions"),
        ([[1, 0, 0]], {"times": [0, 1]}, "1 directions, 2 times"),
        ([[0, 0, 0]], {}, "zero"),
        ([[np.nan, 0, 0]], {}, "zero or not a number"),
        ([[1, 0, 0]], {"times": [0.1]}, "not within the revolution of 0.1 s"),
        ([[1, 0, 0]], {"rings": [65536]}, "a ring: 65536 is not a whole"),
        ([[1, 0, 0]], {"rings": [-1]}, "a ring: -1 is not"),
        ([[1, 0, 0]], {"rings": [0.5]}, "a ring: 0.5 is not"),
        ([[1, 0]], {}, r"directions: their shape \(1, 2\)"),
        ([[1, 0, 0, 0, 1, 0]], {}, "does not end in 3"),
    ],
)
def test_patterns_that_are_none(directions, options, fault):
    with pytest.raises(ValueError, match=fault):
        DirectionPattern(
            directions, min_range=0.1, max_range=9.0, period=0.1, **options
        )


@pytest.mark.parametrize(
    ("limits", "fault"),
    [
        ((5.0, 5.0, 0.1), "min_range 5, max_range 5"),
        ((-0.1, 5.0, 0.1), "min_range -0.1"),
        ((np.nan, 5.0, 0.1), "min_range nan"),
        ((0.0, np.nan, 0.1), "max_range nan"),
        ((0.0, 5.0, 0.0), "period: 0 s"),
        ((0.0, 5.0, -1.0), "period: -1 s"),
        ((0.0, 5.0, np.inf), "period: inf s"),
    ],
)
def test_impossible_limits(limits, fault):
    """Every kind of pattern refuses them, a kind of one's own included."""
    low, high, period = limits
    given = {"min_range": low, "max_range": high, "period": period}

    class Own(BeamPattern):
        min_range, max_range = low, high

        def beams(self, frame):
            return make_beam_pattern("vlp-16").beams(0)

    own = Own()
    own.period = period
    for make in (
        lambda: SpinningPattern((0.0,), 4, low, high, period),
        lambda: DirectionPattern([[1, 0, 0]], **given),
        lambda: NoddingPattern((0.0, 9.0), points_per_second=1e4, **given),
        lambda: RosettePattern(70.0, points_per_second=1e4, **given),
        lambda: make_flash_pattern(2, 2, (9.0, 9.0), **given),
        lambda: Stage().finish(pattern=own),
    ):
        with pytest.raises(ValueError, match=fault):
            make()
    # Nothing is nearer than the sensor, nor farther than an endless range.
    SpinningPattern((0.0,), 4, 0.0, np.inf, 1e-6)


@pytest.mark.parametrize(
    ("elevations", "columns", "azimuths", "fault"),
    [
        ((-0.1, 0.1), 4, None, "elevations_rad: they must descend"),
        ((), 4, None, "there must be one"),
        ((np.nan,), 4, None, "elevations_rad"),
        ((1.6,), 4, None, "elevations_rad"),
        ((0.0,), 0, None, "num_columns: 0"),
        ((0.0,), 2.5, None, "num_columns: 2.5"),
        ((0.0,), 4, (0.0, np.inf), "azimuths_rad"),
        ((0.0,), 4, (0.0, np.nan), "azimuths_rad"),
        ((0.0,), 4, (2.0 * np.pi + 1e-6, 0.0), "azimuths_rad"),
        ((0.0,), 4, (0.0, 1.0, 2.0), "azimuths_rad"),
        ((0.0,), 4, (0.0,), "azimuths_rad"),
    ],
)
def test_turns_that_are_none(elevations, columns, azimuths, fault):
    with pytest.raises(ValueError, match=fault):
        SpinningPattern(elevations, columns, 0.1, 9.0, 0.1, azimuths)
    whole = SpinningPattern((0.0,), 4, 0.1, 9.0, 0.1, (0.0, 2.0 * np.pi))
    assert whole.beams(0).column_t_ns[-1] == 0.1e9
    # Arrays and lists are as good as tuples, and numbers of either type.
    listed = SpinningPattern([0.0], 4.0, 0.1, 9.0, 0.1, np.array([-1.0, 1.0]))
    assert listed == SpinningPattern((0.0,), 4, 0.1, 9.0, 0.1, (-1.0, 1.0))
    assert repr(listed.num_beams) == "4"
    for across, up in ((361.0, 9.0), (9.0, 181.0), (0.0, 9.0), (9.0, -9.0)):
        with pytest.raises(ValueError, match=r"fov_deg: .* up to 360 and 180"):
            make_flash_pattern(
                2, 2, (across, up), min_range=0.1, max_range=9.0, period=0.1
            )


def test_patterns_that_never_repeat_have_limits_of_their_own():
    common = {"min_range": 0.1, "max_range": 9.0, "period": 0.1}
    for make, fault in (
        (lambda: NoddingPattern((9, 0), points_per_second=9, **common), "elev"),
        (lambda: RosettePattern(0, points_per_second=9, **common), "fov_deg 0"),
        (
            lambda: RosettePattern(9, points_per_second=0, **common),
            "points_",
        ),
        (
            lambda: RosettePattern(
                9, points_per_second=9, num_lines=0, **common
            ),
            "num_lines: 0",
        ),
    ):
        with pytest.raises(ValueError, match=fault):
            make()


def test_the_latest_time_that_a_point_can_have():
    """A turn may last longer; 2^32 ns are 4.294967296 s."""
    last = (2**32 - 1) * 1e-9
    options = {"min_range": 0.1, "max_range": 9.0, "period": 60.0}
    pattern = DirectionPattern([[1, 0, 0]] * 2, times=[0.0, last], **options)
    assert pattern.beams(0).t_ns.tolist() == [0, 2**32 - 1]
    with pytest.raises(ValueError, match=r"a firing time .* 4294967296"):
        DirectionPattern([[1, 0, 0]], times=[last + 1e-9], **options)
    # The last of ten columns fires after nine tenths of a turn.
    assert SpinningPattern((0.0,), 10, 0.1, 9.0, 4.77).beams(0).t_ns[-1] > 4e9
    for pattern in (
        SpinningPattern((0.0,), 10, 0.1, 9.0, 4.78),
        dataclasses.replace(make_beam_pattern("mid-360"), period=4.4),
    ):
        with pytest.raises(ValueError, match="a firing time"):
            pattern.beams(0)


@pytest.mark.parametrize(
    ("preset", "beams_a_second"),
    [
        ("vlp-16", 288_000),
        ("hdl-64e", 1_331_200),
        ("hesai-pandar64", 1_152_000),
        ("avia", 240_000),
    ],
)
@pytest.mark.parametrize("rate", [20, 10, 5])
def test_lasers_that_fire_at_a_fixed_rate(preset, beams_a_second, rate):
    pattern = make_beam_pattern(preset, 1.0 / rate)
    assert pattern.num_beams * rate == beams_a_second


def test_columns_that_are_a_setting_stay():
    for preset in ("cns", "os1-64"):
        assert make_beam_pattern(preset, 0.1).num_columns == 1024
    # What is asked for wins.
    assert make_beam_pattern("vlp-16", 0.1, num_columns=9).num_columns == 9


def test_equal_patterns_share_their_beams():
    first, second = (make_beam_pattern("vlp-16", 0.1) for _ in range(2))
    assert first is not second
    assert first.beams(0) is second.beams(5)
    front = [one.within((-30, 30)).beams(0) for one in (first, second)]
    assert front[0] is front[1]
    own = SpinningPattern(np.array([0.1, 0.0]), 9, 0.1, 9.0, 0.1)
    assert own == SpinningPattern((0.1, 0.0), 9, 0.1, 9.0, 0.1)


def test_a_flash_is_a_grid():
    beams = make_flash_pattern(
        4, 2, (80.0, 20.0), min_range=0.1, max_range=9.0, period=0.1
    ).beams(0)
    azimuth, elevation = angles_deg(beams.d_Sset)
    np.testing.assert_allclose(azimuth, [30, 10, -10, -30] * 2)
    np.testing.assert_allclose(elevation, [5] * 4 + [-5] * 4)
    assert beams.ring.tolist() == [0] * 4 + [1] * 4
    assert not beams.t_ns.any()


PATTERNS = {
    **{name: make_beam_pattern(name) for name in LIDAR_PRESETS},
    "limited": make_beam_pattern("mid-360").within((100, -100), (0, 90)),
    "one row": SpinningPattern((0.1,), 700, 0.1, 50.0, 0.1, (1.0, -2.0)),
    "flash": make_flash_pattern(
        90, 70, (100.0, 60.0), min_range=0.1, max_range=50.0, period=0.1
    ),
}


@pytest.mark.parametrize("name", PATTERNS)
def test_every_pattern_measures_a_room_exactly(name):
    """Beam for beam, in the third frame, against the closed form."""
    pattern = PATTERNS[name]
    size = (9.0, 8.0, 6.0)
    p_WS = np.array([0.7, 0.2, -0.4])
    stage = Stage()
    for axis in range(3):
        for side in (-1, 1):
            wall = np.full(3, 30.0)
            wall[axis] = 1.0
            p = np.zeros(3)
            p[axis] = side * (size[axis] / 2 + 0.5)
            stage.add(f"room::{axis}{side}", Box(*wall), RigidTransform(p))
    stage.finish(X_PS=RigidTransform(p_WS), pattern=pattern)
    for frame in (0, 3):
        stage.context.SetTime(frame * pattern.period)
        beams = pattern.beams(frame)
        expected = box(p_WS, beams.d_Sset, size)
        seen = expected >= pattern.min_range
        scan = stage.eval()
        assert len(scan) == seen.sum()
        np.testing.assert_allclose(
            positions(scan),
            (expected[:, None] * beams.d_Sset)[seen],
            atol=1e-5,
        )
        np.testing.assert_array_equal(scan["t"], beams.t_ns[seen])
        np.testing.assert_array_equal(scan["ring"], beams.ring[seen])
