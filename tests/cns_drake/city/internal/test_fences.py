from helpers.mesh_checks import first_hit, is_closed, solids, surface_points
import numpy as np
import pytest

from cns_drake.city import OBJECTS, MeshShape
from cns_drake.city.furniture.fences import FENCE_KINDS
from cns_drake.city.geometry.object_models import object_mesh

LENGTHS = (1.3, 5.0, 12.4, 37.0)


def points(model):
    rng = np.random.default_rng(1)
    return np.concatenate(
        [surface_points(p, model.meshes, rng, 4000) for p in model.parts]
    )


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", FENCE_KINDS)
def test_length_is_as_asked(name, length):
    model = OBJECTS[name].build(np.random.default_rng(0), length=length)
    x = points(model)[:, 0]
    assert x.min() == pytest.approx(-length / 2, abs=0.07)
    assert x.max() == pytest.approx(length / 2, abs=0.07)


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", FENCE_KINDS)
def test_leaves_the_next_run_its_room(name, length):
    # Runs in a row are 6 cm apart; outlines are 2 cm too large.
    model = OBJECTS[name].build(np.random.default_rng(0), length=length)
    x0, _, x1, _ = model.footprint.bounds
    assert x0 > -length / 2 - 0.03
    assert x1 < length / 2 + 0.03


@pytest.mark.parametrize("name", FENCE_KINDS)
def test_height_is_as_asked(name):
    kind = FENCE_KINDS[name]
    for height in (0.8 * kind.height, 1.4 * kind.height):
        model = OBJECTS[name].build(
            np.random.default_rng(0), length=9.0, height=height
        )
        z = points(model)[:, 2]
        assert z.max() == pytest.approx(height, rel=0.08)
        if name != "site_fence":  # It stands on its posts.
            assert z.min() <= -0.3


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", FENCE_KINDS)
def test_panels_join_without_a_gap(name, length):
    kind = FENCE_KINDS[name]
    model = OBJECTS[name].build(np.random.default_rng(0), length=length)
    runs = [p for p in model.parts if isinstance(p.shape, MeshShape)]
    end = -length / 2
    for part in runs:
        assert part.xyz[0] == pytest.approx(end, abs=1e-3)
        panels = int(part.shape.mesh.rsplit("_x", 1)[1])
        end += panels * kind.panel * part.shape.scale[0]
    assert end == pytest.approx(length / 2, abs=5e-3)
    assert len(model.parts) <= 5 + length / (8 * kind.panel)


@pytest.mark.parametrize("name", FENCE_KINDS)
def test_panels_are_made_of_closed_solids(name):
    for count in (1, 2, 4, 8):
        mesh = object_mesh(f"{name}_x{count}")
        assert is_closed(mesh)
        assert all(volume > 0 for _, volume in solids(mesh))


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_length_must_be_positive(length):
    with pytest.raises(ValueError, match="hedge"):
        OBJECTS["hedge"].build(np.random.default_rng(0), length=length)


def share_hit(name):
    """The share of level rays across a fence that hit it."""
    mesh = object_mesh(f"{name}_x4")
    rng = np.random.default_rng(2)
    x = rng.uniform(0.3, 4 * FENCE_KINDS[name].panel - 0.3, 600)
    z = rng.uniform(0.3, 0.7, 600)
    origins = np.column_stack([x, np.full(600, 5.0), z])
    d = np.tile((0.0, -1.0, 0.0), (600, 1))
    hits = first_hit(mesh.vertices, mesh.triangles(), origins, d)
    return np.isfinite(hits).mean()


def test_rays_pass_fences_but_not_walls():
    assert 0.05 < share_hit("railing") < 0.35
    assert 0.03 < share_hit("site_fence") < 0.3
    assert 0.5 < share_hit("picket_fence") < 0.85
    for name in ("garden_wall", "hoarding", "hedge"):
        assert share_hit(name) == 1.0
