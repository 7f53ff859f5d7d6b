"""Noise, losses and rounding of ranges, by their statistics."""

import numpy as np
import pytest

from cns_drake.sensors import MeasurementModel

IDEAL = MeasurementModel()

NUM_BEAMS = 200_000
LIMITS = (0.8, 120.0)


def constant(distance):
    return np.full(NUM_BEAMS, distance, np.float32)


def test_ideal_is_exact():
    rng = np.random.default_rng(3)
    ranges = rng.uniform(0.0, 200.0, NUM_BEAMS).astype(np.float32)
    ranges[::7] = np.inf
    returns = IDEAL.measure(ranges, *LIMITS, 5)
    inside = (ranges >= 0.8) & (ranges <= 120.0)
    np.testing.assert_array_equal(returns.beams, np.flatnonzero(inside))
    np.testing.assert_array_equal(returns.ranges, ranges[inside])
    np.testing.assert_allclose(
        returns.intensity, np.exp(-0.004 * ranges[inside]), rtol=1e-6
    )
    assert not IDEAL.is_random


def test_range_noise_is_gaussian_along_the_beam():
    sigma = 0.03
    model = MeasurementModel(range_noise=sigma)
    assert model.is_random
    error = model.measure(constant(50.0), *LIMITS, 0).ranges - 50.0
    assert len(error) == NUM_BEAMS
    # Mean and deviation are within five of their own standard deviations.
    assert abs(error.mean()) < 5 * sigma / np.sqrt(NUM_BEAMS)
    assert abs(error.std() / sigma - 1.0) < 5 / np.sqrt(2 * NUM_BEAMS)
    within = [(np.abs(error) < k * sigma).mean() for k in (1, 2, 3)]
    np.testing.assert_allclose(within, [0.6827, 0.9545, 0.9973], atol=0.006)
    # Neighbouring beams are independent.
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.012


def test_noise_leaves_intensity_alone():
    model = MeasurementModel(range_noise=0.5)
    intensity = model.measure(constant(50.0), *LIMITS, 0).intensity
    np.testing.assert_allclose(intensity, np.exp(-0.2), rtol=1e-6)


@pytest.mark.parametrize("limit", LIMITS)
def test_limits_hold_for_measured_ranges(limit):
    """At a limit, noise makes half of the beams return, within the limit."""
    model = MeasurementModel(range_noise=0.1)
    returns = model.measure(constant(limit), *LIMITS, 0)
    assert abs(len(returns.beams) / NUM_BEAMS - 0.5) < 0.006
    assert returns.ranges.min() >= np.float32(0.8)
    assert returns.ranges.max() <= 120.0


def test_reach_includes_what_noise_may_bring_near():
    assert 120.0 < IDEAL.reach(120.0) < 120.01
    assert MeasurementModel(range_noise=0.1).reach(120.0) > 120.6


@pytest.mark.parametrize("probability", [0.0, 0.1, 0.75, 1.0])
def test_dropout_loses_that_share(probability):
    model = MeasurementModel(dropout=probability)
    kept = model.measure(constant(50.0), *LIMITS, 0)
    share = 1.0 - len(kept.beams) / NUM_BEAMS
    deviation = np.sqrt(probability * (1.0 - probability) / NUM_BEAMS)
    assert abs(share - probability) <= 5 * deviation
    assert (np.diff(kept.beams) > 0).all()


@pytest.mark.parametrize("distance", [1.0, 40.0, 119.0])
def test_faint_returns_are_lost_more_often(distance):
    model = MeasurementModel(dropout=0.2, faint_dropout=0.6)
    kept = model.measure(constant(distance), *LIMITS, 0)
    intensity = np.exp(-0.004 * distance)
    expected = 0.8 * (1.0 - 0.6 * (1.0 - intensity))
    share = len(kept.beams) / NUM_BEAMS
    assert abs(share - expected) < 5 * np.sqrt(0.25 / NUM_BEAMS)


def test_noise_is_of_seed_frame_and_sensor_alone():
    def errors(frame=4, **changes):
        options = {"range_noise": 0.1, "seed": 7, "sensor_name": "lidar"}
        model = MeasurementModel(**(options | changes))
        return model.measure(constant(50.0), *LIMITS, frame).ranges - 50.0

    reference = errors()
    errors(frame=3)  # What came before does not matter.
    np.testing.assert_array_equal(errors(), reference)
    others = [
        errors(frame=5),
        errors(seed=8),
        errors(sensor_name="rear"),
        errors(sensor_name=""),
    ]
    for k, other in enumerate(others):
        for one in [reference, *others[:k]]:
            assert abs(np.corrcoef(one, other)[0, 1]) < 0.012


def test_a_beam_keeps_its_noise_whatever_others_meet():
    options = {"range_noise": 0.1, "dropout": 0.5, "seed": 2}
    model = MeasurementModel(**options)
    all_hit = model.measure(constant(50.0), *LIMITS, 1)
    half_missed = constant(50.0)
    half_missed[::2] = np.inf
    some_hit = model.measure(half_missed, *LIMITS, 1)
    odd = all_hit.beams % 2 == 1
    np.testing.assert_array_equal(some_hit.beams, all_hit.beams[odd])
    np.testing.assert_array_equal(some_hit.ranges, all_hit.ranges[odd])


def test_options_do_not_disturb_each_other():
    both = MeasurementModel(range_noise=0.1, dropout=0.5, seed=2)
    noise = MeasurementModel(range_noise=0.1, seed=2)
    losses = MeasurementModel(dropout=0.5, seed=2)
    measured = both.measure(constant(50.0), *LIMITS, 1)
    np.testing.assert_array_equal(
        measured.ranges,
        noise.measure(constant(50.0), *LIMITS, 1).ranges[measured.beams],
    )
    np.testing.assert_array_equal(
        measured.beams, losses.measure(constant(50.0), *LIMITS, 1).beams
    )


@pytest.mark.parametrize(
    "model", [MeasurementModel(range_noise=0.1), MeasurementModel(dropout=0.5)]
)
def test_frames_before_time_zero_have_noise_of_their_own(model):
    def draw(frame):
        returns = model.measure(constant(50.0), *LIMITS, frame)
        return returns.beams.tobytes() + returns.ranges.tobytes()

    frames = (-(10**20), -2, -1, 0, 1, 2)
    assert len({draw(frame) for frame in frames}) == len(frames)
    assert draw(-3) == draw(-3)
