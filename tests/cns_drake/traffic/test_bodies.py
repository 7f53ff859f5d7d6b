"""Bodies of traffic: they fill their boxes, stand, and hold together."""

from helpers.recorded_traffic import write_recorded
from helpers.traffic_diagrams import TrafficDiagram
import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cns_drake.scene import read_perception_geometry
from cns_drake.traffic import read_recorded, traffic_structures
from evaluation.base import MAX_INSTANCE, InputError

KINDS = [
    "city_car", "hatchback", "saloon", "estate", "suv", "van", "box_truck",
    "bus", "motorcycle", "bicycle",
]  # fmt: skip
NUM_WALKERS = 6
# Height of the box of a pedestrian [m].
WALKER_HEIGHT = 1.8
ENDS = np.linspace(-0.5, 0.5, 10)


def surface_points(geometry):
    """Returns places (N, 3) on a geometry, in the frame of its limb."""
    surface, X_FG = geometry.surface, geometry.X_FG
    if hasattr(surface, "triangles"):
        points = surface.p_GVset
    else:
        # A line from end to end, turned about the axis.
        line = [(surface.radius, z * surface.length) for z in ENDS]
        if type(surface).__name__ == "CapsuleSurface":
            line = [
                (surface.radius * np.cos(up), surface.radius * np.sin(up) + z)
                for end, z in ((-1, line[0][1]), (1, line[-1][1]))
                for up in end * np.linspace(0.0, np.pi / 2, 5)[::end]
            ]
            line += [(surface.radius, z * surface.length) for z in ENDS]
        r, z = np.transpose(line)
        angle = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)[:, None]
        points = np.stack(
            [r * np.cos(angle), r * np.sin(angle), z + 0 * angle], axis=-1
        ).reshape(-1, 3)
    return (X_FG @ points.T).T


def plan_of(folder, kinds, walkers):
    """All stand at the origin."""
    path = folder / "traffic.npz"
    write_recorded(
        path, np.zeros((2, len(kinds), 5)), np.zeros((2, walkers, 4)), kinds
    )
    return read_recorded(path)


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    return plan_of(tmp_path_factory.mktemp("traffic"), KINDS, NUM_WALKERS)


@pytest.fixture(scope="module")
def bodies(plan):
    """The places on each shape of one body of each kind, and of walkers."""
    diagram = TrafficDiagram(plan, seed=1)
    X_WLs = diagram.limb_poses(0.0)
    found = {frame: [] for frame in X_WLs}
    for geometry in read_perception_geometry(diagram.inspector):
        p_WL = X_WLs[geometry.frame_id].translation()
        found[geometry.frame_id].append(surface_points(geometry) + p_WL)
    return [
        [one for frame in body.frames for one in found[frame]]
        for body in diagram.traffic.bodies
    ]


def extent(body):
    """Returns the least and the greatest coordinates of a body [m]."""
    points = np.concatenate(body)
    return points.min(axis=0), points.max(axis=0)


@pytest.mark.parametrize("number", range(len(KINDS)))
def test_vehicles_stand_on_the_ground_and_fill_their_boxes(
    plan, bodies, number
):
    """And the wheels are below the axles with which they stand in lanes."""
    kind = plan.kinds[number]
    assert kind.name == KINDS[number]
    body = bodies[number]
    low, high = extent(body)
    length, width, height = kind.size
    assert low[2] == pytest.approx(0.0, abs=1e-9)
    assert height - 0.04 < high[2] <= height
    assert (np.maximum(-low, high)[:2] <= (length / 2, width / 2)).all()
    assert high[0] - low[0] > length - 0.15
    np.testing.assert_allclose(-low[1], high[1])
    if len(body) <= 3:
        assert high[1] > width / 2 - 0.02
    points = np.concatenate(body)
    below = points[points[:, 2] < 1e-3, 0]
    found = below[below < 0.0].mean(), below[below > 0.0].mean()
    np.testing.assert_allclose(found, kind.axles, atol=0.04)


def test_walkers_stand_and_are_alike_on_both_sides(bodies):
    heights = []
    for body in bodies[len(KINDS) :]:
        low, high = extent(body)
        assert 0.0 <= low[2] < 0.03
        assert 1.5 < high[2] < WALKER_HEIGHT
        np.testing.assert_allclose(-low[1], high[1])
        heights.append(high[2])
    assert np.ptp(heights) > 0.1


def test_riders_and_walkers_hold_together(bodies):
    """Between one shape and another there is no gap."""
    for number, body in enumerate(bodies):
        if number < len(KINDS) and len(body) < 4:
            continue
        trees = [cKDTree(points) for points in body]
        gaps = [
            [tree.query(points)[0].min() for points in body] for tree in trees
        ]
        # Only corners stand for the boxes of a motorcycle.
        is_coarse = any(len(points) == 8 for points in body)
        joined = np.array(gaps) < (0.15 if is_coarse else 0.05)
        assert connected_components(joined)[0] == 1


def test_bodies_have_the_last_instance_ids(tmp_path):
    plan = plan_of(tmp_path, KINDS[:3], 3)
    entries = list(traffic_structures(plan, MAX_INSTANCE - 5))
    assert [e.instance for e in entries] == [
        *range(MAX_INSTANCE - 5, MAX_INSTANCE + 1)
    ]
    with pytest.raises(InputError, match="6 bodies and"):
        traffic_structures(plan, MAX_INSTANCE - 4)
