"""Routes at random: legal, long enough, and the same for the same seed."""

import numpy as np
import pytest

from evaluation.base import InputError
from worlds.maps import shipped_maps
from worlds.roads import draw_route, load_road_network, make_lane_path


@pytest.fixture(scope="module", params=sorted(shipped_maps()))
def network(request):
    return load_road_network(shipped_maps()[request.param] / "roads.yaml")


@pytest.mark.parametrize("seed", range(4))
def test_routes_are_legal_and_long_enough(network, seed):
    route = draw_route(network, 900.0, np.random.default_rng(seed))
    # Raises where two legs do not meet or the way between them is not legal.
    path = make_lane_path(network, route, 0.5)
    longest = max(road.full_length for road in network.roads.values())
    assert 900.0 < path.length < 900.0 + longest + 50.0 * len(route.root)
    roads = [leg.road for leg in route.root]
    assert len(set(roads)) >= 0.6 * len(roads)


def test_the_same_seed_gives_the_same_route(network):
    routes = [
        draw_route(network, 700.0, np.random.default_rng(seed))
        for seed in (5, 5, 6)
    ]
    assert routes[0] == routes[1] != routes[2]


def test_a_road_between_dead_ends_has_no_route(tmp_path):
    (tmp_path / "roads.yaml").write_text(
        "defaults: {lanes: [1, 1], lane_width: 3.5, sidewalk: 2.0,"
        " kerb_height: 0.1, speed_limit: 10.0}\n"
        "junctions:\n"
        "  a: {position: [0, 0], kerb_radius: 4, dead_end: true}\n"
        "  b: {position: [90, 0], kerb_radius: 4, dead_end: true}\n"
        "roads:\n"
        "  ab: {start: a, end: b}\n"
    )
    network = load_road_network(tmp_path / "roads.yaml")
    with pytest.raises(InputError, match="every lane comes to an end"):
        draw_route(network, 100.0, np.random.default_rng(0))
