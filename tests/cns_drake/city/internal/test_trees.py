import itertools

from helpers.building_checks import cast
from helpers.mesh_checks import out_of_plane, surface_points
import numpy as np
import pytest

from cns_drake.city import OBJECTS, SPECIES, MeshShape
from cns_drake.city.geometry.object_models import object_mesh
from cns_drake.city.plants import mesh_names

VARIANTS = [
    (name, variant)
    for name, kind in SPECIES.items()
    for variant in range(kind.variants)
]


def tree_meshes(name, variant):
    """Returns the wood and the leaves."""
    return [object_mesh(part) for part in mesh_names(name, variant)]


def vertices(model, part_name):
    """Returns the vertices of a part in the structure frame."""
    (part,) = (p for p in model.parts if p.name == part_name)
    mesh = model.meshes[part.shape.mesh]
    count = len(mesh.vertices)
    rng = np.random.default_rng(0)
    return surface_points(part, model.meshes, rng, 1)[-count:]


def test_enough_species_and_variants():
    assert len(SPECIES) >= 6
    assert all(3 <= kind.variants <= 5 for kind in SPECIES.values())


@pytest.mark.parametrize("name", SPECIES)
def test_height_is_as_asked(name):
    low, high = SPECIES[name].height_range
    assert 5.0 <= low < high <= 18.0
    for height in (low, (low + high) / 2, high):
        for variant in range(SPECIES[name].variants):
            model = OBJECTS[name].build(
                np.random.default_rng(variant), height=height, variant=variant
            )
            top = max(vertices(model, p)[:, 2].max() for p in ("wood", "crown"))
            # Scales are rounded to 0.001.
            assert top == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize("name", sorted(SPECIES.keys() - {"spruce", "willow"}))
def test_people_can_walk_under_street_trees(name):
    low, high = SPECIES[name].height_range
    for seed, height in itertools.product(range(10), (low, high)):
        model = OBJECTS[name].build(np.random.default_rng(seed), height=height)
        assert vertices(model, "crown")[:, 2].min() >= 2.5
        wood = vertices(model, "wood")
        head_high = wood[(wood[:, 2] > -0.1) & (wood[:, 2] < 2.2), :2]
        assert np.linalg.norm(head_high, axis=1).max() < 0.6
        assert model.footprint.area < 0.7


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_size_of_the_meshes(name, variant):
    meshes = tree_meshes(name, variant)
    triangles = sum(mesh.num_triangles for mesh in meshes)
    assert 800 <= triangles <= 3000
    for mesh in meshes:
        assert len(mesh.to_obj()) <= 60_000


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_crown_lets_about_half_of_the_rays_in(name, variant):
    """Rays rise like those of a LiDAR and cross the crown's ellipsoid."""
    wood, crown = tree_meshes(name, variant)
    low, high = np.percentile(crown.vertices, [1, 99], axis=0)
    center, half = (low + high) / 2, (high - low) / 2
    rng = np.random.default_rng([variant, 3])
    n = 300
    # The rays pass points that are uniform in the unit ball.
    p = rng.standard_normal((n, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    p *= np.cbrt(rng.uniform(size=(n, 1)))
    azimuth = rng.uniform(-np.pi, np.pi, n)
    elevation = rng.uniform(0, np.radians(22.5), n)
    d = np.column_stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    q = d / half
    a, b, c = (q * q).sum(1), (p * q).sum(1), (p * p).sum(1) - 1
    root = np.sqrt(b * b - a * c)
    enter, leave = (-b - root) / a, (-b + root) / a
    origins = center + p * half + enter[:, None] * d
    triangles = [mesh.vertices[mesh.triangles()] for mesh in (crown, wood)]
    _, hits = cast(np.concatenate(triangles), origins, d)
    chord = leave - enter
    assert 0.2 <= (hits >= chord).mean() <= 0.7
    assert 0.3 <= (hits >= chord / 2).mean() <= 0.8
    # Some returns come from inside the crown, not only from its surface.
    inside = (hits > 0.25 * chord) & (hits < 0.9 * chord)
    assert inside.mean() > 0.1


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_leaves_are_exactly_plane_after_rounding(name, variant):
    _, crown = tree_meshes(name, variant)
    if name != "palm":  # Palm fronds have ribs, which are no leaves.
        assert {len(face) for face in crown.faces} == {4}
    assert out_of_plane(crown) < 1e-6


@pytest.mark.parametrize("name", SPECIES)
def test_no_two_trees_look_alike(name):
    models = [
        OBJECTS[name].build(np.random.default_rng([s, 8])) for s in range(20)
    ]
    for a, b in itertools.combinations(models, 2):
        assert a.parts[1].shape.scale != b.parts[1].shape.scale
        assert a.parts[1].rpy != b.parts[1].rpy
    crowns = {m.parts[1].shape.mesh for m in models}
    assert len(crowns) == SPECIES[name].variants
    scale = np.array([m.parts[1].shape.scale for m in models])
    assert np.ptp(scale[:, 0] / scale[:, 1]) > 0.05


def test_variants_differ():
    for name, kind in SPECIES.items():
        texts = {
            mesh.to_obj()
            for variant in range(kind.variants)
            for mesh in tree_meshes(name, variant)
        }
        assert len(texts) == 2 * kind.variants


@pytest.mark.parametrize("height", [0.6, 1.0, 1.8])
def test_shrub_height(height):
    for seed in range(6):
        model = OBJECTS["shrub"].build(
            np.random.default_rng(seed), height=height
        )
        part = model.parts[0]
        assert isinstance(part.shape, MeshShape)
        z = model.meshes[part.shape.mesh].vertices[:, 2] * part.shape.scale[2]
        assert z.max() == pytest.approx(height, rel=0.2)


def test_flower_bed_fills_its_length_and_width():
    model = OBJECTS["flower_bed"].build(
        np.random.default_rng(0), length=7.0, width=2.0
    )
    x0, y0, x1, y1 = model.footprint.bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((7.0, 2.0), abs=0.06)
