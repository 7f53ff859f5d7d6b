from itertools import cycle

from helpers.building_checks import (
    cast,
    normals,
    placed_triangles,
    rays_from_the_street,
    rounded_block,
    typical_model,
    typical_request,
)
from helpers.mesh_checks import out_of_plane
import numpy as np
import pytest
import shapely
from shapely.affinity import scale
from shapely.geometry import MultiPoint, Polygon, box

from worlds.city import ARCHETYPES, sample
from worlds.shapes import MeshShape, Site

# How far walls reach into the ground [m].
FOUNDATION_M = 0.5
# Plinths and pilasters may stand this far outside the footprint [m].
GROUND_OVERHANG_M = 0.35
# Above this height, the archetype's own overhang applies [m].
HEAD_ROOM_M = 2.3

# By day, generated cities are compared with the committed ones byte by byte.
pytestmark = [pytest.mark.slow, pytest.mark.night]

NAMES = sorted(ARCHETYPES)
ANY_OUTLINE = [name for name in NAMES if ARCHETYPES[name].any_outline]
PARTY_WALLS = [name for name in NAMES if ARCHETYPES[name].party_walls]
# Rays along an edge may hit the face behind it, in single precision.
EDGE_HITS = 2e-4
# Meshes that many buildings share.
SHARED = ("roof_", "fire_stairs", "railing_panel")
HOUSES = (
    "bungalow",
    "detached_house",
    "park_pavilion",
    "row_house",
    "semi_detached",
)
TOWERS = (
    "art_deco_tower",
    "banded_tower",
    "glass_skyscraper",
    "podium_tower",
    "unfinished_tower",
)

every_building = pytest.mark.parametrize("name", NAMES)


def text_of(model):
    meshes = [f"{k}\n{m.to_obj()}" for k, m in sorted(model.meshes.items())]
    return "\n".join([*map(repr, model.parts), *meshes])


def obj_bytes(model):
    return sum(
        len(mesh.to_obj())
        for name, mesh in model.meshes.items()
        if not name.startswith(SHARED)
    )


def check_closed(triangles, origins, directions) -> None:
    """Asserts that rays from outside meet no face from behind."""
    hits, _ = cast(triangles, origins, directions)
    hit = hits >= 0
    assert hit.mean() > 0.1
    facing = np.einsum(
        "ij,ij->i", normals(triangles)[hits[hit]], directions[hit]
    )
    assert (facing > 1e-6).sum() <= max(2, EDGE_HITS * hit.sum())


