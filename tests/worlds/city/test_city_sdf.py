"""The SDF text, read back by Drake."""

from helpers.internal.shipped_cities import parse_strictly
import numpy as np
from pydrake.geometry import Box, Cylinder, Mesh, Role, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
import pytest
from shapely.geometry import box

from worlds.city import world_sdf
from worlds.shapes import (
    BoxShape,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    SphereShape,
    Structure,
    part_mesh,
)

PARTS = (
    Part("a_box", BoxShape((1.0, 2.0, 3.0)), (1, 2, 3), (0.1, -0.2, 0.3)),
    Part("a_pole", CylinderShape(0.25, 4.0), (-1, 0.5, 2), (0, 1.5, -2.0)),
    Part("a_ball", SphereShape(0.75), (0, 0, 5), rgb=(0.1, 0.2, 0.3)),
    Part("a_mesh", MeshShape("brick", (1, 2, 0.5)), (3, 0, 0), (0, 0, 2.5)),
)


@pytest.fixture(scope="module")
def inspector(tmp_path_factory):
    folder = tmp_path_factory.mktemp("world")
    (folder / "meshes").mkdir()
    mesh = part_mesh(Part("cube", BoxShape((1.0, 1.0, 1.0))), {})
    (folder / "meshes" / "brick.obj").write_text(mesh.to_obj())
    model = Model(PARTS, {"brick": mesh}, box(-1, -1, 1, 1))
    structure = Structure(
        "tower_017", "building", model, (10.0, -20.0, 0.5), yaw=0.7
    )
    sdf = folder / "stage_01.sdf"
    sdf.write_text(world_sdf("w", [structure], comment="a -- b"))
    return parse_strictly(sdf).model_inspector()


def geometry(inspector, name):
    ids = inspector.GetAllGeometryIds(Role.kPerception)
    return next(g for g in ids if inspector.GetName(g) == name)


def test_every_part_is_a_visual_and_nothing_else(inspector):
    names = [
        inspector.GetName(g)
        for g in inspector.GetAllGeometryIds(Role.kPerception)
    ]
    assert names == [f"w::tower_017/{part.name}" for part in PARTS]
    assert not inspector.GetAllGeometryIds(Role.kProximity)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_poses_compose(inspector, part):
    X_WS = RigidTransform(RollPitchYaw(0, 0, 0.7), [10.0, -20.0, 0.5])
    X_SP = RigidTransform(RollPitchYaw(part.rpy), part.xyz)
    found = inspector.GetPoseInFrame(
        geometry(inspector, f"w::tower_017/{part.name}")
    )
    np.testing.assert_allclose(
        found.GetAsMatrix34(), (X_WS @ X_SP).GetAsMatrix34(), atol=5.1e-4
    )


def test_shapes_and_colours_arrive(inspector):
    shapes = [
        inspector.GetShape(geometry(inspector, f"w::tower_017/{p.name}"))
        for p in PARTS
    ]
    a_box, pole, ball, mesh = shapes
    assert isinstance(a_box, Box)
    np.testing.assert_allclose(a_box.size(), [1, 2, 3])
    assert isinstance(pole, Cylinder)
    assert (pole.radius(), pole.length()) == (0.25, 4.0)
    assert isinstance(ball, Sphere)
    assert ball.radius() == 0.75
    assert isinstance(mesh, Mesh)
    np.testing.assert_allclose(mesh.scale3(), [1, 2, 0.5])
    properties = inspector.GetPerceptionProperties(
        geometry(inspector, "w::tower_017/a_ball")
    )
    rgba = properties.GetProperty("phong", "diffuse")
    rgb = (rgba.r(), rgba.g(), rgba.b())
    assert rgb == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
