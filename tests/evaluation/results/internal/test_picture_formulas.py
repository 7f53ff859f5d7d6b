"""What is in sight of a drive, and how heights are coloured."""

from helpers.driven_walls import ROUTE, driven_map, wall
import numpy as np
import pytest

from evaluation.results.sections.change_pictures import is_in_sight
from evaluation.results.sections.point_rendering import (
    colour_by_height,
    shade_by_height,
)


@pytest.mark.parametrize("distance", [5.0, 12.0, 20.0, 50.0])
def test_a_wall_hides_what_is_behind_it(distance):
    other = driven_map(wall(distance, 40.0), ROUTE)
    points = np.array(
        [
            [distance + 3.0, 0.0, 2.0],  # Behind.
            [distance - 3.0, 0.0, 2.0],  # In front.
            [distance, 3.0, 2.0],  # In the wall itself.
            [-distance, 0.0, 2.0],  # On the other side of the car.
            [-85.0, 0.0, 2.0],  # Too far.
        ]
    )
    seen = is_in_sight(points, other)
    assert seen.tolist() == [False, True, True, True, False]


def test_lower_points_are_darker():
    colours = np.full((101, 3), 200, dtype=np.uint8)
    shaded = shade_by_height(colours, np.linspace(0.0, 50.0, 101), darkest=0.5)
    assert (np.diff(shaded[:, 0].astype(int)) >= 0).all()
    assert shaded[0].tolist() == [100] * 3
    assert shaded[-1].tolist() == [200] * 3
    level = shade_by_height(colours, np.full(101, 3.0), darkest=0.5)
    assert (level == 100).all()


def test_colours_between_two():
    heights = np.linspace(0.0, 50.0, 101)
    low, high = (200, 100, 0), (0, 100, 200)
    rgb = colour_by_height(heights, low, high).astype(int)
    assert rgb[0].tolist() == list(low)
    assert rgb[-1].tolist() == list(high)
    assert (np.diff(rgb[:, 0]) <= 0).all()
    # From the 5 % to the 99 % quantile.
    part = ((25.0 - 2.5) / (49.5 - 2.5)) ** 0.5
    assert rgb[50].tolist() == pytest.approx(
        [200 * (1 - part), 100, 200 * part], abs=1.0
    )