def outside(points, region) -> float:
    """Greatest distance of points from a region [m]."""
    return float(shapely.distance(region, shapely.points(points)).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_bytes(name):
    footprint, height = typical_request(name, 1)
    texts = [
        text_of(sample(name, footprint, height, np.random.default_rng(seed)))
        for seed in (5, 5)
    ]
    assert texts[0] == texts[1]


@every_building
def test_parts_and_meshes_belong_together(name):
    model = typical_model(name)
    assert all(isinstance(part.shape, MeshShape) for part in model.parts)
    part_names = [part.name for part in model.parts]
    assert len(set(part_names)) == len(part_names)
    assert {part.shape.mesh for part in model.parts} == set(model.meshes)
    for mesh in model.meshes:
        assert mesh.startswith((f"{name}_007_", *SHARED))


@every_building
def test_height_is_as_asked(name):
    _, height = typical_request(name, 1)
    top = placed_triangles(typical_model(name), True)[:, :, 2].max()
    assert top == pytest.approx(height, abs=0.02)


@every_building
def test_building_stays_on_its_ground(name):
    model = typical_model(name)
    corners = placed_triangles(model).reshape(-1, 3)
    assert corners[:, 2].min() == pytest.approx(-FOUNDATION_M, abs=2e-3)
    low = corners[corners[:, 2] < HEAD_ROOM_M]
    assert outside(low[:, :2], model.footprint) <= GROUND_OVERHANG_M + 2e-3
    overhang = ARCHETYPES[name].overhang
    assert outside(corners[:, :2], model.footprint) <= overhang + 2e-3


@every_building
def test_faces_are_plane_convex_and_not_degenerate(name):
    for key, mesh in typical_model(name).meshes.items():
        assert out_of_plane(mesh) < 3e-3, key
        quads = np.array([f for f in mesh.faces if len(f) == 4], dtype=int)
        quads = quads.reshape(-1, 4)
        corners = mesh.vertices[quads]
        turns = np.cross(
            corners - np.roll(corners, 1, axis=1),
            np.roll(corners, -1, axis=1) - corners,
        )
        mean = turns.sum(axis=1, keepdims=True)
        mean /= np.linalg.norm(mean, axis=2, keepdims=True)
        # Rounding to millimetres may bend an almost straight corner.
        assert ((turns * mean).sum(axis=2) > -2e-3).all(), key


@every_building
def test_cost_stays_within_the_budget(name):
    model = typical_model(name)
    most_triangles, most_bytes = 25_000, 70_000
    if name in TOWERS:
        most_triangles, most_bytes = 40_000, 90_000
    elif name in HOUSES:
        most_triangles, most_bytes = 2_500, 27_000
    assert len(placed_triangles(model)) < most_triangles
    assert obj_bytes(model) < most_bytes
    assert len(model.parts) <= 28


@every_building
def test_rays_from_the_street_never_see_the_inside(name):
    footprint, height = typical_request(name, 1)
    triangles = placed_triangles(typical_model(name))
    origins, directions = rays_from_the_street(
        footprint, min(height, 60.0), 12_000, 1
    )
    check_closed(triangles, origins, directions)


@every_building
def test_rays_from_above_never_see_the_inside(name):
    footprint, height = typical_request(name, 1)
    triangles = placed_triangles(typical_model(name))
    rng = np.random.default_rng(1)
    x0, y0, x1, y1 = footprint.bounds
    count = 12_000
    origins = np.column_stack(
        [
            rng.uniform(x0, x1, count),
            rng.uniform(y0, y1, count),
            np.full(count, height + 30.0),
        ]
    )
    tilt = rng.uniform(-0.3, 0.3, (count, 2))
    directions = np.column_stack([tilt, -np.ones(count)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    check_closed(triangles, origins, directions)


@pytest.mark.parametrize("name", ANY_OUTLINE)
def test_any_outline_gets_closed_walls(name):
    block = rounded_block()
    height = float(np.mean(ARCHETYPES[name].heights))
    model = sample(name, block, height, np.random.default_rng(8))
    triangles = placed_triangles(model)
    overhang = ARCHETYPES[name].overhang
    corners = triangles.reshape(-1, 3)
    assert outside(corners[:, :2], block) <= overhang + 2e-3
    # The hull of the lowest metre, widened a little, covers the whole block.
    hull = MultiPoint(corners[corners[:, 2] < 1.0][:, :2]).convex_hull
    assert block.difference(hull.buffer(0.05)).area < 0.01 * block.area
    origins, directions = rays_from_the_street(block, 40.0, 12_000, 1)
    check_closed(triangles, origins, directions)


@pytest.mark.parametrize(
    ("name", "blind"),
    # Each building gets one of the three in turn.
    list(zip(NAMES, cycle([(1,), (3,), (1, 3)]), strict=False)),
)
def test_nothing_crosses_blind_edges(name, blind):
    footprint, height = typical_request(name, 2)
    rng = np.random.default_rng(3)
    model = sample(name, footprint, height, rng, blind_edges=blind)
    assert model.footprint.equals(footprint)
    triangles = placed_triangles(model)
    corners = triangles.reshape(-1, 3)
    x0, _, x1, _ = footprint.bounds
    if 1 in blind:
        assert corners[:, 0].max() <= x1 + 2e-3
    if 3 in blind:
        assert corners[:, 0].min() >= x0 - 2e-3
    origins, directions = rays_from_the_street(footprint, height, 12_000, 1)
    check_closed(triangles, origins, directions)


@pytest.mark.parametrize("name", PARTY_WALLS)
def test_party_walls_stand_flush_on_the_boundary(name):
    footprint, height = typical_request(name, 3)
    _, y0, x1, y1 = footprint.bounds
    rng = np.random.default_rng(12)
    model = sample(name, footprint, height, rng, blind_edges=(1,))
    ys, zs = np.meshgrid(
        np.linspace(y0, y1, 82)[1:-1], np.linspace(0.1, 0.5 * height, 40)
    )
    origins = np.column_stack([np.full(ys.size, 90.0), ys.ravel(), zs.ravel()])
    directions = np.tile([-1.0, 0.0, 0.0], (ys.size, 1))
    _, distance = cast(placed_triangles(model), origins, directions)
    # Steps in front and a yard behind may take room.
    near = distance < 90.0 - x1 + 2.0
    assert near.mean() > 0.35
    assert np.isclose(distance[near], 90.0 - x1, atol=1e-3).mean() > 0.85


@pytest.mark.parametrize("name", NAMES)
def test_two_draws_differ_in_shape(name):
    footprint, height = typical_request(name, 1)
    rays = rays_from_the_street(footprint, min(height, 50.0), 4_000, 2)
    other = sample(name, footprint, height, np.random.default_rng([2, 77]))
    distances = [
        cast(placed_triangles(model), *rays)[1]
        for model in (typical_model(name), other)
    ]
    moved = np.abs(distances[0] - distances[1]) > 0.1
    assert moved.mean() > 0.02


def test_a_rectangle_fronts_to_its_least_y_wherever_it_starts():
    for shift in range(4):
        ring = list(box(2, 3, 22, 15).exterior.coords)[:-1]
        ring = ring[shift:] + ring[:shift]
        for order in (ring, ring[::-1]):
            outline = Site(Polygon(order), "b").outline
            np.testing.assert_array_equal(
                outline, [(2, 3), (22, 3), (22, 15), (2, 15)]
            )


def test_other_outlines_keep_their_first_edge_in_front():
    block = rounded_block()
    outline = Site(block, "b").outline
    start, end = np.array(block.exterior.coords[:2])
    if not block.exterior.is_ccw:
        start, end = end, start
    np.testing.assert_allclose(outline[:2], [start, end])


@pytest.mark.parametrize("name", NAMES)
def test_impossible_requests_are_refused(name):
    kind = ARCHETYPES[name]
    footprint, height = typical_request(name, 1)
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="m high"):
        sample(name, footprint, kind.heights[1] + 0.1, rng)
    with pytest.raises(ValueError, match="has sides of"):
        sample(name, scale(footprint, 0.2, 0.2), height, rng)
    if not kind.any_outline:
        block = rounded_block()
        x0, y0, x1, y1 = block.bounds
        size = 0.98 * kind.widths[1] / max(x1 - x0, y1 - y0)
        with pytest.raises(ValueError, match="rectangular"):
            sample(name, scale(block, size, size), height, rng)


@pytest.mark.parametrize(
    ("names", "most_bytes"), [(NAMES, 45_000), (HOUSES, 20_000)]
)
def test_the_stock_is_cheap_on_average(names, most_bytes):
    costs = [obj_bytes(typical_model(name)) for name in names]
    assert np.mean(costs) < most_bytes
