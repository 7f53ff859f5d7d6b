import math

import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.methods.scan_context import (
    ScanContextConfig,
    _cart_context,
    _polar_context,
)

NAME = "scan-context++"


def method(**parameters):
    return make_method(NAME, parameters)


def cluster(r, azimuth_deg, height, number=5):
    """Returns points above one place, the highest at `height`, from z = 0.

    They are 0.6 m apart, so that thinning to 0.5 m leaves each.
    """
    a = math.radians(azimuth_deg)
    z = height - 0.6 * np.arange(number)
    return np.stack(
        [np.full(number, r * math.cos(a)), np.full(number, r * math.sin(a)), z],
        axis=1,
    )


class TestPolarContext:
    config = ScanContextConfig()

    @pytest.mark.parametrize(
        ("r", "azimuth_deg", "ring", "sector"),
        [
            (0.1, 0.1, 0, 0),
            (3.999, 5.9, 0, 0),
            (4.001, 6.1, 1, 1),
            (41.0, 90.1, 10, 15),
            (41.0, 179.9, 10, 29),
            (41.0, -179.9, 10, 30),
            (79.9, -0.1, 19, 59),
            # Points beyond the last ring count in the last ring.
            (80.1, 200.0, 19, 33),
            (140.0, 200.0, 19, 33),
        ],
    )
    def test_cells(self, r, azimuth_deg, ring, sector):
        image = _polar_context(cluster(r, azimuth_deg, 7.0), self.config)
        assert image.shape == (20, 60)
        assert image[ring, sector] == 7.0
        assert np.count_nonzero(image) == 1

    def test_sectors_are_closed_above(self):
        # Exactly on the x axis: azimuth 0 belongs to the first sector; on
        # the y axis: 90 deg is the end of sector 14.
        on_x = np.tile([10.0, 0.0, 3.0], (5, 1))
        on_y = np.tile([0.0, 10.0, 3.0], (5, 1))
        assert _polar_context(on_x, self.config)[2, 0] == 3.0
        assert _polar_context(on_y, self.config)[2, 14] == 3.0

    def test_a_cell_needs_five_points(self):
        four, five = cluster(30.0, 33.0, 9.0, 4), cluster(30.0, 33.0, 9.0, 5)
        assert not _polar_context(four, self.config).any()
        assert _polar_context(five, self.config)[7, 5] == 9.0

    @pytest.mark.parametrize(("r", "seen"), [(79.999, True), (80.001, False)])
    def test_far_points_may_be_dropped(self, r, seen):
        config = ScanContextConfig(far_points="dropped")
        image = _polar_context(cluster(r, 200.0, 7.0), config)
        assert image[19, 33] == (7.0 if seen else 0.0)
        assert np.count_nonzero(image) == int(seen)

    def test_below_the_ground_is_kept(self):
        image = _polar_context(cluster(30.0, 33.0, -0.5), self.config)
        assert image[7, 5] == -0.5

    def test_height_is_from_the_ground_and_thinned(self):
        scan = cluster(30.0, 33.0, 9.0)
        contexts = method(sensor_height=2.5, variant="polar").describe(scan)
        assert contexts.images[0, 7, 5] == pytest.approx(11.5)
        # Two points in one voxel count as one, at their mean.
        doubled = np.vstack([scan, scan + np.array([0.0, 0.0, 0.1])])
        contexts = method(sensor_height=2.5, variant="polar").describe(doubled)
        assert contexts.images[0, 7, 5] == pytest.approx(11.55)

    def test_keys(self):
        scan = np.vstack([cluster(30.0, 33.0, 9.0), cluster(30.0, 50.0, 3.0)])
        contexts = method(sensor_height=0.0, variant="polar").describe(scan)
        retrieval = np.zeros(20)
        retrieval[7] = 12.0 / 60.0
        aligning = np.zeros(60)
        aligning[[5, 8]] = 9.0 / 20.0, 3.0 / 20.0
        np.testing.assert_allclose(contexts.retrieval_keys, [retrieval])
        np.testing.assert_allclose(contexts.aligning_keys, [aligning])


class TestCartContext:
    config = ScanContextConfig()

    @pytest.mark.parametrize(
        ("x", "y", "row", "column"),
        [
            # Numbers of cells are rounded towards zero: cells at the axes are
            # twice as large.
            (0.1, 0.1, 20, 20),
            (-4.9, -1.9, 20, 20),
            (5.0, -2.0, 21, 19),
            (-99.9, 39.9, 1, 39),
            (99.9, -39.9, 39, 1),
        ],
    )
    def test_cells(self, x, y, row, column):
        image = _cart_context(np.array([[x, y, 7.0]]), self.config)
        assert image.shape == (40, 40)
        assert image[row, column] == 7.0
        assert np.count_nonzero(image) == 1

    @pytest.mark.parametrize(
        ("x", "y"), [(100.0, 1.0), (1.0, 40.0), (0.0, 1.0), (1.0, 0.0)]
    )
    def test_what_is_left_out(self, x, y):
        assert not _cart_context(np.array([[x, y, 7.0]]), self.config).any()

    def test_below_the_ground_is_ground(self):
        assert not _cart_context(
            np.array([[9.0, 9.0, -0.5]]), self.config
        ).any()
