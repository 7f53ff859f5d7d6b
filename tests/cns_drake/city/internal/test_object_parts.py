from helpers.mesh_checks import rotation_matrix, surface_points
import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point

from cns_drake.city import (
    HEADROOM,
    OBJECTS,
    ROOT_DEPTH,
    CylinderShape,
    MeshShape,
    Part,
    SphereShape,
    assemble,
    bar,
    block,
    ground_footprint,
    part_mesh,
    post,
)
from cns_drake.city.geometry.mesh import box_mesh
from cns_drake.city.geometry.models import rotation
from cns_drake.city.geometry.object_models import in_a_row, pillar


def test_post_spans_from_the_root_to_its_height():
    part = post("mast", 0.1, 6.0, (1.0, -2.0))
    half = part.shape.length / 2
    assert part.xyz[:2] == (1.0, -2.0)
    assert part.xyz[2] + half == pytest.approx(6.0)
    assert part.xyz[2] - half == pytest.approx(-ROOT_DEPTH)


def test_rotation_is_that_of_sdf():
    rng = np.random.default_rng(4)
    for rpy in rng.uniform(-3, 3, (20, 3)):
        np.testing.assert_allclose(
            rotation(rpy), rotation_matrix(rpy), atol=1e-14
        )


def test_bar_ends_at_its_two_points():
    rng = np.random.default_rng(5)
    for start, end in rng.uniform(-3, 3, (20, 2, 3)):
        part = bar("arm", start, end, 0.05)
        half = [0.0, 0.0, part.shape.length / 2]
        R = rotation_matrix(part.rpy)
        np.testing.assert_allclose(part.xyz + R @ half, end, atol=1e-12)
        np.testing.assert_allclose(part.xyz - R @ half, start, atol=1e-12)


def test_footprint_ignores_what_hangs_above_the_headroom():
    mast = post("mast", 0.1, 5.0)
    high = block("sign", (3.0, 3.0, 0.5), (2.0, 0.0, HEADROOM + 0.26))
    low = block("sign", (3.0, 3.0, 0.5), (2.0, 0.0, HEADROOM + 0.24))
    assert assemble(mast, high).footprint.bounds[2] < 0.2
    assert assemble(mast, low).footprint.bounds[2] > 3.5


def test_footprint_cuts_a_slanted_part_at_the_headroom():
    # The post reaches from the ground to twice the headroom; half of it counts.
    lean = bar("lean", (0, 0, 0), (4.0, 0, 2 * HEADROOM), 0.001)
    assert assemble(lean).footprint.bounds[2] == pytest.approx(2.0, abs=0.03)


def test_footprint_holds_round_shapes_and_scaled_turned_meshes():
    parts = (
        Part("disc", CylinderShape(0.7, 0.1), rpy=(0.3, 1.1, 0.4)),
        Part("ball", SphereShape(0.5), xyz=(1.5, 0.2, 0.6)),
        Part(
            "crate",
            MeshShape("crate", (2.0, 0.5, 1.5)),
            (-1.0, 0.5, 0.3),
            (0.0, 0.0, 0.7),
        ),
    )
    meshes = {"crate": box_mesh((1.0, 1.0, 0.4))}
    footprint = ground_footprint(parts, meshes)
    rng = np.random.default_rng(6)
    for part in parts:
        points = surface_points(part, meshes, rng, 500)
        assert footprint.covers(MultiPoint(points[:, :2]))
    assert not footprint.contains(Point(2.2, 0.2))


@pytest.mark.parametrize("name", ["obelisk", "bench", "hedge", "palm", "van"])
def test_an_unknown_parameter_of_an_object_is_refused(name):
    with pytest.raises(TypeError, match="no parameter colour"):
        OBJECTS[name].build(np.random.default_rng(0), colour=1)


def test_a_pillar_stands_on_the_ground_and_reaches_below_it():
    part = pillar("case", 0.4, 0.6, 1.5, (2.0, 3.0), yaw=np.pi / 2)
    corners = part_mesh(part, {}).vertices
    np.testing.assert_allclose(corners.min(axis=0), (1.7, 2.8, -ROOT_DEPTH))
    np.testing.assert_allclose(corners.max(axis=0), (2.3, 3.2, 1.5))


@pytest.mark.parametrize("count", [1, 2, 5])
def test_things_in_a_row_are_equally_far_apart_about_0(count):
    places = [in_a_row(k, 1.5, count) for k in range(count)]
    np.testing.assert_allclose(np.diff(places), 1.5)
    assert sum(places) == pytest.approx(0.0)


def test_a_given_parameter_leaves_the_other_draws_alone():
    drawn, given = (
        OBJECTS["shrub"].build(np.random.default_rng(3), **parameters).parts[0]
        for parameters in ({}, {"height": 0.5})
    )
    assert given.shape.scale[2] == 0.5 != drawn.shape.scale[2]
    assert (given.shape.mesh, given.rpy) == (drawn.shape.mesh, drawn.rpy)
    assert given.rgb == drawn.rgb
