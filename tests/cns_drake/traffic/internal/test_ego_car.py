"""Which bodies the ego car meets."""

import numpy as np
import pytest
import shapely
from shapely import affinity

from cns_drake.traffic import EgoBox
from cns_drake.traffic.ego_car import meetings_with_ego
from cns_drake.traffic.traffic_plan import Tracks

BOX = EgoBox(-1.0, 3.0, 1.0)


def ego(t):
    """Drives on a circle around the origin, at 5 m/s."""
    angle = t / 4.0
    xy = 20.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    return xy, angle + np.pi / 2


def rectangle(x, y, yaw, length, width):
    box = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
    return affinity.translate(
        affinity.rotate(box, yaw, origin=(0, 0), use_radians=True), x, y
    )


@pytest.mark.parametrize("seed", range(4))
def test_those_whose_boxes_overlap_at_a_time(seed):
    """Shapely places each box on its own."""
    rng = np.random.default_rng(seed)
    number = 20
    values = np.zeros((26, number, 5))
    values[0, :, :2] = rng.uniform(-25.0, 25.0, (number, 2))
    values[:, :, 3] = rng.uniform(-9.0, 9.0, number)
    speed = rng.uniform(-1.0, 1.0, (number, 2))
    values[:, :, :2] = values[0, :, :2] + np.arange(26)[:, None, None] * speed
    present = rng.random(number) < np.linspace(0.2, 1.0, number)
    tracks = Tracks(1.0, values, np.tile(present, (26, 1)))
    sizes = rng.uniform(0.5, 6.0, (number, 2))
    times = np.arange(0.0, 25.0, 0.1)
    found = meetings_with_ego(tracks, sizes, times, ego, BOX)
    expected = np.zeros((len(times), number), bool)
    for step, (x, y), yaw in zip(range(len(times)), *ego(times), strict=True):
        middle = x + np.cos(yaw), y + np.sin(yaw)
        car = rectangle(*middle, yaw, 4.0, 2.0)
        for k, row in enumerate(tracks.at(times[step])[0]):
            own = rectangle(*row[[0, 1, 3]], *sizes[k])
            expected[step, k] = present[k] and own.intersects(car)
    np.testing.assert_array_equal(found, expected)
    assert 0 < found.any(axis=0).sum() < present.sum()
