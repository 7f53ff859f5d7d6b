"""The errors of an IMU against Kalibr's model of them."""

from dataclasses import replace

from helpers.allan import allan_deviation, tolerance
import numpy as np
import pytest

from cns_drake.sensors import ImuErrors, ImuNoise

RATE = 100
HOURS = 1.5 * 3600.0
BLOCK = 1024
# Kalibr's example of an ADIS16448.
WHITE = ImuNoise(
    accelerometer_noise_density=0.01, gyroscope_noise_density=0.005, seed=3
)
WALK = ImuNoise(
    accelerometer_random_walk=2e-4, gyroscope_random_walk=4e-6, seed=4
)


def stand(noise, duration=HOURS):
    """Returns the errors (N, 6) of an IMU at rest."""
    blocks = int(duration * RATE) // BLOCK
    return ImuErrors(noise, RATE).measure(0, np.zeros((blocks * BLOCK, 6)))


def error_at(errors, sample):
    """Returns the errors (6,) of one sample."""
    return errors.measure(sample, np.zeros((1, 6)))[0]


@pytest.fixture(scope="module")
def white():
    return stand(WHITE)


@pytest.fixture(scope="module")
def walk():
    return stand(WALK)


def test_white_noise_has_its_density_at_one_second(white):
    expected = np.repeat([0.01, 0.005], 3)
    found = allan_deviation(white, RATE, 1.0)
    np.testing.assert_allclose(found, expected, rtol=tolerance(HOURS, 1.0))
    slope = np.log(allan_deviation(white, RATE, 4.0) / found) / np.log(4.0)
    np.testing.assert_allclose(slope, -0.5, atol=0.04)


def test_the_walk_has_its_density_at_three_seconds(walk):
    expected = np.repeat([2e-4, 4e-6], 3)
    found = allan_deviation(walk, RATE, 3.0)
    np.testing.assert_allclose(found, expected, rtol=tolerance(HOURS, 3.0))
    slope = np.log(allan_deviation(walk, RATE, 12.0) / found) / np.log(4.0)
    np.testing.assert_allclose(slope, 0.5, atol=0.06)


# The last one is half of the way to where the walk is drawn first.
@pytest.mark.parametrize("blocks", [50, 2**31])
def test_the_walk_starts_at_zero_and_spreads_as_the_root_of_time(blocks):
    ends = []
    for seed in range(200):
        errors = ImuErrors(replace(WALK, seed=seed), RATE)
        assert not error_at(errors, 0).any()
        ends.append(error_at(errors, blocks * BLOCK + 300)[:3])
    time = (blocks * BLOCK + 300) / RATE
    # 600 independent numbers: 3 standard errors are 9 %.
    assert np.std(ends) == pytest.approx(2e-4 * np.sqrt(time), rel=0.09)


def test_the_walk_has_no_jump_between_blocks(walk):
    steps = np.diff(walk, axis=0)
    between = steps[BLOCK - 1 :: BLOCK]
    assert len(between) > 500
    ratio = between.std(axis=0) / steps.std(axis=0)
    # Three standard errors of a thousand steps.
    np.testing.assert_allclose(ratio, 1.0, atol=0.07)
    neighbours = np.corrcoef(steps[:-1, 0], steps[1:, 0])[0, 1]
    assert abs(neighbours) < 3.0 / np.sqrt(len(steps))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_walk_goes_on_without_a_jump_where_it_is_drawn_first(sign):
    """The first node is 2^32 blocks away; others are twice as far each."""
    errors = ImuErrors(WALK, RATE)
    step = 2e-4 / np.sqrt(RATE)
    for doublings in (0, 1, 9):
        node = sign * BLOCK << 32 + doublings
        near = errors.measure(node - 2, np.zeros((5, 6)))
        assert np.abs(np.diff(near[:, :3], axis=0)).max() < 6.0 * step
        # A walk spreads as the root of time.
        share = np.abs(near[0, :3]).max() / (step * np.sqrt(abs(node)))
        assert 0.05 < share < 5.0


@pytest.mark.parametrize("first", [0, 5 * BLOCK - 3, -BLOCK - 2, 10**9])
def test_a_sample_depends_on_its_number_alone(first):
    noise = replace(WHITE, accelerometer_random_walk=1e-3)
    samples = list(range(first, first + 6))
    ahead = ImuErrors(noise, RATE)
    forwards = [error_at(ahead, sample) for sample in samples]
    behind = ImuErrors(noise, RATE)
    backwards = [error_at(behind, sample) for sample in samples[::-1]]
    np.testing.assert_array_equal(forwards, backwards[::-1])
    assert len(np.unique(forwards)) == 6 * len(samples)


def test_seed_and_name_make_a_difference():
    found = {
        tuple(error_at(ImuErrors(noise, RATE), 7))
        for noise in (
            WHITE,
            replace(WHITE, seed=9),
            replace(WHITE, sensor_name="other"),
        )
    }
    assert len(found) == 3


def test_turn_on_bias_stays_and_differs_between_runs():
    drawn = []
    for seed in range(300):
        noise = ImuNoise(
            accelerometer_turn_on_bias=0.2,
            gyroscope_turn_on_bias=0.01,
            seed=seed,
        )
        errors = ImuErrors(noise, RATE)
        np.testing.assert_array_equal(
            error_at(errors, 0), error_at(errors, 10**7)
        )
        drawn.append(error_at(errors, 0))
    spread = np.reshape(drawn, (300, 2, 3)).std(axis=(0, 2))
    # 900 independent numbers: 3 standard errors are 7 %.
    np.testing.assert_allclose(spread, [0.2, 0.01], rtol=0.07)


def test_measurements_end_at_the_range():
    noise = ImuNoise(accelerometer_range=20.0, gyroscope_range=0.5)
    exact = np.array([19.999, 20.001, -25.0, 0.499, -0.501, 3.0])
    measured = ImuErrors(noise, RATE).measure(5, exact[None])
    np.testing.assert_array_equal(
        measured, [[19.999, 20.0, -20.0, 0.499, -0.5, 0.5]]
    )


def test_an_ideal_imu_errs_by_nothing():
    assert not stand(ImuNoise(), 60.0).any()


def test_variances_of_samples_are_those_of_messages(white):
    assert WHITE.variances(RATE) == (0.01**2 * RATE, 0.005**2 * RATE)
    np.testing.assert_allclose(
        white.var(axis=0), np.repeat(WHITE.variances(RATE), 3), rtol=0.01
    )
