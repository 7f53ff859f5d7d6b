"""Properties of every kind of object."""

from helpers.mesh_checks import out_of_plane, parse_obj, surface_points
import numpy as np
import pytest
from shapely.geometry import MultiPoint

from worlds.shapes import (
    CLASS_IDS,
    OBJECT_MESHES,
    OBJECTS,
    SPECIES,
    Mesh,
    MeshShape,
    part_mesh,
)

SEEDS = range(6)
MESHES = sorted(path.stem for path in OBJECT_MESHES.glob("*.obj"))
MOST_VISUALS = {
    **dict.fromkeys(SPECIES, 2),
    "lamp_post": 5,
    "lamp_post_double": 5,
    "traffic_light": 5,
    "sign_round": 2,
    "bench": 1,
    "bus_shelter": 3,
    "hatchback": 2,
    "suv": 2,
    "van": 2,
    "box_truck": 3,
    "bus": 2,
}


def build(name, seed):
    return OBJECTS[name].build(np.random.default_rng([seed, 11]))


@pytest.mark.sampled(30)
@pytest.mark.parametrize("name", OBJECTS)
def test_same_generator_same_bytes(name):
    a, b = build(name, 1), build(name, 1)
    assert a.parts == b.parts
    assert a.footprint.equals(b.footprint)
    assert {k: m.to_obj() for k, m in a.meshes.items()} == {
        k: m.to_obj() for k, m in b.meshes.items()
    }


@pytest.mark.sampled(30)
@pytest.mark.parametrize("name", OBJECTS)
def test_model_is_complete(name):
    assert OBJECTS[name].semantic_class in CLASS_IDS
    for seed in SEEDS:
        model = build(name, seed)
        names = [part.name for part in model.parts]
        assert len(set(names)) == len(names) > 0
        used = {
            part.shape.mesh
            for part in model.parts
            if isinstance(part.shape, MeshShape)
        }
        assert used == set(model.meshes)
        for part in model.parts:
            assert "/" not in part.name
            assert part.rgb is None or all(0 <= c <= 1 for c in part.rgb)
            assert np.isfinite([*part.xyz, *part.rpy]).all()
            if isinstance(part.shape, MeshShape):
                # A negative factor would turn the mesh inside out.
                assert min(part.shape.scale) > 0


@pytest.mark.sampled(30)
@pytest.mark.parametrize("name", OBJECTS)
def test_its_lowest_point_is_on_the_ground_or_below(name):
    model = build(name, 2)
    low = [part_mesh(p, model.meshes).vertices[:, 2].min() for p in model.parts]
    assert min(low) < 0.02


@pytest.mark.sampled(30)
@pytest.mark.parametrize("name", OBJECTS)
def test_footprint_contains_the_geometry_near_the_ground(name):
    rng = np.random.default_rng(12)
    for seed in SEEDS:
        model = build(name, seed)
        assert model.footprint.is_valid
        points = np.concatenate(
            [surface_points(p, model.meshes, rng) for p in model.parts]
        )
        assert points[:, 2].min() > -1.0
        low = points[points[:, 2] < 2.3, :2]
        assert model.footprint.covers(MultiPoint(low))
        # Parts high above the ground occupy none of it.
        claimed = points[points[:, 2] < 2.6, :2]
        hull = MultiPoint(claimed).convex_hull
        assert hull.buffer(0.3).covers(model.footprint)


@pytest.mark.sampled(30)
@pytest.mark.parametrize("name", MESHES)
def test_meshes_obey_the_mesh_contract(name):
    vertices, faces = parse_obj((OBJECT_MESHES / f"{name}.obj").read_text())
    assert {len(face) for face in faces} <= {3, 4}
    written = Mesh(vertices, faces)
    assert out_of_plane(written) < 2e-3
    a, b, c = (vertices[written.triangles()[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    assert area.min() > 0


@pytest.mark.parametrize("name", MOST_VISUALS)
def test_few_visuals(name):
    for seed in SEEDS:
        assert len(build(name, seed).parts) <= MOST_VISUALS[name]


def test_budget_of_all_meshes():
    sizes = [(OBJECT_MESHES / f"{name}.obj").stat().st_size for name in MESHES]
    assert max(sizes) <= 80_000
    assert sum(sizes) <= 3_500_000


@pytest.mark.parametrize(
    "name",
    [
        "lamp_post",
        "lamp_post_curved",
        "lantern",
        "traffic_light",
        "sign_round",
        "sign_direction",
        "bollard",
        "bus_shelter",
        "flag_poles",
        "railing",
        "hoarding",
        "bench",
        "hydrant",
        *SPECIES,
    ],
)
def test_posts_and_trunks_reach_into_the_ground(name):
    rng = np.random.default_rng(13)
    for seed in SEEDS:
        model = build(name, seed)
        lowest = min(
            surface_points(p, model.meshes, rng, 2000)[:, 2].min()
            for p in model.parts
        )
        assert -0.9 <= lowest <= -0.28
