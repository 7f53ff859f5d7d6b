"""Lanes and speed limits of OpenStreetMap's tags."""

import pytest

from cns_drake.imports.openstreetmap.speed_tags import speed_limit
from cns_drake.imports.openstreetmap.street_lanes import lane_layout


def tags(**values):
    return {key.replace("__", ":"): v for key, v in values.items()}


@pytest.mark.parametrize(
    ("street", "width", "lanes"),
    [
        ({"highway": "residential"}, 6.5, (1, 1)),
        # Two cars cannot pass.
        ({"highway": "service"}, 4.5, (0, 0)),
        ({"highway": "living_street"}, 5.5, (1, 1)),
        ({"highway": "living_street"}, 5.49, (0, 0)),
        ({"highway": "residential", "oneway": "yes"}, 3.9, (1, 0)),
        ({"highway": "residential", "oneway": "-1"}, 3.9, (0, 1)),
        ({"highway": "residential", "oneway": "yes"}, 2.7, (0, 0)),
        ({"highway": "primary", "lanes": "4"}, 12.5, (2, 2)),
        ({"highway": "primary", "lanes": "4"}, 10.9, (1, 2)),
        ({"highway": "primary", "lanes": "3", "oneway": "yes"}, 9.5, (3, 0)),
        ({"highway": "primary", "lanes": "3", "lanes__forward": "2"}, 9.5,
         (2, 1)),
        ({"highway": "primary", "lanes": "3", "lanes__backward": "2"}, 9.5,
         (1, 2)),
        ({"highway": "primary", "lanes": "3"}, 9.5, (1, 1)),
        ({"highway": "primary", "lanes": "many"}, 11.0, (1, 1)),
        ({"highway": "primary"}, 14.0, (2, 2)),
        ({"highway": "motorway"}, 7.2, (2, 0)),
        ({"highway": "residential", "access": "private"}, 6.5, (0, 0)),
        # The tag for the most specific vehicle counts.
        ({"highway": "residential", "access": "no", "motor_vehicle": "yes"},
         6.5, (1, 1)),
        ({"highway": "residential", "vehicle": "no", "motorcar": "yes"},
         6.5, (1, 1)),
        ({"highway": "residential", "access": "yes", "motorcar": "no"},
         6.5, (0, 0)),
    ],
)  # fmt: skip
def test_numbers_of_lanes(street, width, lanes):
    layout = lane_layout(tags(**street), width)
    assert layout[:2] == lanes
    assert layout.width * sum(lanes) <= width


def test_lanes_lie_side_by_side():
    two, one = lane_layout(tags(lanes="3", lanes__forward="2"), 9.5)[:2]
    layout = lane_layout(tags(lanes="3", lanes__forward="2"), 9.5)
    assert (two, one) == (2, 1)
    width = 9.5 / 3
    # To the right of the line: inner, outer; and the one of the other side.
    right = [layout.offset(True, 0), layout.offset(True, 1)]
    right.append(-layout.offset(False, 0))
    assert right == pytest.approx([0.0, width, -width])


@pytest.mark.parametrize(
    ("street", "width", "places"),
    [
        # The lane between both directions is for turning.
        ({"lanes": "3", "lanes__both_ways": "1"}, 9.6, [3.2]),
        ({"lanes": "5", "lanes__forward": "2", "lanes__backward": "2"}, 15.0,
         [3.0, 6.0]),
        ({"lanes": "2"}, 12.0, [3.0]),
        ({"lanes": "2", "oneway": "yes"}, 12.0, [-3.0, 3.0]),
        # Without the tag, or with a wrong one, lanes are not wider than usual.
        ({}, 8.0, [1.625]),
        ({"lanes": "1"}, 12.0, [1.625]),
        ({"lanes__forward": "1", "lanes__backward": "1"}, 14.0, [1.625]),
        # One lane has no room.
        ({"lanes": "4", "oneway": "yes"}, 9.0, [-3.0, 0.0, 3.0]),
    ],
)  # fmt: skip
def test_lanes_share_the_width_of_the_street(street, width, places):
    layout = lane_layout(tags(**street), width)
    found = [layout.offset(True, k) for k in range(layout.forward)]
    assert found == pytest.approx(places)


@pytest.mark.parametrize(
    ("street", "limit"),
    [
        ({"maxspeed": "50"}, 50 / 3.6),
        ({"maxspeed": "30 mph"}, 30 * 1609.344 / 3600),
        ({"maxspeed": "30mph"}, 30 * 1609.344 / 3600),
        ({"maxspeed": "20 km/h"}, 20 / 3.6),
        ({"maxspeed": "50; 30"}, 30 / 3.6),
        ({"maxspeed": "walk"}, 7 / 3.6),
        ({"maxspeed": "DE:urban"}, 50 / 3.6),
        ({"maxspeed": "DE:zone:30"}, 30 / 3.6),
        ({"maxspeed": "DE:zone30"}, 30 / 3.6),
        ({"zone__maxspeed": "DE:30"}, 30 / 3.6),
        ({"maxspeed": "FR:80"}, 80 / 3.6),
        ({"maxspeed": "BE-VLG:70"}, 70 / 3.6),
        ({"maxspeed": "GB:nsl_single"}, 60 * 1609.344 / 3600),
        ({"maxspeed": "GB:zone20"}, 20 * 1609.344 / 3600),
        ({"maxspeed": "none", "highway": "motorway"}, 120 / 3.6),
        ({"maxspeed": "0", "highway": "residential"}, 30 / 3.6),
        ({"maxspeed": "999", "highway": "primary"}, 50 / 3.6),
        ({"highway": "living_street"}, 7 / 3.6),
        ({"highway": "primary_link"}, 50 / 3.6),
        ({"maxspeed": "50", "maxspeed__backward": "30"}, 50 / 3.6),
    ],
)
def test_speed_limits(street, limit):
    assert speed_limit(tags(**street)) == pytest.approx(limit, rel=1e-4)


def test_a_limit_of_one_direction():
    street = tags(maxspeed="50", maxspeed__backward="30")
    assert speed_limit(street, is_forward=False) == pytest.approx(30 / 3.6)
